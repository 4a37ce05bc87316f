//! Members of a sample by their names.

use aldis_envelope::Guid;
use serde_json::Value;

/// All members that are keys in some topic.
const KEY_MEMBERS: [&str; 5] = ["source", "sessionID", "destination", "resourceID", "elementID"];

/// A sample, or the key of one.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sample(Value);

impl Sample {
    pub(super) fn new(value: Value) -> Self {
        Self(value)
    }

    pub(super) fn value(&self) -> &Value {
        &self.0
    }

    pub(super) fn guid(&self, member: &str) -> Option<Guid> {
        guid(&self.0[member])
    }

    pub(super) fn text(&self, member: &str) -> Option<&str> {
        self.0[member].as_str()
    }

    pub(super) fn time(&self, member: &str) -> Option<(i64, i64)> {
        time(&self.0[member])
    }

    /// The samples in a member that is a sequence.
    pub(super) fn list(&self, member: &str) -> impl Iterator<Item = Self> + '_ {
        self.0[member].as_array().into_iter().flatten().cloned().map(Self)
    }

    /// The GUIDs in a member that is a sequence of them.
    pub(super) fn guids(&self, member: &str) -> Vec<Guid> {
        self.0[member].as_array().into_iter().flatten().filter_map(guid).collect()
    }

    /// Those of its members that may be its key.
    pub(super) fn key(&self) -> Self {
        let members =
            KEY_MEMBERS.iter().filter_map(|name| Some(((*name).to_owned(), self.0.get(*name)?.clone())));
        Self(Value::Object(members.collect()))
    }

    /// Who it is of, for people.
    pub(super) fn key_text(&self) -> String {
        let told = KEY_MEMBERS.iter().filter_map(|name| Some(format!("{name} {}", self.text(name)?)));
        told.collect::<Vec<_>>().join(", ")
    }
}

pub(super) fn guid(value: &Value) -> Option<Guid> {
    value.as_str()?.parse().ok()
}

/// Seconds and nanoseconds: in this order they compare as times do.
pub(super) fn time(value: &Value) -> Option<(i64, i64)> {
    Some((value["seconds"].as_i64()?, value["nanoseconds"].as_i64()?))
}
