//! Random work with crashes at every boundary and inside writes, compared with a model.

use super::rig::{Records, Rig, apply, small};
use crate::journal::*;
use crate::sim::{DiskFaults, SimDisk};

/// What must be true of the journal.
#[derive(Default)]
struct Model {
    acknowledged: Records,
    /// Batches that were handed in since, in their order, and whether they were refused.
    open: VecDeque<(u64, Batch, bool)>,
    last_kept_start: u64,
    this_start: u64,
    /// What was read back while the disk could not be written.
    unsure: Option<Records>,
    written: u64,
    refused: u64,
}

impl Model {
    fn take(&mut self, events: Vec<JournalEvent>) {
        for event in events {
            match event {
                JournalEvent::Written { up_to } => {
                    while self.open.front().is_some_and(|batch| batch.0 <= up_to) {
                        let (number, batch, refused) = self.open.pop_front().unwrap();
                        assert!(!refused, "batch {number} was refused and then passed by");
                        apply(&mut self.acknowledged, &batch);
                        self.written += 1;
                    }
                }
                JournalEvent::Refused { from, to, .. } => {
                    let of_these = self.open.iter_mut().filter(|b| (from..=to).contains(&b.0));
                    of_these.for_each(|batch| batch.2 = true);
                    self.refused += 1;
                }
                JournalEvent::Resumed => {
                    self.open.retain(|batch| !batch.2);
                    self.last_kept_start = self.this_start;
                    if let Some(records) = self.unsure.take() {
                        self.open.clear();
                        self.acknowledged = records;
                    }
                }
                other => panic!("unexpected: {other:?}"),
            }
        }
    }

    /// What was read back must be what was acknowledged and the first few of the batches since.
    fn compare(&mut self, records: Records, recovered: &Recovered, context: &str) {
        let mut state = self.acknowledged.clone();
        let mut found = state == records;
        for (_, batch, _) in &self.open {
            apply(&mut state, batch);
            found |= state == records;
        }
        assert!(
            found,
            "{context}: read back {:?}, acknowledged {:?}",
            records.keys(),
            self.acknowledged.keys()
        );
        assert!(recovered.start > self.last_kept_start, "{context}: a start number came twice");
        // Before the first start was kept, its count may be torn.
        let expected = |kind| match kind {
            DamageKind::TornEnd => true,
            DamageKind::StartsLost => self.last_kept_start == 0,
            DamageKind::Lost { .. } => false,
        };
        let as_expected = recovered.damage.iter().all(|damage| expected(damage.kind));
        assert!(as_expected, "{context}: {:?}", recovered.damage);
        self.this_start = recovered.start;
        if recovered.is_kept {
            self.last_kept_start = recovered.start;
            (self.acknowledged, self.unsure) = (records, None);
            self.open.clear();
        } else {
            self.unsure = Some(records);
        }
    }
}

fn random_batch(random: &mut fastrand::Rng, keys: u32) -> Batch {
    let mut batch = Batch::new();
    for _ in 0..random.usize(0..4) {
        let number = random.u32(0..keys);
        let key =
            if number.is_multiple_of(3) { vec![number as u8; 20] } else { number.to_le_bytes().to_vec() };
        let space = (number % 2) as u8;
        if random.u8(..) < 160 {
            let value: Vec<u8> = (0..random.usize(0..200)).map(|_| random.u8(..)).collect();
            batch.put(space, key, value);
        } else {
            batch.forget(space, key);
        }
    }
    batch
}

