//! Support Operations in version 6.0: what differs from 5.2.1 (umaa-so, Version 6.0). Described here, and
//! translated where a bridge meets it; the nodes speak 5.2.1 among themselves.

use super::structure::{Described, Members};
use super::{LargeSetMetadata, v5_2_1};
use crate::description::{
    Definition, DescriptionError, Draft, Extensibility, Library, Member, Structure, Topic, Type,
};
use crate::guid::Guid;
use crate::time::DateTime;

/// Who is meant, and what it is a part of.
pub const IDENTIFIER: &str = "UMAA::Common::IdentifierType";

/// Members that are a GUID in 5.2.1 and an identifier in 6.0, alone or in a sequence.
const IDENTIFIERS: [&str; 6] =
    ["source", "destination", "resourceID", "controllingConsumer", "relatedSources", "priorities"];

const HEALTH: &str = "UMAA::SO::HealthReport::HealthReportType";
const CONFIG: &str = "UMAA::SO::ResourceAllocation::ResourceAllocationConfigReportType";
const PRIORITY_REPORT: &str = "UMAA::SO::ResourceAllocation::ResourceAllocationPriorityReportType";
const PRIORITY_INFO: &str = "UMAA::SO::ResourceAllocation::ResourceAllocationPriorityInfo";
const DEFINITION: &str = "UMAA::SO::ResourceAllocation::ResourceAllocationDefinitionType";

/// The topic of the elements of a configuration's resources, and their type.
pub const RESOURCES_ELEMENT: &str =
    "UMAA::SO::ResourceAllocation::ResourceAllocationConfigReportTypeResourcesSetElement";

/// All topics: each has the name of its type.
pub fn topics() -> Vec<Topic> {
    let names = super::topics().map(|topic| topic.type_name).chain([RESOURCES_ELEMENT]);
    names.map(|name| Topic { name: name.to_owned(), type_name: name.to_owned() }).collect()
}

/// Everything that the topics are made of.
///
/// # Errors
/// [`DescriptionError`], which a test rules out.
pub fn library() -> Result<Library, Vec<DescriptionError>> {
    draft().map_err(|error| vec![error])?.finish()
}

fn draft() -> Result<Draft, DescriptionError> {
    let mut draft = Draft::default();
    let mut identifier = Members::default();
    identifier.add::<Guid>(&mut draft, "id", false)?;
    identifier.add::<Guid>(&mut draft, "parentID", false)?;
    identifier.define(&mut draft, IDENTIFIER)?;
    let older = v5_2_1::library().map_err(|mut errors| errors.remove(0))?;
    for (name, definition) in older.definitions().filter(|(name, _)| *name != CONFIG) {
        let newer = match definition {
            Definition::Structure(structure) => Definition::Structure(newer(name, structure)),
            other => other.clone(),
        };
        draft.add(name, newer)?;
    }
    let metadata = LargeSetMetadata::described(&mut draft)?;
    draft.add(CONFIG, config_report(metadata))?;
    let mut element = Members::default();
    element.add::<Element>(&mut draft, "element", false)?;
    element.add::<Guid>(&mut draft, "setID", true)?;
    element.add::<Guid>(&mut draft, "elementID", true)?;
    element.add::<DateTime>(&mut draft, "elementTimestamp", false)?;
    element.define(&mut draft, RESOURCES_ELEMENT)?;
    Ok(draft)
}

/// The value of an element of a configuration's resources, which the older version defines too.
struct Element;

impl Described for Element {
    fn described(_: &mut Draft) -> Result<Type, DescriptionError> {
        Ok(Type::named(DEFINITION))
    }
}

fn newer(type_name: &str, structure: &Structure) -> Structure {
    let mut members = structure.members.clone();
    for member in &mut members {
        if IDENTIFIERS.contains(&member.name.as_str()) {
            member.r#type = identified(&member.r#type);
        }
        let bound = match (type_name, member.name.as_str()) {
            (PRIORITY_REPORT, "priorities") => Some(24),
            (PRIORITY_INFO, "priorities") => Some(64),
            _ => None,
        };
        if let (Type::Sequence { bound: old, .. }, Some(new)) = (&mut member.r#type, bound) {
            *old = Some(new);
        }
    }
    if type_name == HEALTH {
        health(&mut members);
    }
    Structure { members, ..structure.clone() }
}

/// A GUID as an identifier; everything else as it is.
fn identified(r#type: &Type) -> Type {
    match r#type {
        Type::Named(name) if name.ends_with("::NumericGUID") => Type::named(IDENTIFIER),
        Type::Sequence { element, bound } => Type::sequence(identified(element), *bound),
        other => other.clone(),
    }
}

/// The code is a part of the key and stands before the resource; the status may be absent.
fn health(members: &mut Vec<Member>) {
    let code = members.remove(0);
    let place = members.len() - 1;
    members.insert(place, code.key());
    for (id, member) in (0..).zip(members) {
        member.id = id;
        member.optional |= member.name == "status";
    }
}

/// The resources are a large set.
fn config_report(metadata: Type) -> Definition {
    let members = vec![
        Member::new(0, "timeStamp", Type::named("UMAA::Common::Measurement::DateTime")),
        Member::new(1, "source", Type::named(IDENTIFIER)).key(),
        Member::new(2, "resourcesSetMetadata", metadata),
    ];
    Definition::Structure(Structure { extensibility: Extensibility::Appendable, base: None, members })
}
