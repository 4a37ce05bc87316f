//! Export rules: what crosses a link, and how. What no rule names does not cross.

use super::{Class, LinkConfig};
use aldis_envelope::{Address, EntityId, Envelope, Label, Prefix, Role};
use std::collections::BTreeSet;
use std::time::Duration;

/// How the newest sample is told from others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Newest {
    /// By instance: the class `state`.
    #[default]
    Instance,
    /// One for the whole stream, whatever its instances.
    Stream,
}

/// One rule. What it does not say matches everything.
#[derive(Debug, Clone)]
pub struct Rule {
    /// What the message is: its descriptor begins so.
    pub descriptor: String,
    /// Where it goes: the prefix of its address.
    pub address: Option<Prefix>,
    /// The entities whose messages it is for.
    pub sources: BTreeSet<EntityId>,
    /// How it crosses.
    pub class: Class,
    /// The lifespan it gets where it has none or a longer one.
    pub lifespan: Option<Duration>,
    /// The least time between two samples of an instance.
    pub interval: Duration,
    /// What counts as one thing of which the newest is enough.
    pub newest: Newest,
    /// The part of the link's bytes that it may take, in per cent.
    pub share: u8,
}

impl Rule {
    /// A rule for all messages of a class whose descriptor begins so.
    pub fn new(descriptor: &str, class: Class) -> Self {
        Self {
            descriptor: descriptor.to_owned(),
            address: None,
            sources: BTreeSet::new(),
            class,
            lifespan: None,
            interval: Duration::ZERO,
            newest: Newest::default(),
            share: 100,
        }
    }

    fn matches(&self, label: &Label) -> bool {
        label.descriptor().starts_with(&self.descriptor)
            && self.address.as_ref().is_none_or(|prefix| prefix.matches(&label.address))
            && (self.sources.is_empty() || self.sources.contains(&label.source().entity))
    }

    /// What must be subscribed to so that all broadcasts are seen that the rule may name.
    fn prefix(&self) -> Option<Prefix> {
        self.address.clone().or_else(|| Prefix::new(&self.descriptor).ok())
    }
}

/// How a message crosses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Treatment {
    /// Its class.
    pub class: Class,
    /// What is left of its lifespan, in milliseconds.
    pub lifespan_left_ms: Option<u32>,
    /// The least time between two samples of its instance.
    pub interval: Duration,
    /// What counts as one thing.
    pub newest: Newest,
    /// Which rule said so, from 0.
    pub rule: usize,
}

/// Why a message does not cross.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stays {
    /// No rule names it.
    NoRule,
    /// It is for an entity that is not behind this link.
    OtherEntity,
    /// It comes from behind this link.
    FromThere,
}

/// The rules of one link.
#[derive(Debug, Clone)]
pub struct Export {
    /// The entities behind the link.
    pub behind: BTreeSet<EntityId>,
    /// The rules; the first that matches decides.
    pub rules: Vec<Rule>,
}

impl Export {
    /// Which rule names messages with a label, from 0.
    ///
    /// # Errors
    /// Why they stay.
    pub fn rule_of(&self, label: &Label) -> Result<usize, Stays> {
        if self.behind.contains(&label.source().entity) {
            return Err(Stays::FromThere);
        }
        if label.address.entity().is_some_and(|to| !self.behind.contains(&to)) {
            return Err(Stays::OtherEntity);
        }
        self.rules.iter().position(|rule| rule.matches(label)).ok_or(Stays::NoRule)
    }

    /// How a message crosses by the rule that names its label. `destination` is the entity that its content is for, where that is
    /// known: a command keeps its topic as its address, but goes towards its destination alone.
    ///
    /// # Errors
    /// Why it stays.
    pub fn treat(
        &self,
        number: usize,
        envelope: &Envelope,
        destination: Option<EntityId>,
    ) -> Result<Treatment, Stays> {
        if self.behind.contains(&envelope.stamp.node) {
            return Err(Stays::FromThere);
        }
        if destination.is_some_and(|to| !self.behind.contains(&to)) {
            return Err(Stays::OtherEntity);
        }
        let rule = self.rules.get(number).ok_or(Stays::NoRule)?;
        let own = envelope.stamp.lifespan_left_ms;
        let given = rule.lifespan.map(|lifespan| lifespan.as_millis().min(u32::MAX.into()) as u32);
        let call = envelope.message.call.as_deref();
        // Who has called waits no longer than this.
        let waits = call.and_then(|call| match call.role {
            Role::Request { time_left_ms } => Some(time_left_ms),
            _ => None,
        });
        // A part of a call is for one receiver and is not repeated: it is a command whatever the rule makes of its like.
        let class = if call.is_some() { Class::Command } else { rule.class };
        Ok(Treatment {
            class,
            lifespan_left_ms: own.into_iter().chain(given).chain(waits).min(),
            interval: rule.interval,
            newest: rule.newest,
            rule: number,
        })
    }

