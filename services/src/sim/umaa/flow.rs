//! Flow control watched from outside, in the order in which samples are written: legal transitions alone, acknowledgements
//! before COMMANDED, clean-up in its order, and what is left at the end.

use crate::umaa::command::table::Transition;
use aldis_envelope::umaa::{
    self, Command, CommandAckReport, CommandKey, CommandState, CommandStatus, CommandStatusReason, Key,
    ResourceAllocationCommand, SessionKey, Topic,
};
use aldis_envelope::{Change, EntityId, Envelope, Guid, Source};
use std::any::Any;
use std::collections::{BTreeMap, BTreeSet};

/// What is held against the bus, and what was seen on it.
#[derive(Default)]
pub(crate) struct Flow {
    families: Vec<Box<dyn Watch>>,
    pub(crate) violations: Vec<String>,
    pub(crate) transitions: BTreeSet<Transition>,
    steps: Vec<Step>,
}

/// A command has come to another state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Step {
    /// The name of the commands' topic.
    pub(crate) family: &'static str,
    pub(crate) key: SessionKey,
    pub(crate) consumer: Option<Guid>,
    pub(crate) transition: Transition,
    /// Whether its consumer had disposed the command before.
    pub(crate) was_disposed: bool,
    /// Whether it is the first word of a provider that has started again since the word before.
    pub(crate) is_recovered: bool,
}

trait Watch: Any + Send {
    fn published(&mut self, envelope: &Envelope, found: &mut Found);
    #[cfg(test)]
    fn lost(&mut self, envelope: &Envelope);
    fn node_ended(&mut self, entity: EntityId);
    fn left(&self) -> Vec<String>;
    /// Whose commands are executed: provider and consumer.
    fn executing(&self) -> Vec<(Guid, Guid)>;
    fn is_allocation(&self) -> bool;
}

#[derive(Default)]
struct Found {
    violations: Vec<String>,
    steps: Vec<Step>,
}

/// One family of commands.
struct Family<C: Command> {
    commands: BTreeMap<CommandKey, C>,
    sessions: BTreeMap<SessionKey, Seen<C>>,
}

struct Seen<C: Command> {
    status: Option<CommandStatus<C>>,
    execution: Option<C::ExecutionStatus>,
    /// Whether a status, an acknowledgement, an execution status is on the bus.
    on_bus: [bool; 3],
    consumer: Option<Guid>,
    writer: Option<Source>,
    /// Whether the provider has ended without ending the command.
    was_interrupted: bool,
}

impl<C: Command> Default for Seen<C> {
    fn default() -> Self {
        Self {
            status: None,
            execution: None,
            on_bus: [false; 3],
            consumer: None,
            writer: None,
            was_interrupted: false,
        }
    }
}

impl<C: Command> Seen<C> {
    fn state(&self) -> Option<CommandState> {
        self.status.as_ref().map(|status| status.command_status)
    }
}

impl Flow {
    /// Watches a family of commands too.
    pub(crate) fn watch<C: Command>(&mut self) {
        self.families.push(Box::new(Family::<C> { commands: BTreeMap::new(), sessions: BTreeMap::new() }));
    }

    /// Something is written.
    pub(crate) fn published(&mut self, envelope: &Envelope) {
        let mut found = Found::default();
        self.families.iter_mut().for_each(|family| family.published(envelope, &mut found));
        self.transitions.extend(found.steps.iter().map(|step| step.transition));
        let moved = !found.steps.is_empty();
        self.steps.extend(found.steps);
        self.violations.extend(found.violations);
        if moved {
            self.one_holder();
        }
    }

    /// The steps since the last time.
    pub(crate) fn take_steps(&mut self) -> Vec<Step> {
        std::mem::take(&mut self.steps)
    }

    /// A sample that a writer retained is lost with its disk.
    #[cfg(test)]
    pub(crate) fn lost(&mut self, envelope: &Envelope) {
        self.families.iter_mut().for_each(|family| family.lost(envelope));
    }

    /// All writers of an entity have ended without a word.
    pub(crate) fn node_ended(&mut self, entity: EntityId) {
        self.families.iter_mut().for_each(|family| family.node_ended(entity));
    }

    /// What has not been cleaned up.
    pub(crate) fn left(&self) -> Vec<String> {
        self.families.iter().flat_map(|family| family.left()).collect()
    }

    fn holders(&self) -> Vec<(Guid, Guid)> {
        let allocations = self.families.iter().filter(|family| family.is_allocation());
        allocations.flat_map(|family| family.executing()).collect()
    }

    /// At most one allocation is executed: all are of one resource.
    fn one_holder(&mut self) {
        let holders = self.holders();
        if holders.len() > 1 {
            self.violations.push(format!("two holders: {holders:?}"));
        }
    }

    /// Nobody is executed but the holder, as far as provider and consumer are under its control. Holds where no link has been
    /// silent.
    pub(crate) fn strangers(&self, is_controlled: impl Fn(Guid, Guid) -> bool) -> Vec<String> {
        let Some(&(_, holder)) = self.holders().first() else { return Vec::new() };
        let others = self.families.iter().filter(|family| !family.is_allocation());
        let executed = others.flat_map(|family| family.executing());
        let strange =
            executed.filter(|&(provider, consumer)| consumer != holder && is_controlled(provider, consumer));
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
        let told = envelope.message.instance.as_deref().and_then(CommandKey::of_instance);
        match envelope.message.change {
            Change::Put => {
                let Some(command) = read::<C>(envelope, found) else { return };
                let key = told.unwrap_or_else(|| command.key());
                if let Some(known) = self.commands.get(&key)
                    && *known != command
                    && known.header().time_stamp >= command.header().time_stamp
                {
                    found.violations.push(format!("an update of {key:?} is not newer"));
                }
                self.commands.insert(key, command);
            }
            Change::Dispose => {
                told.map(|key| self.commands.remove(&key));
            }
            Change::Unregister => {}
        }
    }

