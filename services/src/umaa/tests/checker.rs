//! Watches a bus from outside, in the order in which samples are written.

use crate::umaa::command::table::Transition;
use aldis_envelope::umaa::{
    self, Command, CommandAckReport, CommandKey, CommandState, CommandStatus, CommandStatusReason, Key,
    ResourceAllocationCommand, SessionKey, Topic,
};
use aldis_envelope::{Change, Envelope, Guid};
use std::any::Any;
use std::collections::{BTreeMap, BTreeSet};

/// What is held against the bus, and what was seen on it.
#[derive(Default)]
pub(crate) struct Checker {
    families: Vec<Box<dyn Watch>>,
    pub(crate) violations: Vec<String>,
    pub(crate) transitions: BTreeSet<Transition>,
}

trait Watch: Any {
    fn published(&mut self, envelope: &Envelope, found: &mut Found);
    fn lost(&mut self, envelope: &Envelope);
    fn left(&self) -> Vec<String>;
    /// Whose commands are executed: provider and consumer.
    fn executing(&self) -> Vec<(Guid, Guid)>;
    fn is_allocation(&self) -> bool;
}

#[derive(Default)]
struct Found {
    violations: Vec<String>,
    transitions: Vec<Transition>,
}

/// One family of commands.
struct Family<C> {
    commands: BTreeMap<CommandKey, C>,
    sessions: BTreeMap<SessionKey, Seen>,
}

#[derive(Default)]
struct Seen {
    state: Option<CommandState>,
    /// Whether a status, an acknowledgement, an execution status is on the bus.
    on_bus: [bool; 3],
    consumer: Option<Guid>,
}

impl Checker {
    pub(crate) fn watch<C: Command>(&mut self) {
        self.families.push(Box::new(Family::<C> { commands: BTreeMap::new(), sessions: BTreeMap::new() }));
    }

    pub(crate) fn published(&mut self, envelope: &Envelope) {
        let mut found = Found::default();
        self.families.iter_mut().for_each(|family| family.published(envelope, &mut found));
        self.transitions.extend(found.transitions);
        self.violations.extend(found.violations);
        self.one_holder();
    }

    pub(crate) fn lost(&mut self, envelope: &Envelope) {
        self.families.iter_mut().for_each(|family| family.lost(envelope));
    }

    /// What has not been cleaned up.
    pub(crate) fn left(&self) -> Vec<String> {
        self.families.iter().flat_map(|family| family.left()).collect()
    }

    /// At most one allocation of the one resource of these tests is executed.
    fn one_holder(&mut self) {
        let holders: Vec<_> = self
            .families
            .iter()
            .filter(|family| family.is_allocation())
            .flat_map(|family| family.executing())
            .collect();
        if holders.len() > 1 {
            self.violations.push(format!("two holders: {holders:?}"));
        }
    }

    /// Nobody is executed but the holder. Holds where no link has been silent.
    pub(crate) fn strangers(&self) -> Vec<String> {
        let (allocations, others): (Vec<_>, Vec<_>) =
            self.families.iter().partition(|family| family.is_allocation());
        let Some((_, holder)) = allocations.iter().flat_map(|family| family.executing()).next() else {
            return Vec::new();
        };
        let executed = others.iter().flat_map(|family| family.executing());
        let strange = executed.filter(|(_, consumer)| *consumer != holder);
        strange
            .map(|(provider, consumer)| format!("{provider} executes {consumer}, {holder} controls"))
            .collect()
    }
}

impl<C: Command> Family<C> {
    fn command_of(&self, key: SessionKey) -> Option<&C> {
        let of =
            |command: &CommandKey| (command.destination, command.session_id) == (key.source, key.session_id);
        self.commands.iter().find(|(command, _)| of(command)).map(|(_, command)| command)
    }

    fn command(&mut self, envelope: &Envelope, found: &mut Found) {
        let key = envelope
            .message
            .instance
            .as_deref()
            .and_then(CommandKey::of_instance)
            .unwrap_or_else(|| umaa::decode::<C>(&envelope.message.content).unwrap().key());
        match envelope.message.change {
            Change::Put => {
                let command = umaa::decode::<C>(&envelope.message.content).unwrap();
                if let Some(known) = self.commands.get(&key)
                    && known.header().time_stamp >= command.header().time_stamp
                {
                    found.violations.push(format!("an update of {key:?} is not newer"));
                }
                self.commands.insert(key, command);
            }
            Change::Dispose => {
                self.commands.remove(&key);
            }
            Change::Unregister => {}
        }
    }

