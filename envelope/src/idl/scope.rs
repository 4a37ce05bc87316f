//! Names and what they stand for, in modules and in what is inside of them (IDL 4.2, 7.5).

use super::constant::Constant;
use crate::description::Draft;
use std::collections::BTreeMap;

/// What all files together have declared so far.
#[derive(Default)]
pub(super) struct Scopes {
    /// Types by their fully scoped names.
    pub(super) draft: Draft,
    /// Where each of them stands.
    pub(super) places: BTreeMap<String, (String, usize)>,
    /// Structures and unions that have been announced, or are being declared.
    pub(super) announced: BTreeMap<String, (String, usize)>,
    /// Constants, and values of enumerations as constants of the scope around them.
    pub(super) constants: BTreeMap<String, Constant>,
    /// Constants that name topics: their scoped names and texts, with their places.
    pub(super) topics: Vec<TopicConstant>,
}

/// A constant that names a topic, or a structure that is annotated as one.
#[derive(Debug, Clone)]
pub(super) struct TopicConstant {
    /// Its scoped name.
    pub(super) name: String,
    /// The topic's name.
    pub(super) topic: String,
    /// The type, where the annotation stands on it.
    pub(super) type_name: Option<String>,
    pub(super) file: String,
    pub(super) line: usize,
}

impl Scopes {
    /// The type that a name means inside of a scope.
    pub(super) fn type_name(&self, scope: &[String], name: &str) -> Option<String> {
        let known = |full: &str| self.draft.get(full).is_some() || self.announced.contains_key(full);
        candidates(scope, name).find(|full| known(full))
    }

    /// The constant that a name means inside of a scope.
    pub(super) fn constant(&self, scope: &[String], name: &str) -> Option<&Constant> {
        candidates(scope, name).find_map(|full| self.constants.get(&full))
    }
}

/// The full names that a name may mean, innermost first. One that begins with `::` is full already.
fn candidates<'a>(scope: &'a [String], name: &'a str) -> impl Iterator<Item = String> + 'a {
    let absolute = name.strip_prefix("::");
    let least = if absolute.is_some() { scope.len() } else { 0 };
    let plain = absolute.unwrap_or(name);
    (least..=scope.len()).rev().map(move |depth| {
        let depth = if absolute.is_some() { 0 } else { depth };
        joined(&scope[..depth], plain)
    })
}

/// A name inside of a scope, in full.
pub(super) fn joined(scope: &[String], name: &str) -> String {
    if scope.is_empty() { name.to_owned() } else { format!("{}::{name}", scope.join("::")) }
}
