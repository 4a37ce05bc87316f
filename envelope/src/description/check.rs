//! What must hold for definitions together.

use super::library::used_by;
use super::weight::Weights;
use super::{
    Bitmask, DEPTH_MAX, Definition, DescriptionError, Enumeration, Fault, MEMBER_ID_MAX, Member, Structure,
    Type, Union,
};
use std::collections::{BTreeMap, BTreeSet};

type Definitions = BTreeMap<String, Definition>;
/// A fault, with the member that it is in.
type Found = (Option<String>, Fault);

/// Everything that is wrong, in the order of the names. What walks through several definitions is looked at once all names are known.
pub(super) fn check(definitions: &Definitions) -> Vec<DescriptionError> {
    let errors = collect(definitions, |(_, definition)| alone(definition, definitions));
    if !errors.is_empty() {
        return errors;
    }
    let mut weights = Weights::new(definitions);
    collect(definitions, |named| together(named, definitions, &mut weights))
}

fn collect<'a>(
    definitions: &'a Definitions,
    mut faults: impl FnMut((&'a str, &'a Definition)) -> Vec<Found>,
) -> Vec<DescriptionError> {
    let mut errors = Vec::new();
    for (name, definition) in definitions {
        let found = faults((name, definition)).into_iter();
        errors.extend(found.map(|(member, fault)| DescriptionError {
            type_name: name.clone(),
            member,
            fault,
        }));
    }
    errors
}

/// What is wrong with a definition by itself, names that it uses included.
fn alone(definition: &Definition, definitions: &Definitions) -> Vec<Found> {
    let mut found: Vec<Found> = Vec::new();
    let unknown = used_by(definition).into_iter().filter(|used| !definitions.contains_key(*used));
    found.extend(unknown.map(|used| (None, Fault::UnknownType(used.to_owned()))));
    match definition {
        Definition::Enumeration(enumeration) => of_enumeration(enumeration, &mut found),
        Definition::Bitmask(bitmask) => of_bitmask(bitmask, &mut found),
        Definition::Structure(structure) => {
            structure.members.iter().for_each(|member| of_member(member, &mut found));
        }
        Definition::Union(union) => {
            union.cases.iter().for_each(|case| of_member(&case.member, &mut found));
            of_union(union, &mut found);
        }
        Definition::Alias(other) => found.extend(of_type(other).map(|fault| (None, fault))),
    }
    found
}

fn of_enumeration(enumeration: &Enumeration, found: &mut Vec<Found>) {
    let Enumeration { bit_bound, literals, default, .. } = enumeration;
    if literals.is_empty() {
        found.push((None, Fault::Empty));
    }
    if !(1..=32).contains(bit_bound) {
        return found.push((None, Fault::BadBitBound { found: *bit_bound, max: 32 }));
    }
    twice(literals.iter().map(|(name, value)| (name.as_str(), i64::from(*value))), found);
    // Values of fewer bits are taken with or without a sign.
    let fits = |value: i64| value >= -(1 << (bit_bound - 1)) && value < 1 << bit_bound;
    let over = literals.iter().find(|(_, value)| !fits((*value).into()));
    found.extend(over.map(|(name, value)| {
        (Some(name.clone()), Fault::DoesNotFit { value: (*value).into(), bits: *bit_bound })
    }));
    let unknown = default.filter(|default| enumeration.name_of(*default).is_none());
    found.extend(unknown.map(|default| (None, Fault::UnknownDefault(default))));
}

fn of_bitmask(bitmask: &Bitmask, found: &mut Vec<Found>) {
    let bits = bitmask.bit_bound;
    if !(1..=64).contains(&bits) {
        found.push((None, Fault::BadBitBound { found: bits, max: 64 }));
    }
    twice(bitmask.flags.iter().map(|(name, place)| (name.as_str(), i64::from(*place))), found);
    let over = bitmask.flags.iter().find(|(_, place)| *place >= bits);
    found.extend(
        over.map(|(name, place)| (Some(name.clone()), Fault::DoesNotFit { value: (*place).into(), bits })),
    );
}