/// One life after the other, each ended by a crash, a kill or in peace. Returns what happened.
fn lives(seed: u64, lives: usize, faults: DiskFaults, capacity: Option<usize>) -> (Model, usize) {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut model = Model::default();
    let mut disk = SimDisk::default();
    let keys = random.u32(1..60);
    let mut removed = 0;
    for life in 0..lives {
        let context = format!("seed {seed}, life {life}");
        disk.faults = faults;
        disk.capacity = capacity;
        model.unsure = None;
        let mut rig = Rig::new(small(), disk, random.u64(..));
        let mut opened = false;
        let mut steps = random.usize(1..400);
        while steps > 0 {
            steps -= 1;
            if opened && random.u8(..) < 100 {
                let batch = random_batch(&mut random, keys);
                let number = rig.append(&batch);
                let refused_at_once = rig.events.iter().any(
                    |event| matches!(event, JournalEvent::Refused { from, to, .. } if *from == number && *to == number),
                );
                if !refused_at_once {
                    model.open.push_back((number, batch, false));
                }
            }
            if random.bool() {
                rig.flush();
            }
            removed += usize::from(matches!(
                rig.under_way.front(),
                Some(DiskEffect { operation: DiskOperation::Remove { .. }, .. })
            ));
            if !rig.step() && random.u8(..) < 20 {
                rig.deadline();
            }
            let (records, recovered) = if opened { Default::default() } else { rig.read_back_if_done() };
            if let Some(recovered) = recovered {
                model.compare(records, &recovered, &context);
                opened = true;
            }
            if opened {
                model.take(std::mem::take(&mut rig.events));
            }
        }
        disk = end(rig, &mut random);
    }
    (disk.faults, disk.capacity) = (DiskFaults::default(), None);
    let (_, records, recovered) = Rig::new(small(), disk, 1).restart();
    model.compare(records, &recovered.expect("it opens"), &format!("seed {seed}, at the end"));
    (model, removed)
}

/// The power fails, with the operation under way begun or not; or only the process ends.
fn end(mut rig: Rig, random: &mut fastrand::Rng) -> SimDisk {
    if random.bool()
        && let Some(effect) = rig.under_way.pop_front()
    {
        let _ = rig.disk.carry_out(&effect.operation, random);
    }
    if random.u8(..) < 200 {
        rig.disk.crash(random);
    }
    rig.disk
}

impl Rig {
    fn read_back_if_done(&mut self) -> (Records, Option<Recovered>) {
        if self.events.iter().any(|event| matches!(event, JournalEvent::RecoveredAll(_))) {
            self.read_back()
        } else {
            Default::default()
        }
    }
}

/// How many seeds a test tries; `ALDIS_SEEDS` asks for more.
fn seeds() -> std::ops::Range<u64> {
    let count = std::env::var("ALDIS_SEEDS").ok().and_then(|count| count.parse().ok());
    0..count.unwrap_or(15)
}

#[test]
fn nothing_acknowledged_is_lost_and_nothing_comes_back() {
    let (mut written, mut removed) = (0, 0);
    for seed in seeds() {
        let (model, gone) = lives(seed, 12, DiskFaults::default(), None);
        assert_eq!(model.refused, 0, "seed {seed}: nothing is refused on a good disk");
        written += model.written;
        removed += gone;
    }
    assert!(written > 1000 && removed > 50, "{written} batches written, {removed} segments cleaned");
}

#[test]
fn a_disk_that_fails_costs_nothing_that_was_acknowledged() {
    let faults = DiskFaults { sync_fails: 0.05, write_fails: 0.05, ..DiskFaults::default() };
    let (mut written, mut refused) = (0, 0);
    for seed in seeds() {
        let (model, _) = lives(seed + 1_000_000, 12, faults, None);
        written += model.written;
        refused += model.refused;
    }
    assert!(written > 100 && refused > 30, "{written} batches written, {refused} times refused");
}

#[test]
fn a_disk_that_is_full_costs_nothing_that_was_acknowledged() {
    let (mut written, mut refused) = (0, 0);
    for seed in seeds() {
        let (model, _) = lives(seed + 2_000_000, 12, DiskFaults::default(), Some(12_000));
        written += model.written;
        refused += model.refused;
    }
    assert!(written > 100 && refused > 10, "{written} batches written, {refused} times refused");
}
