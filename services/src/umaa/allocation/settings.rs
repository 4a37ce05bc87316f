//! What an arbiter is told: its resources, and how long it waits.

use super::super::command::ProviderSettings;
use aldis_envelope::{EntityId, Guid};
use std::collections::BTreeSet;
use std::time::Duration;

/// The most resources of one arbiter: a priority report of version 5.2.1 holds no more (umaa-so, ResourceAllocation).
pub const RESOURCES_MAX: usize = 32;
/// The most consumers in a priority list, and providers of a resource (tables 31 and 32).
pub const MEMBERS_MAX: usize = 100;

/// A resource that an arbiter gives control of: providers of which one consumer at a time commands all.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Resource {
    /// Its GUID.
    pub id: Guid,
    /// Its name, for people.
    pub name: String,
    /// The consumers that may control it, from low to high priority. Empty: nobody until a priority command comes.
    pub priorities: Vec<Guid>,
    /// The providers of the resource. Each may command the others (nested providers).
    pub related_sources: Vec<Guid>,
}

/// How an arbiter works.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArbiterSettings {
    /// What it gives control of.
    pub resources: Vec<Resource>,
    /// How long the readers of a report have to confirm it.
    pub acknowledge_within: Duration,
    /// How long a reader may be silent before it no longer counts. The report is repeated five times in it, and a guard
    /// believes its copy for three fifths of it.
    pub reader_lease: Duration,
    /// The entities whose services may set priorities, beside the arbiter's own.
    pub priority_from: Vec<EntityId>,
    /// Whether the priorities of a former life go before those of the configuration.
    pub recover_priorities: bool,
    /// How many allocations may be asked for at a time.
    pub sessions_max: usize,
    /// Whether the update of a finished command is answered with FAILED / SERVICE_FAILED.
    pub answer_finished_update: bool,
}

impl Default for ArbiterSettings {
    fn default() -> Self {
        Self {
            resources: Vec::new(),
            acknowledge_within: Duration::from_secs(5),
            reader_lease: Duration::from_secs(10),
            priority_from: Vec::new(),
            recover_priorities: true,
            sessions_max: 64,
            answer_finished_update: false,
        }
    }
}

/// Why an arbiter cannot work as it is told.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SettingsError {
    /// There are more resources than a priority report holds.
    #[error(
        "{count} resources, {RESOURCES_MAX} fit a priority report: `{first}` and those after it do not; give them to a second arbiter"
    )]
    TooManyResources {
        /// How many there are.
        count: usize,
        /// The first one too many.
        first: String,
    },
    /// Two resources have one GUID.
    #[error("resources `{one}` and `{other}` have the GUID {id}: each needs its own")]
    SameResource {
        /// The GUID.
        id: Guid,
        /// The name of one.
        one: String,
        /// The name of the other.
        other: String,
    },
    /// A list is longer than a report holds.
    #[error("resource `{resource}` has {count} {what}: {MEMBERS_MAX} fit a report")]
    TooManyMembers {
        /// The resource.
        resource: String,
        /// What is in the list.
        what: &'static str,
        /// How many there are.
        count: usize,
    },
    /// A consumer stands twice in a priority list.
    #[error("the priorities of resource `{resource}` name {consumer} twice: its rank must be one")]
    SameConsumer {
        /// The resource.
        resource: String,
        /// The consumer.
        consumer: Guid,
    },
    /// The lease is not longer than the wait for confirmations.
    #[error(
        "reader_lease ({lease:?}) must be longer than acknowledge_within ({within:?}): else a reader that is gone is never missed"
    )]
    LeaseTooShort {
        /// The lease.
        lease: Duration,
        /// The wait.
        within: Duration,
    },
}

/// Settings that an arbiter can work by.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Arbitration(ArbiterSettings);