    /// Both at once, for a message that is met once.
    ///
    /// # Errors
    /// Why it stays.
    pub fn decide(&self, envelope: &Envelope, destination: Option<EntityId>) -> Result<Treatment, Stays> {
        self.treat(self.rule_of(&envelope.message.label)?, envelope, destination)
    }

    /// What must be subscribed to so that all that may cross is seen: what is for the entities behind the link, and what rules name.
    pub fn prefixes(&self) -> Vec<Prefix> {
        let behind = self.behind.iter().map(|&entity| Prefix::Id(Address::Entity(entity)));
        behind.chain(self.rules.iter().filter_map(Rule::prefix)).collect()
    }
}

/// A link of a node: its two ends and what crosses.
#[derive(Debug, Clone)]
pub struct LinkSpec {
    /// Its name, for people.
    pub name: String,
    /// The protocol's part.
    pub link: LinkConfig,
    /// What crosses.
    pub export: Export,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::body::tests::envelope;
    use aldis_envelope::{Call, CallId};
    use std::sync::Arc;

    fn entity(number: u64) -> EntityId {
        EntityId::new(number).unwrap()
    }

    fn export(rules: Vec<Rule>) -> Export {
        Export { behind: [entity(1)].into(), rules }
    }

    fn to(address: &str) -> Envelope {
        let mut envelope = envelope(1, b"");
        let label = (*envelope.message.label).clone();
        envelope.message.label = Arc::new(Label { address: Address::new(address).unwrap(), ..label });
        envelope
    }

    #[test]
    fn the_first_rule_that_matches_decides_and_nothing_else_crosses() {
        let first =
            Rule { lifespan: Some(Duration::from_secs(5)), ..Rule::new("UMAA::MM::", Class::Command) };
        let both = export(vec![first, Rule::new("UMAA::", Class::State)]);
        let treatment = both.decide(&envelope(1, b""), None).unwrap();
        assert_eq!(
            (treatment.class, treatment.rule, treatment.lifespan_left_ms),
            (Class::Command, 0, Some(5_000))
        );
        let none = export(vec![Rule::new("UMAA::SO::", Class::State)]);
        assert_eq!(none.decide(&envelope(1, b""), None), Err(Stays::NoRule));
        let addressed = Rule { address: Prefix::new("eid1").ok(), ..Rule::new("", Class::State) };
        assert_eq!(export(vec![addressed.clone()]).decide(&envelope(1, b""), None), Err(Stays::NoRule));
        assert!(export(vec![addressed]).decide(&to("eid1sid9"), None).is_ok());
    }

    #[test]
    fn what_has_a_destination_goes_towards_it_alone_and_nothing_goes_back() {
        let all = export(vec![Rule::new("", Class::State)]);
        assert_eq!(all.decide(&to("eid9sid9"), None), Err(Stays::OtherEntity));
        assert_eq!(all.decide(&envelope(1, b""), Some(entity(9))), Err(Stays::OtherEntity));
        assert!(all.decide(&envelope(1, b""), Some(entity(1))).is_ok());
        let back = Export { behind: [entity(400)].into(), ..all };
        assert_eq!(back.decide(&envelope(1, b""), None), Err(Stays::FromThere));
    }

    #[test]
    fn calls_are_commands_and_lifespans_are_never_made_longer() {
        let rule = Rule { lifespan: Some(Duration::from_secs(5)), ..Rule::new("", Class::State) };
        let mut call = to("eid1sid9");
        call.stamp.lifespan_left_ms = Some(700);
        call.message.call = Some(Box::new(Call { id: CallId(1), role: Role::Request { time_left_ms: 700 } }));
        let treatment = export(vec![rule]).decide(&call, None).unwrap();
        assert_eq!((treatment.class, treatment.lifespan_left_ms), (Class::Command, Some(700)));
    }
}