    fn status(&mut self, status: &CommandStatus<C>, writer: Source, found: &mut Found) {
        let (to, reason) = (status.command_status, status.command_status_reason);
        let consumer = self.command_of(status.key()).map(|command| command.header().source);
        let seen = self.sessions.entry(status.key()).or_default();
        if seen.status.as_ref() == Some(status) {
            // A writer that has started again tells once more what it retains.
            seen.on_bus[0] = true;
            return;
        }
        let transition = Transition { from: seen.state(), to, reason };
        seen.consumer = seen.consumer.or(consumer);
        found.steps.push(Step {
            family: C::NAME,
            key: status.key(),
            consumer: seen.consumer,
            transition,
            was_disposed: consumer.is_none(),
            is_recovered: std::mem::take(&mut seen.was_interrupted),
        });
        if !transition.is_legal() {
            found.violations.push(format!("{} of {:?}: {transition:?}", C::NAME, status.key()));
        }
        if to == CommandState::Commanded && !seen.on_bus[1] {
            found.violations.push(format!("{:?} is COMMANDED without an acknowledgement", status.key()));
        }
        (seen.status, seen.writer, seen.on_bus[0]) = (Some(status.clone()), Some(writer), true);
        if to == CommandState::Canceled && reason == CommandStatusReason::Canceled && consumer.is_some() {
            found.violations.push(format!("{:?} is CANCELED, its command is on the bus", status.key()));
        }
    }

    fn acknowledged(&mut self, ack: &CommandAckReport<C>, found: &mut Found) {
        if let Some(command) = self.command_of(ack.key())
            && *command != ack.command
            && command.header().time_stamp <= ack.command.header().time_stamp
        {
            found.violations.push(format!("the acknowledgement of {:?} differs from its command", ack.key()));
        }
        self.sessions.entry(ack.key()).or_default().on_bus[1] = true;
    }

    fn executed(&mut self, execution: C::ExecutionStatus, found: &mut Found) {
        let key = execution.key();
        let seen = self.sessions.entry(key).or_default();
        seen.on_bus[2] = true;
        if seen.execution.as_ref() == Some(&execution) {
            // It is told once more.
            return;
        }
        seen.execution = Some(execution);
        if seen.state() != Some(CommandState::Executing) {
            found.violations.push(format!("an execution status of {key:?} in {:?}", seen.state()));
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

/// The topics of what a provider says: statuses, acknowledgements, execution statuses.
fn place_of<C: Command>(name: &str) -> Option<usize> {
    let names = [C::STATUS_NAME, C::ACK_REPORT_NAME, C::ExecutionStatus::NAME];
    names.iter().position(|known| *known == name)
}

fn read<T: Topic>(envelope: &Envelope, found: &mut Found) -> Option<T> {
    let read = umaa::decode::<T>(&envelope.message.content);
    read.map_err(|why| found.violations.push(why.to_string())).ok()
}

impl<C: Command> Watch for Family<C> {
    fn published(&mut self, envelope: &Envelope, found: &mut Found) {
        let (message, name) = (&envelope.message, envelope.message.label.descriptor());
        if name == C::NAME {
            self.command(envelope, found);
            return;
        }
        let Some(place) = place_of::<C>(name) else { return };
        match (message.change, place) {
            (Change::Put, 0) => {
                if let Some(status) = read(envelope, found) {
                    self.status(&status, message.label.source(), found);
                }
            }
            (Change::Put, 1) => {
                if let Some(ack) = read(envelope, found) {
                    self.acknowledged(&ack, found);
                }
            }
            (Change::Put, _) => {
                if let Some(status) = read::<C::ExecutionStatus>(envelope, found) {
                    self.executed(status, found);
                }
            }
            (change, place) => {
                if let Some(key) = message.instance.as_deref().and_then(SessionKey::of_instance) {
                    self.ended(place, key, change, found);
                }
            }
        }
    }

    #[cfg(test)]
    fn lost(&mut self, envelope: &Envelope) {
        if let Some(place) = place_of::<C>(envelope.message.label.descriptor())
            && let Some(key) = envelope.message.instance.as_deref().and_then(SessionKey::of_instance)
        {
            self.ended(place, key, Change::Unregister, &mut Found::default());
        }
    }

    fn node_ended(&mut self, entity: EntityId) {
        for seen in self.sessions.values_mut() {
            let is_its = seen.writer.is_some_and(|writer| writer.entity == entity);
            seen.was_interrupted |= is_its && seen.state().is_some_and(|state| !state.is_terminal());
        }
    }

    fn left(&self) -> Vec<String> {
        let commands = self.commands.keys().map(|key| format!("{} {key:?}", C::NAME));
        let sessions = self.sessions.iter();
        commands
            .chain(sessions.map(|(key, seen)| {
                format!("{} {key:?} {:?} {:?}", C::STATUS_NAME, seen.state(), seen.on_bus)
            }))
            .collect()
    }

    fn executing(&self) -> Vec<(Guid, Guid)> {
        let executing =
            self.sessions.iter().filter(|(_, seen)| seen.state() == Some(CommandState::Executing));
        executing.filter_map(|(key, seen)| Some((key.source, seen.consumer?))).collect()
    }

    fn is_allocation(&self) -> bool {
        C::NAME == ResourceAllocationCommand::NAME
    }
}
