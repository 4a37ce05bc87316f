//! Definitions by their names.

use super::{Definition, DescriptionError, Enumeration, Fault, Member, Structure, Type, Union, check};
use std::collections::{BTreeMap, BTreeSet};

/// Definitions that are collected and not yet known to be sound.
#[derive(Debug, Clone, Default)]
pub struct Draft {
    pub(super) definitions: BTreeMap<String, Definition>,
}

impl Draft {
    /// Adds a definition. The same one again changes nothing.
    ///
    /// # Errors
    /// [`Fault::BadName`], and [`Fault::DefinedTwice`] where the name stands for something else already.
    pub fn add(&mut self, name: impl Into<String>, definition: Definition) -> Result<(), DescriptionError> {
        let name = name.into();
        let fault = match self.definitions.get(&name) {
            _ if !is_scoped_name(&name) => Fault::BadName,
            Some(known) if *known != definition => Fault::DefinedTwice,
            _ => {
                self.definitions.insert(name, definition);
                return Ok(());
            }
        };
        Err(DescriptionError { type_name: name, member: None, fault })
    }

    /// The definition of a name so far.
    pub fn get(&self, name: &str) -> Option<&Definition> {
        self.definitions.get(name)
    }

    /// The definitions as a sound library.
    ///
    /// # Errors
    /// Everything that is wrong, in the order of the names.
    pub fn finish(self) -> Result<Library, Vec<DescriptionError>> {
        let errors = check::check(&self.definitions);
        if errors.is_empty() { Ok(Library { definitions: self.definitions }) } else { Err(errors) }
    }
}

/// Sound definitions by their fully scoped names.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Library {
    definitions: BTreeMap<String, Definition>,
}

impl Library {
    /// The definition of a name.
    pub fn get(&self, name: &str) -> Option<&Definition> {
        self.definitions.get(name)
    }

    /// The definition of a name, with the name as it is kept here.
    pub fn entry(&self, name: &str) -> Option<(&str, &Definition)> {
        self.definitions.get_key_value(name).map(|(name, definition)| (name.as_str(), definition))
    }

    /// All definitions by their names.
    pub fn definitions(&self) -> impl Iterator<Item = (&str, &Definition)> {
        self.definitions.iter().map(|(name, definition)| (name.as_str(), definition))
    }

    /// What a type is once all its other names are taken away. Only a type of another library is left as a name.
    pub fn resolved<'a>(&'a self, mut r#type: &'a Type) -> Resolved<'a> {
        while let Type::Named(name) = r#type {
            match self.definitions.get_key_value(name) {
                Some((_, Definition::Alias(other))) => r#type = other,
                Some((name, definition)) => return Resolved::Defined(name, definition),
                None => break,
            }
        }
        Resolved::Plain(r#type)
    }

    /// The structure of that name, through its other names.
    pub fn structure(&self, name: &str) -> Option<&Structure> {
        match self.resolved_name(name)? {
            Definition::Structure(structure) => Some(structure),
            _ => None,
        }
    }

    /// The union of that name, through its other names.
    pub fn union(&self, name: &str) -> Option<&Union> {
        match self.resolved_name(name)? {
            Definition::Union(union) => Some(union),
            _ => None,
        }
    }

    /// The enumeration of that name, through its other names.
    pub fn enumeration(&self, name: &str) -> Option<&Enumeration> {
        match self.resolved_name(name)? {
            Definition::Enumeration(enumeration) => Some(enumeration),
            _ => None,
        }
    }

    /// All members of a structure, inherited ones first.
    pub fn members<'a>(&'a self, structure: &'a Structure) -> Vec<&'a Member> {
        let mut chain = vec![structure];
        while let Some(base) = chain.last().and_then(|last| self.structure(last.base.as_deref()?)) {
            chain.push(base);
        }
        chain.iter().rev().flat_map(|structure| &structure.members).collect()
    }

    /// The names of all definitions that a type is made of, itself included, each after those that it needs: the order in which
    /// they can be declared to others. Of types that hold sequences of each other one must come first.
    pub fn needed_by(&self, name: &str) -> Vec<&str> {
        let mut ordered = Vec::new();
        let (mut met, mut open) = (BTreeSet::new(), Vec::new());
        open.extend(self.definitions.get_key_value(name));
        while let Some(&(name, definition)) = open.last() {
            met.insert(name.as_str());
            let mut needed = used_by(definition).into_iter();
            match needed.find_map(|used| {
                self.definitions.get_key_value(used).filter(|it| !met.contains(it.0.as_str()))
            }) {
                Some(next) => open.push(next),
                None => {
                    ordered.push(name.as_str());
                    open.pop();
                }
            }
        }
        ordered
    }

    fn resolved_name(&self, name: &str) -> Option<&Definition> {
        match self.get(name)? {
            Definition::Alias(other) => match self.resolved(other) {
                Resolved::Defined(_, definition) => Some(definition),
                Resolved::Plain(_) => None,
            },
            definition => Some(definition),
        }
    }
}

/// A type without its other names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resolved<'a> {
    /// It is not defined by name: a number, a text, a sequence, an array.
    Plain(&'a Type),
    /// It is this definition, by its own name.
    Defined(&'a str, &'a Definition),
}

/// The names that a definition uses itself.
pub(super) fn used_by(definition: &Definition) -> Vec<&str> {
    let types: Vec<&Type> = match definition {
        Definition::Enumeration(_) | Definition::Bitmask(_) => Vec::new(),
        Definition::Alias(other) => vec![other],
        Definition::Structure(structure) => structure.members.iter().map(|member| &member.r#type).collect(),
        Definition::Union(union) => {
            let cases = union.cases.iter().map(|case| &case.member.r#type);
            std::iter::once(&union.discriminator).chain(cases).collect()
        }
    };
    let base = match definition {
        Definition::Structure(structure) => structure.base.as_deref(),
        _ => None,
    };
    base.into_iter().chain(types.into_iter().filter_map(innermost_name)).collect()
}

/// The name inside sequences and arrays.
pub(super) fn innermost_name(mut r#type: &Type) -> Option<&str> {
    loop {
        match r#type {
            Type::Sequence { element, .. } | Type::Array { element, .. } => r#type = element,
            Type::Named(name) => return Some(name),
            _ => return None,
        }
    }
}

/// Whether a text is an identifier.
fn is_identifier(text: &str) -> bool {
    let part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    text.chars().all(part) && text.starts_with(|c: char| !c.is_ascii_digit() && part(c))
}

fn is_scoped_name(text: &str) -> bool {
    text.split("::").all(is_identifier)
}
