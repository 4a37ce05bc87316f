//! What a value of each type is sure to hold: that it ends, and how much it is.

use super::library::innermost_name;
use super::{ARRAY_ELEMENTS_MAX, DEPTH_MAX, Definition, Fault, MEMBERS_MAX, Type};
use std::collections::BTreeMap;

/// What is always there in a value of a type.
#[derive(Debug, Clone, Copy, Default)]
struct Weight {
    /// Numbers and texts, elements of arrays counted.
    values: u64,
    /// Members, elements of arrays not counted.
    members: u64,
    /// How deep it is nested.
    depth: usize,
}

impl Weight {
    const ONE: Self = Self { values: 1, members: 1, depth: 1 };

    fn and(self, other: Self) -> Result<Self, Fault> {
        let sum = Self {
            values: self.values.saturating_add(other.values),
            members: self.members.saturating_add(other.members),
            depth: self.depth.max(other.depth),
        };
        sum.bounded()
    }

    fn bounded(self) -> Result<Self, Fault> {
        if self.values > ARRAY_ELEMENTS_MAX {
            Err(Fault::ArrayTooLarge)
        } else if self.members > MEMBERS_MAX {
            Err(Fault::TooManyMembers)
        } else if self.depth > DEPTH_MAX {
            Err(Fault::TooDeep)
        } else {
            Ok(self)
        }
    }
}

/// The weights of definitions, each found once.
pub(super) struct Weights<'a> {
    definitions: &'a BTreeMap<String, Definition>,
    open: Vec<&'a str>,
    known: BTreeMap<&'a str, Result<Weight, Fault>>,
}

impl<'a> Weights<'a> {
    pub(super) fn new(definitions: &'a BTreeMap<String, Definition>) -> Self {
        Self { definitions, open: Vec::new(), known: BTreeMap::new() }
    }

    /// Whether a value of a definition ends within all bounds.
    pub(super) fn of_name(&mut self, name: &'a str) -> Result<(), Fault> {
        self.weigh(name).map(drop)
    }

    fn weigh(&mut self, name: &'a str) -> Result<Weight, Fault> {
        if let Some(known) = self.known.get(name) {
            return known.clone();
        }
        if self.open.contains(&name) {
            return Err(Fault::HoldsItself);
        }
        if self.open.len() >= DEPTH_MAX {
            return Err(Fault::TooDeep);
        }
        let Some(definition) = self.definitions.get(name) else { return Ok(Weight::ONE) };
        self.open.push(name);
        let held = self.of_definition(definition);
        self.open.pop();
        let weight = held.and_then(|held| Weight { depth: held.depth + 1, ..held }.bounded());
        self.known.insert(name, weight.clone());
        weight
    }

    fn of_definition(&mut self, definition: &'a Definition) -> Result<Weight, Fault> {
        match definition {
            Definition::Enumeration(_) | Definition::Bitmask(_) => Ok(Weight::ONE),
            Definition::Alias(other) => self.of_type(other),
            Definition::Structure(structure) => {
                let base = structure.base.as_deref();
                let base = base.map_or(Ok(Weight::default()), |base| self.weigh(base))?;
                let mut sure = structure.members.iter().filter(|member| !member.optional);
                sure.try_fold(base, |sum, member| sum.and(self.of_type(&member.r#type)?))
            }
            // All cases together are more than one, but of the same order.
            Definition::Union(union) => {
                let mut cases = union.cases.iter().map(|case| &case.member.r#type);
                cases.try_fold(Weight::ONE, |sum, held| sum.and(self.of_type(held)?))
            }
        }
    }

    fn of_type(&mut self, r#type: &'a Type) -> Result<Weight, Fault> {
        match r#type {
            Type::Named(name) => self.weigh(name),
            Type::Array { element, dimensions } => {
                let mut weight = self.of_type(element)?;
                for dimension in dimensions {
                    let values = weight.values.max(1).saturating_mul((*dimension).into());
                    weight = Weight { values, ..weight }.bounded()?;
                }
                Ok(weight)
            }
            // It may be empty; only its other names must end.
            Type::Sequence { element, .. } => match innermost_name(element) {
                Some(name) if matches!(self.definitions.get(name), Some(Definition::Alias(_))) => {
                    self.weigh(name).map(|_| Weight::ONE)
                }
                _ => Ok(Weight::ONE),
            },
            _ => Ok(Weight::ONE),
        }
    }
}
