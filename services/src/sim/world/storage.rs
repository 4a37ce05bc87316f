//! Disks and journals of a world.

use super::super::disk::{DiskFaults, SimDisk};
use super::super::machine::{Clocks, Machine, Storage};
use super::{Arrival, NodeHandle, Seen, World};
use crate::event::Event;
use crate::journal::{Batch, Journal, JournalConfig, JournalEvent, JournalOutput};
use crate::node::{Node, NodeConfig};
use std::time::Duration;

impl World {
    /// Adds a machine with a disk and a journal on it. Its node starts when the journal is read back, with the number of the start
    /// as its boot id; its operations take as long as `latency` says.
    ///
    /// # Errors
    /// Why the configuration cannot be.
    pub fn add_with_journal(
        &mut self,
        config: NodeConfig,
        journal: JournalConfig,
        latency: (Duration, Duration),
    ) -> Result<NodeHandle, String> {
        Node::new(config.clone())?;
        let mut machine = Machine::new(config, Clocks { born: self.now, ..Clocks::default() });
        let (disk, config) = (SimDisk::default(), journal);
        let journal = Journal::new(config.clone());
        machine.storage = Some(Storage { disk, config, journal, under_way: None, latency, told: Vec::new() });
        machine.is_on = false;
        self.machines.push(machine);
        Ok(NodeHandle(self.machines.len() - 1))
    }

    /// Gives a batch of a machine's node to its journal.
    pub(super) fn append(&mut self, place: usize, number: u64, batch: &Batch) {
        let Some(storage) = self.machines[place].storage.as_mut() else { return };
        let mut out = JournalOutput::default();
        let numbered = storage.journal.append(batch, &mut out);
        storage.journal.flush(&mut out);
        self.journal_output(place, out);
        if numbered != number {
            let what = format!("{} numbers a batch {number}, its journal {numbered}", NodeHandle(place));
            self.violate("the world", what);
        }
    }

    /// Sets what a machine's disk does wrong, and how many bytes fit on it.
    pub fn set_disk(&mut self, of: NodeHandle, faults: DiskFaults, capacity: Option<usize>) {
        if let Some(storage) = &mut self.machines[of.0].storage {
            (storage.disk.faults, storage.disk.capacity) = (faults, capacity);
        }
    }

    /// Whether a machine's disk is doing something.
    pub fn disk_is_busy(&self, of: NodeHandle) -> bool {
        self.machines[of.0].storage.as_ref().is_some_and(|storage| storage.under_way.is_some())
    }

    /// Reads the journal of a machine back. False where it has none.
    pub(super) fn open_journal(&mut self, place: usize) -> bool {
        let Some(storage) = &mut self.machines[place].storage else { return false };
        storage.journal = Journal::new(storage.config.clone());
        storage.told.clear();
        let mut out = JournalOutput::default();
        storage.journal.open(&mut out);
        self.journal_output(place, out);
        true
    }

    /// The operation under way has been begun, or not; and where the power fails, what was not synced may be lost.
    pub(super) fn crash_disk(&mut self, place: usize, power_loss: bool) {
        let Some(storage) = &mut self.machines[place].storage else { return };
        if let Some(effect) = storage.under_way.take()
            && self.random.bool()
        {
            // Nobody is left to be told how it went.
            let _ = storage.disk.carry_out(&effect.operation, &mut self.random);
        }
        if power_loss {
            storage.disk.crash(&mut self.random);
        }
    }

    pub(super) fn disk_is_done(&mut self, place: usize) {
        let Some(storage) = &mut self.machines[place].storage else { return };
        let Some(effect) = storage.under_way.take() else { return };
        let outcome = storage.disk.carry_out(&effect.operation, &mut self.random);
        let mut out = JournalOutput::default();
        storage.journal.done(self.now, effect.token, outcome, &mut out);
        self.journal_output(place, out);
    }

    pub(super) fn journal_deadline(&mut self, place: usize) {
        let Some(storage) = &mut self.machines[place].storage else { return };
        let mut out = JournalOutput::default();
        storage.journal.deadline(self.now, &mut out);
        self.journal_output(place, out);
    }

    fn journal_output(&mut self, place: usize, out: JournalOutput) {
        let Some(storage) = &mut self.machines[place].storage else { return };
        let (latency, next) = (storage.latency, storage.journal.next_deadline());
        let asks = !out.effects.is_empty();
        storage.under_way = out.effects.into_iter().next().or(storage.under_way.take());
        if asks {
            let at = self.now + self.draw(latency);
            self.put(at, place, Arrival::Disk);
        } else if let Some(at) = next {
            self.put(at.max(self.now), place, Arrival::JournalDeadline);
        }
        for event in out.events {
            self.observe(place, Seen::Journal(&event));
            self.journal_told(place, event);
        }
    }

    /// What a journal tells reaches the node in a turn of its own; a node that starts gets all that stands.
    fn journal_told(&mut self, place: usize, event: JournalEvent) {
        if self.is_running(NodeHandle(place)) {
            return self.put(self.now, place, Arrival::Event(Event::Journal(event)));
        }
        let Some(storage) = &mut self.machines[place].storage else { return };
        let is_all = matches!(event, JournalEvent::RecoveredAll(_) | JournalEvent::Unusable(_));
        storage.told.push(Event::Journal(event));
        if is_all {
            let told = std::mem::take(&mut storage.told);
            self.start_again(place, Some(told));
        }
    }
}
