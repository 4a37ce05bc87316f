//! A journal on a simulated disk, one operation at a time.

use crate::journal::*;
use crate::sim::SimDisk;
use std::collections::BTreeMap;

pub(super) type Records = BTreeMap<(u8, Vec<u8>), Vec<u8>>;

/// Small enough that everything happens often.
pub(super) fn small() -> JournalConfig {
    JournalConfig { seed: 7, limit_bytes: 1 << 20, segment_bytes: 2048, pending_bytes_max: 1 << 20 }
}

pub(super) struct Rig {
    pub(super) journal: Journal,
    pub(super) disk: SimDisk,
    pub(super) random: fastrand::Rng,
    pub(super) now: Monotonic,
    pub(super) under_way: VecDeque<DiskEffect>,
    pub(super) events: Vec<JournalEvent>,
    /// Operations carried out.
    pub(super) operations: usize,
}

impl Rig {
    pub(super) fn new(config: JournalConfig, disk: SimDisk, seed: u64) -> Self {
        let mut rig = Self {
            journal: Journal::new(config),
            disk,
            random: fastrand::Rng::with_seed(seed),
            now: Monotonic::START,
            under_way: VecDeque::new(),
            events: Vec::new(),
            operations: 0,
        };
        rig.act(|journal, out| journal.open(out));
        rig
    }

    fn act<T>(&mut self, act: impl FnOnce(&mut Journal, &mut JournalOutput) -> T) -> T {
        let mut out = JournalOutput::default();
        let result = act(&mut self.journal, &mut out);
        self.under_way.extend(out.effects);
        assert!(self.under_way.len() <= 1, "one operation at a time: {:?}", self.under_way);
        self.events.extend(out.events);
        result
    }

    pub(super) fn append(&mut self, batch: &Batch) -> u64 {
        self.act(|journal, out| journal.append(batch, out))
    }

    pub(super) fn flush(&mut self) {
        self.act(|journal, out| journal.flush(out));
    }

    /// Carries out one operation. False where none is under way.
    pub(super) fn step(&mut self) -> bool {
        let Some(effect) = self.under_way.pop_front() else { return false };
        let outcome = self.disk.carry_out(&effect.operation, &mut self.random);
        let now = self.now;
        self.operations += 1;
        self.act(|journal, out| journal.done(now, effect.token, outcome, out));
        true
    }

    pub(super) fn deadline(&mut self) {
        if let Some(at) = self.journal.next_deadline() {
            self.now = self.now.max(at);
            let now = self.now;
            self.act(|journal, out| journal.deadline(now, out));
        }
    }

    /// Carries out everything.
    pub(super) fn settle(&mut self) {
        let mut steps = 0;
        while self.step() {
            steps += 1;
            assert!(steps < 100_000, "the journal never rests");
        }
    }

    /// Appends one batch and has it written.
    pub(super) fn write(&mut self, batch: &Batch) {
        self.append(batch);
        self.flush();
        self.settle();
    }

    pub(super) fn put(&mut self, key: &[u8], value: &[u8]) {
        let mut batch = Batch::new();
        batch.put(0, key.to_vec(), value.to_vec());
        self.write(&batch);
    }

    /// Ends the process and starts it again: what was read back.
    pub(super) fn restart(self) -> (Self, Records, Option<Recovered>) {
        let Self { journal, disk, mut random, .. } = self;
        let mut rig = Self::new(journal.config, disk, random.u64(..));
        rig.settle();
        let (records, recovered) = rig.read_back();
        (rig, records, recovered)
    }

    /// What was told at the start.
    pub(super) fn read_back(&mut self) -> (Records, Option<Recovered>) {
        let mut records = Records::new();
        let mut recovered = None;
        self.events.retain(|event| match event {
            JournalEvent::Recovered { space, key, value } => {
                let before = records.insert((*space, key.to_vec()), value.to_vec());
                assert_eq!(before, None, "told twice");
                false
            }
            JournalEvent::RecoveredAll(all) => {
                assert_eq!(all.records, records.len() as u64);
                recovered = Some(all.clone());
                false
            }
            _ => true,
        });
        (records, recovered)
    }
}

/// Applies a batch as the owner means it.
pub(super) fn apply(records: &mut Records, batch: &Batch) {
    for operation in batch.operations() {
        match operation {
            Operation::Put { space, key, value } => {
                records.insert((*space, key.to_vec()), value.to_vec());
            }
            Operation::Forget { space, key } => {
                records.remove(&(*space, key.to_vec()));
            }
        }
    }
}
