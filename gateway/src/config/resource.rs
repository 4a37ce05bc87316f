//! What the node's arbiter gives control of (UMAA ResourceAllocation).

use super::error::Fault;
use super::text::PlainName;
use aldis_envelope::{Address, EntityId, Guid, Guids};
use aldis_services::umaa::allocation::{ArbiterSettings, Arbitration, Resource as Allocated};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::time::Duration;

/// One `[[resource]]`: providers of which one consumer at a time commands all. A node with resources has an arbiter, its
/// service 10.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Resource {
    /// Its name; `aldis allocate` knows it as `400:autopilot`.
    pub(crate) name: PlainName,
    /// Its GUID. Default: made from fleet, entity and name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Party>")]
    pub(crate) guid: Option<Guid>,
    /// The consumers that may control it, from low to high priority. Default: nobody, until a command sets them.
    #[serde(default)]
    pub(crate) priorities: Vec<Party>,
    /// Its providers: each may command the others.
    #[serde(default)]
    pub(crate) related: Vec<Party>,
}

/// The `[allocation]` table: how the arbiter works.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Allocation {
    /// How long the readers of a report have to confirm it before control is refused, below 10 000. Default: 5000.
    #[schemars(range(min = 1, max = 9999))]
    pub(crate) acknowledge_within_ms: u32,
    /// Whether priorities that a command has set go before those of this file after a restart. Default: true.
    pub(crate) recover_priorities: bool,
    /// Whether the update of a finished command is answered with FAILED / SERVICE_FAILED. Default: false.
    pub(crate) answer_finished_update: bool,
}

impl Default for Allocation {
    fn default() -> Self {
        Self { acknowledge_within_ms: 5_000, recover_priorities: true, answer_finished_update: false }
    }
}

/// A service of UMAA: `eid400sid101` where it is one of ours, else its GUID.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub(crate) enum Party {
    /// A service by its ids.
    Service(aldis_envelope::Source),
    /// Any service by its GUID.
    Guid(Guid),
}

impl Party {
    /// Its GUID in a fleet.
    pub(crate) fn guid(&self, guids: &Guids) -> Guid {
        match self {
            Self::Service(source) => guids.of_service(*source),
            Self::Guid(guid) => *guid,
        }
    }
}

impl std::str::FromStr for Party {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        match (Address::new(text), text.parse()) {
            (Ok(Address::Service(source)), _) => Ok(Self::Service(source)),
            (_, Ok(guid)) => Ok(Self::Guid(guid)),
            _ => Err(format!("`{text}` is neither a service, such as `eid400sid101`, nor a GUID")),
        }
    }
}

impl TryFrom<String> for Party {
    type Error = String;
    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Party> for String {
    fn from(party: Party) -> String {
        match party {
            Party::Service(source) => source.to_string(),
            Party::Guid(guid) => guid.to_string(),
        }
    }
}

impl JsonSchema for Party {
    fn schema_name() -> Cow<'static, str> {
        "Party".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "description": "a service as `eid400sid101`, or a GUID" })
    }
}

/// What an arbiter is told; none where there is nothing to give control of.
pub(crate) fn arbitration(
    own: EntityId,
    guids: &Guids,
    (resources, allocation): (&[Resource], &Allocation),
    operators: Vec<EntityId>,
) -> Result<Option<Arbitration>, Fault> {
    if resources.is_empty() {
        return Ok(None);
    }
    let all = |parties: &[Party]| parties.iter().map(|party| party.guid(guids)).collect();
    let allocated = resources.iter().map(|resource| Allocated {
        id: resource.guid.unwrap_or_else(|| guids.of_resource(own, resource.name.as_str())),
        name: resource.name.as_str().to_owned(),
        priorities: all(&resource.priorities),
        related_sources: all(&resource.related),
    });
    let settings = ArbiterSettings {
        resources: allocated.collect(),
        acknowledge_within: Duration::from_millis(allocation.acknowledge_within_ms.into()),
        priority_from: operators,
        recover_priorities: allocation.recover_priorities,
        answer_finished_update: allocation.answer_finished_update,
        ..ArbiterSettings::default()
    };
    let wrong = |why: aldis_services::umaa::allocation::SettingsError| {
        Fault::new("resource", why.to_string(), "change the resources of this file")
    };
    Arbitration::new(settings).map(Some).map_err(wrong)
}

#[cfg(test)]
mod tests {
    use super::super::Config;

    const TOP: &str = "name = \"a\"\nentities = [400]\n";

    #[test]
    fn resources_make_an_arbiter() {
        let text = "[[resource]]\nname = \"autopilot\"\npriorities = [\"eid1sid100\"]\nrelated = [\"eid400sid101\"]\n";
        let config = Config::parse("", &format!("{TOP}{text}")).unwrap();
        let arbitration = config.arbitration().unwrap();
        let resource = &arbitration.settings().resources[0];
        assert_eq!((resource.priorities.len(), resource.related_sources.len()), (1, 1));
        assert_eq!(Config::parse("", TOP).unwrap().arbitration(), None);
    }

    #[test]
    fn what_no_arbiter_can_do_is_told() {
        let resource = "[[resource]]\nname = \"autopilot\"\n";
        for (wrong, told) in [
            (format!("{resource}{resource}"), "have the GUID"),
            (format!("{resource}priorities = [\"eid1sid100\", \"eid1sid100\"]"), "twice"),
            (format!("{resource}priorities = [\"somebody\"]"), "neither a service"),
            (format!("[allocation]\nacknowledge_within_ms = 10000\n{resource}"), "must be longer"),
        ] {
            let error = Config::parse("", &format!("{TOP}{wrong}")).unwrap_err();
            assert!(error.message().contains(told), "{wrong}: {}", error.message());
        }
    }
}