impl Arbitration {
    /// Checks settings.
    ///
    /// # Errors
    /// [`SettingsError`] with what is wrong and what to do.
    pub fn new(settings: ArbiterSettings) -> Result<Self, SettingsError> {
        let (resources, count) = (&settings.resources, settings.resources.len());
        if let Some(first) = resources.get(RESOURCES_MAX) {
            return Err(SettingsError::TooManyResources { count, first: first.name.clone() });
        }
        for (place, resource) in resources.iter().enumerate() {
            if let Some(other) = resources[..place].iter().find(|other| other.id == resource.id) {
                let (one, other) = (other.name.clone(), resource.name.clone());
                return Err(SettingsError::SameResource { id: resource.id, one, other });
            }
            check(resource)?;
        }
        let (lease, within) = (settings.reader_lease, settings.acknowledge_within);
        if lease <= within {
            return Err(SettingsError::LeaseTooShort { lease, within });
        }
        Ok(Self(settings))
    }

    /// The settings.
    pub fn settings(&self) -> &ArbiterSettings {
        &self.0
    }

    /// How the arbiter's own providers treat their commands. A start is bounded by the confirmations.
    pub(super) fn commands(&self) -> ProviderSettings {
        let ArbiterSettings { sessions_max, answer_finished_update, .. } = self.0;
        let start_within = Some(self.0.acknowledge_within * 2);
        ProviderSettings { sessions_max, start_within, answer_finished_update, ..ProviderSettings::default() }
    }
}

fn check(resource: &Resource) -> Result<(), SettingsError> {
    let lists = [("priorities", &resource.priorities), ("related sources", &resource.related_sources)];
    for (what, list) in lists {
        if list.len() > MEMBERS_MAX {
            let (resource, count) = (resource.name.clone(), list.len());
            return Err(SettingsError::TooManyMembers { resource, what, count });
        }
    }
    match twice(&resource.priorities) {
        Some(consumer) => Err(SettingsError::SameConsumer { resource: resource.name.clone(), consumer }),
        None => Ok(()),
    }
}

/// The first GUID that a list names twice.
pub(super) fn twice(list: &[Guid]) -> Option<Guid> {
    let mut known = BTreeSet::new();
    list.iter().copied().find(|&member| !known.insert(member))
}

/// How often a report is repeated: a reader that misses one or two still knows that it is up to date.
pub(super) fn repeat_every(reader_lease: Duration) -> Duration {
    reader_lease / 5
}

/// How long a guard believes a report that is not repeated. One that was last heard a repetition before the link broke is
/// given up four fifths of the lease after that, so before its node leaves the set of readers.
pub(super) fn believed_for(reader_lease: Duration) -> Duration {
    reader_lease * 3 / 5
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resource(number: u8, priorities: Vec<Guid>) -> Resource {
        Resource {
            id: Guid([number; 16]),
            name: format!("r{number}"),
            priorities,
            related_sources: Vec::new(),
        }
    }

    fn error(settings: ArbiterSettings) -> String {
        Arbitration::new(settings).unwrap_err().to_string()
    }

    fn with(resources: Vec<Resource>) -> ArbiterSettings {
        ArbiterSettings { resources, ..ArbiterSettings::default() }
    }

    #[test]
    fn what_cannot_be_is_refused_by_name() {
        let many = (0..33).map(|number| resource(number, Vec::new()));
        assert!(Arbitration::new(with(many.clone().take(32).collect())).is_ok());
        assert!(error(with(many.collect())).contains("`r32` and those after it"));
        let same = error(with(vec![
            resource(1, Vec::new()),
            Resource { name: "x".into(), ..resource(1, Vec::new()) },
        ]));
        assert!(same.contains("`r1` and `x`"), "{same}");
        let named_twice = error(with(vec![resource(1, vec![Guid([7; 16]), Guid([8; 16]), Guid([7; 16])])]));
        assert!(named_twice.contains("twice"), "{named_twice}");
        let many: Vec<_> = (0..101).map(|number| Guid([number; 16])).collect();
        assert!(error(with(vec![resource(1, many)])).contains("101 priorities"));
        let lease = Duration::from_secs(5);
        assert!(
            error(ArbiterSettings { reader_lease: lease, ..ArbiterSettings::default() })
                .contains("reader_lease")
        );
    }

    #[test]
    fn a_guard_gives_up_before_it_is_given_up() {
        let lease = Duration::from_secs(10);
        assert!(believed_for(lease) + repeat_every(lease) < lease);
        assert!(believed_for(lease) >= 3 * repeat_every(lease));
    }
}