fn of_member(member: &Member, found: &mut Vec<Found>) {
    let faults = [
        (member.id > MEMBER_ID_MAX).then_some(Fault::IdTooHigh(member.id)),
        (member.key && member.optional).then_some(Fault::OptionalKey),
        of_type(&member.r#type),
    ];
    found.extend(faults.into_iter().flatten().map(|fault| (Some(member.name.clone()), fault)));
}

fn of_union(union: &Union, found: &mut Vec<Found>) {
    if union.cases.is_empty() {
        found.push((None, Fault::Empty));
    }
    twice(union.cases.iter().map(|case| (case.member.name.as_str(), case.member.id.into())), found);
    let mut labels = BTreeSet::new();
    let again = union.cases.iter().flat_map(|case| &case.labels).filter(|label| !labels.insert(**label));
    found.extend(again.map(|label| (None, Fault::DuplicateNumber(*label))));
    if union.cases.iter().filter(|case| case.default).count() > 1 {
        found.push((None, Fault::TwoDefaults));
    }
    let silent = union.cases.iter().find(|case| case.labels.is_empty() && !case.default);
    found.extend(silent.map(|case| (Some(case.member.name.clone()), Fault::NoLabel)));
}

/// What is wrong with bounds and dimensions.
fn of_type(mut r#type: &Type) -> Option<Fault> {
    for _ in 0..DEPTH_MAX {
        r#type = match r#type {
            Type::String { bound: Some(0) } | Type::WideString { bound: Some(0) } => {
                return Some(Fault::ZeroBound);
            }
            Type::Sequence { bound: Some(0), .. } => return Some(Fault::ZeroBound),
            Type::Array { dimensions, .. } if dimensions.is_empty() || dimensions.contains(&0) => {
                return Some(Fault::ZeroBound);
            }
            Type::Sequence { element, .. } | Type::Array { element, .. } => element,
            _ => return None,
        }
    }
    Some(Fault::TooDeep)
}

/// Names and numbers that are there twice.
fn twice<'a>(pairs: impl Iterator<Item = (&'a str, i64)>, found: &mut Vec<Found>) {
    let (mut names, mut numbers) = (BTreeSet::new(), BTreeSet::new());
    for (name, number) in pairs {
        if !names.insert(name) {
            found.push((None, Fault::DuplicateName(name.to_owned())));
        }
        if !numbers.insert(number) {
            found.push((Some(name.to_owned()), Fault::DuplicateNumber(number)));
        }
    }
}

/// What is wrong with a definition among others, all of whose names are known.
fn together<'a>(
    (name, definition): (&'a str, &Definition),
    definitions: &'a Definitions,
    weights: &mut Weights<'a>,
) -> Vec<Found> {
    // What holds itself, or is too deep, is told alone: nothing else can be said of it.
    if let Err(fault) = weights.of_name(name) {
        return vec![(None, fault)];
    }
    let mut found = Vec::new();
    match definition {
        Definition::Structure(structure) => inherited(structure, definitions, &mut found),
        Definition::Union(union) => discriminator(union, definitions, &mut found),
        _ => {}
    }
    found
}

fn inherited(structure: &Structure, definitions: &Definitions, found: &mut Vec<Found>) {
    let mut chain = vec![structure];
    while let Some(name) = chain.last().and_then(|last| last.base.as_deref()) {
        match unaliased(name, definitions) {
            Some(Definition::Structure(base)) if base.extensibility == structure.extensibility => {
                chain.push(base)
            }
            Some(Definition::Structure(_)) => {
                return found.push((None, Fault::BaseGrowsOtherwise(name.to_owned())));
            }
            _ => return found.push((None, Fault::BaseIsNoStructure(name.to_owned()))),
        }
    }
    let members = chain.iter().rev().flat_map(|structure| &structure.members);
    twice(members.map(|member| (member.name.as_str(), member.id.into())), found);
}

fn discriminator(union: &Union, definitions: &Definitions, found: &mut Vec<Found>) {
    let definition = match &union.discriminator {
        Type::Named(name) => unaliased(name, definitions),
        _ => None,
    };
    let plain = match (&union.discriminator, definition) {
        (_, Some(Definition::Alias(plain))) => plain,
        (plain, _) => plain,
    };
    let (min, max, bits) = match (plain, definition) {
        (_, Some(Definition::Enumeration(_))) => (i32::MIN.into(), i32::MAX.into(), 32),
        (Type::Boolean, _) => (0, 1, 1),
        (Type::Octet | Type::UInt8 | Type::Char8, _) => (0, u8::MAX.into(), 8),
        (Type::Int8, _) => (i8::MIN.into(), i8::MAX.into(), 8),
        (Type::Int16, _) => (i16::MIN.into(), i16::MAX.into(), 16),
        (Type::UInt16 | Type::Char16, _) => (0, u16::MAX.into(), 16),
        (Type::Int32, _) => (i32::MIN.into(), i32::MAX.into(), 32),
        (Type::UInt32, _) => (0, u32::MAX.into(), 32),
        (Type::Int64, _) => (i64::MIN, i64::MAX, 64),
        // A label is read as the bits that travel, so that all of them have a place.
        (Type::UInt64, _) => (i64::MIN, i64::MAX, 64),
        _ => return found.push((None, Fault::BadDiscriminator)),
    };
    for case in &union.cases {
        let over = case.labels.iter().find(|label| !(min..=max).contains(*label));
        found.extend(
            over.map(|value| (Some(case.member.name.clone()), Fault::DoesNotFit { value: *value, bits })),
        );
    }
}

/// The definition of a name; an alias only where it stands for no definition.
fn unaliased<'a>(name: &str, definitions: &'a Definitions) -> Option<&'a Definition> {
    let mut definition = definitions.get(name)?;
    // Every alias has been walked through already, so that this ends.
    while let Definition::Alias(Type::Named(other)) = definition {
        definition = definitions.get(other)?;
    }
    Some(definition)
}
