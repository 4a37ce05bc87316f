//! Which type a topic has.

use super::IdlError;
use super::scope::{Scopes, TopicConstant};
use crate::description::{Definition, Topic};
use std::collections::BTreeMap;

/// The topics by their names. A constant `…XTopic` names the topic of the structure `X` or `XType` beside it, or that of the
/// structure that its text names.
pub(super) fn topics(scopes: &mut Scopes, errors: &mut Vec<IdlError>) -> Vec<Topic> {
    let mut found: BTreeMap<String, String> = BTreeMap::new();
    for constant in std::mem::take(&mut scopes.topics) {
        let TopicConstant { topic, file, line, .. } = &constant;
        let error = |what: String| IdlError { file: file.clone(), line: *line, what };
        let Some(type_name) = type_of(scopes, &constant) else {
            let cure = "call a structure so, or take the constant out";
            errors.push(error(format!("the topic `{topic}` has no type: {cure}")));
            continue;
        };
        match found.get(topic) {
            Some(other) if *other != type_name => {
                errors.push(error(format!("the topic `{topic}` has two types, `{other}` and `{type_name}`")));
            }
            _ => drop(found.insert(topic.clone(), type_name)),
        }
    }
    found.into_iter().map(|(name, type_name)| Topic { name, type_name }).collect()
}

fn type_of(scopes: &Scopes, constant: &TopicConstant) -> Option<String> {
    if let Some(annotated) = &constant.type_name {
        return Some(annotated.clone());
    }
    let beside = constant.name.strip_suffix("Topic").unwrap_or(&constant.name).trim_end_matches('_');
    let candidates = [
        beside.to_owned(),
        format!("{beside}Type"),
        constant.topic.clone(),
        format!("{}Type", constant.topic),
    ];
    let is_structure = |name: &String| matches!(scopes.draft.get(name), Some(Definition::Structure(_)));
    candidates.into_iter().find(is_structure)
}