    fn status(&mut self, status: &CommandStatus<C>, found: &mut Found) {
        let (to, reason) = (status.command_status, status.command_status_reason);
        let consumer = self.command_of(status.key()).map(|command| command.header().source);
        let seen = self.sessions.entry(status.key()).or_default();
        let transition = Transition { from: seen.state, to, reason };
        found.transitions.push(transition);
        if !transition.is_legal() {
            found.violations.push(format!("{} of {:?}: {transition:?}", C::NAME, status.key()));
        }
        if to == CommandState::Commanded && !seen.on_bus[1] {
            found.violations.push(format!("{:?} is COMMANDED without an acknowledgement", status.key()));
        }
        seen.consumer = seen.consumer.or(consumer);
        (seen.state, seen.on_bus[0]) = (Some(to), true);
        if to == CommandState::Canceled && reason == CommandStatusReason::Canceled && consumer.is_some() {
            found.violations.push(format!("{:?} is CANCELED, its command is on the bus", status.key()));
        }
    }

    /// What a provider says beside statuses: an acknowledgement (1) or an execution status (2).
    fn report(&mut self, place: usize, key: SessionKey, found: &mut Found) {
        let seen = self.sessions.entry(key).or_default();
        seen.on_bus[place] = true;
        if place == 2 && seen.state != Some(CommandState::Executing) {
            found.violations.push(format!("an execution status of {key:?} in {:?}", seen.state));
        }
    }

    fn ended(&mut self, place: usize, key: SessionKey, change: Change, found: &mut Found) {
        if change == Change::Dispose && self.command_of(key).is_some() {
            found.violations.push(format!("{key:?} is cleaned up before its command is disposed"));
        }
        if let Some(seen) = self.sessions.get_mut(&key) {
            seen.on_bus[place] = false;
            if seen.on_bus == [false; 3] {
                self.sessions.remove(&key);
            }
        }
    }
}

impl<C: Command> Watch for Family<C> {
    fn published(&mut self, envelope: &Envelope, found: &mut Found) {
        let (message, name) = (&envelope.message, envelope.message.label.descriptor());
        let names = [C::STATUS_NAME, C::ACK_REPORT_NAME, C::ExecutionStatus::NAME];
        if name == C::NAME {
            self.command(envelope, found);
        } else if let Some(place) = names.iter().position(|known| *known == name) {
            let key = message.instance.as_deref().and_then(SessionKey::of_instance);
            match (message.change, place) {
                (Change::Put, 0) => self.status(&umaa::decode(&message.content).unwrap(), found),
                (Change::Put, 1) => {
                    let ack = umaa::decode::<CommandAckReport<C>>(&message.content).unwrap();
                    if self.command_of(ack.key()).is_some_and(|command| *command != ack.command) {
                        let newer = self.command_of(ack.key()).unwrap().header().time_stamp;
                        let is_old = newer > ack.command.header().time_stamp;
                        assert!(is_old, "an acknowledgement differs from its command");
                    }
                    self.report(1, ack.key(), found);
                }
                (Change::Put, _) => {
                    let status = umaa::decode::<C::ExecutionStatus>(&message.content).unwrap();
                    self.report(2, status.key(), found);
                }
                (change, place) => self.ended(place, key.unwrap(), change, found),
            }
        }
    }

    fn lost(&mut self, envelope: &Envelope) {
        let name = envelope.message.label.descriptor();
        let names = [C::STATUS_NAME, C::ACK_REPORT_NAME, C::ExecutionStatus::NAME];
        if let Some(place) = names.iter().position(|known| *known == name) {
            let key = envelope.message.instance.as_deref().and_then(SessionKey::of_instance);
            self.ended(place, key.unwrap(), Change::Unregister, &mut Found::default());
        }
    }

    fn left(&self) -> Vec<String> {
        let commands = self.commands.keys().map(|key| format!("command {key:?}"));
        let sessions = self.sessions.iter();
        commands
            .chain(sessions.map(|(key, seen)| format!("{key:?} {:?} {:?}", seen.state, seen.on_bus)))
            .collect()
    }

    fn executing(&self) -> Vec<(Guid, Guid)> {
        let executing = self.sessions.iter().filter(|(_, seen)| seen.state == Some(CommandState::Executing));
        executing.filter_map(|(key, seen)| Some((key.source, seen.consumer?))).collect()
    }

    fn is_allocation(&self) -> bool {
        C::NAME == ResourceAllocationCommand::NAME
    }
}
