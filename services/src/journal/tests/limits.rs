//! Bounds, a full disk, cleaning, and what is told of them.

use super::rig::{Rig, small};
use crate::journal::*;
use crate::sim::SimDisk;

fn put(key: u32, bytes: usize) -> Batch {
    let mut batch = Batch::new();
    batch.put(3, key.to_le_bytes().to_vec(), vec![1; bytes]);
    batch
}

fn opened(config: JournalConfig) -> Rig {
    let mut rig = Rig::new(config, SimDisk::default(), 1);
    rig.settle();
    rig.read_back();
    rig
}

#[test]
fn many_appends_are_one_write_and_one_sync() {
    let mut rig = opened(JournalConfig::new(1));
    let before = rig.operations;
    let last = (0..1000).map(|key| rig.append(&put(key, 200))).last().unwrap();
    assert!(rig.events.is_empty(), "nothing is acknowledged before it is synced");
    rig.flush();
    assert!(rig.step() && rig.events.is_empty(), "written, not synced");
    rig.settle();
    assert_eq!(rig.events, [JournalEvent::Written { up_to: last }]);
    assert_eq!(rig.operations - before, 2);
    assert_eq!(rig.journal.held().records, 1000);
}

#[test]
fn what_is_appended_during_a_sync_is_the_next_group() {
    let mut rig = opened(JournalConfig::new(1));
    rig.append(&put(1, 10));
    rig.flush();
    rig.append(&put(2, 10));
    rig.append(&put(3, 10));
    rig.flush();
    rig.settle();
    assert_eq!(rig.events, [JournalEvent::Written { up_to: 1 }, JournalEvent::Written { up_to: 3 }]);
}

#[test]
fn a_journal_that_is_full_refuses_what_makes_it_larger_and_nothing_else() {
    let mut rig = opened(JournalConfig { limit_bytes: 1000, ..small() });
    (0..4).for_each(|key| rig.write(&put(key, 200)));
    rig.events.clear();
    rig.append(&put(9, 200));
    let reason = Refused::Limit { held: 5 * 211, limit: 1000 };
    assert_eq!(rig.events, [JournalEvent::Refused { from: 5, to: 5, reason }]);
    rig.write(&put(0, 200));
    rig.write(&put(1, 100));
    let mut batch = Batch::new();
    batch.forget(3, 2_u32.to_le_bytes().to_vec());
    batch.put(3, 9_u32.to_le_bytes().to_vec(), vec![1; 200]);
    rig.write(&batch);
    assert_eq!(rig.events[1..], [6, 7, 8].map(|up_to| JournalEvent::Written { up_to }));
    assert_eq!(rig.journal.held().records, 4);
}

#[test]
fn what_does_not_fit_into_the_queue_is_refused() {
    let mut rig = opened(JournalConfig { pending_bytes_max: 1000, ..small() });
    (0..4).for_each(|key| {
        rig.append(&put(key, 200));
    });
    rig.append(&put(9, 200));
    let reason = Refused::Behind { pending: 5 * 211 };
    assert_eq!(rig.events, [JournalEvent::Refused { from: 5, to: 5, reason }]);
    rig.flush();
    rig.settle();
    assert_eq!(rig.journal.held().records, 4);
    assert_eq!(rig.restart().1.len(), 4);
}

#[test]
fn a_full_disk_refuses_with_its_reason_and_is_tried_again() {
    let mut rig = opened(small());
    rig.write(&put(1, 300));
    rig.disk.capacity = Some(2000);
    rig.events.clear();
    rig.write(&put(2, 900));
    let full = Refused::Disk(DiskError::Full("the simulated disk".into()));
    let refused = |number| JournalEvent::Refused { from: number, to: number, reason: full.clone() };
    assert_eq!(rig.events, [refused(2)]);
    rig.write(&put(3, 10));
    assert_eq!(rig.events[1..], [refused(3)], "left alone for a while");
    assert_eq!(rig.journal.trouble(), Some(full.clone()));
    rig.disk.capacity = None;
    rig.deadline();
    rig.settle();
    assert_eq!(rig.events[2..], [JournalEvent::Resumed]);
    rig.write(&put(4, 900));
    assert_eq!(rig.journal.trouble(), None);
    let (_, records, recovered) = rig.restart();
    let keys: Vec<_> = records.keys().map(|(_, key)| key[0]).collect();
    assert_eq!((keys, recovered.unwrap().damage), (vec![1, 4], vec![]));
}

#[test]
fn waits_between_tries_grow_to_a_bound() {
    let mut rig = opened(small());
    rig.disk.capacity = Some(0);
    rig.write(&put(1, 10));
    let mut waits = Vec::new();
    for _ in 0..7 {
        let before = rig.now;
        rig.deadline();
        waits.push((rig.now - before).as_secs());
        rig.settle();
    }
    assert_eq!(waits, [1, 2, 4, 8, 16, 30, 30]);
}

#[test]
fn a_disk_that_is_full_at_the_start_is_read_all_the_same() {
    let mut rig = opened(small());
    rig.write(&put(1, 300));
    let mut disk = rig.disk.clone();
    disk.faults.write_fails = 1.0;
    let mut rig = Rig::new(small(), disk, 1);
    rig.settle();
    let (records, recovered) = rig.read_back();
    let recovered = recovered.unwrap();
    assert_eq!((records.len(), recovered.start, recovered.is_kept), (1, 2, false));
    rig.disk.faults.write_fails = 0.0;
    rig.deadline();
    rig.settle();
    assert_eq!(rig.events, [JournalEvent::Resumed]);
    assert_eq!(rig.restart().2.unwrap().start, 3);
}

#[test]
fn a_count_of_starts_needs_no_space() {
    let rig = opened(small());
    let mut disk = rig.disk.clone();
    disk.capacity = Some(0);
    let mut rig = Rig::new(small(), disk, 1);
    rig.settle();
    let recovered = rig.read_back().1.unwrap();
    assert_eq!((recovered.start, recovered.is_kept), (2, true));
}

#[test]
fn cleaning_keeps_the_files_small_and_moves_little_at_a_time() {
    let mut rig = opened(JournalConfig { segment_bytes: 1 << 16, ..small() });
    let mut most = 0;
    for round in 0..20_000_u32 {
        rig.append(&put(round % 500, 100));
        rig.flush();
        while rig.step() {
            if let Some(DiskEffect { operation: DiskOperation::Write { bytes, .. }, .. }) =
                rig.under_way.front()
            {
                most = most.max(bytes.len());
            }
        }
    }
    let held = rig.journal.held();
    assert_eq!((held.records, held.live_bytes), (500, 500 * 111));
    assert!(held.disk_bytes <= 3 << 16, "{held:?}");
    assert!(most < 1 << 15, "{most} bytes at once");
    let (mut rig, records, _) = rig.restart();
    assert_eq!(records.len(), 500);
    (0..500).for_each(|key| {
        let mut batch = Batch::new();
        batch.forget(3, u32::to_le_bytes(key).to_vec());
        rig.write(&batch);
    });
    assert_eq!(rig.journal.held().records, 0);
    assert_eq!(rig.restart().1.len(), 0);
}

#[test]
fn a_large_journal_has_large_segments() {
    let of = |limit_bytes| Journal::new(JournalConfig { limit_bytes, ..JournalConfig::new(1) }).config;
    assert_eq!(of(1 << 30).segment_bytes, 16 << 20);
    let large = of(1 << 36);
    assert!(large.disk_bytes_max() / u64::from(large.segment_bytes) <= 1100, "{large:?}");
}
