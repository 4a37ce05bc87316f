//! Files that are damaged, foreign or from the future.

use super::rig::{Records, Rig, small};
use crate::journal::*;
use crate::sim::SimDisk;

fn numbered(count: u32, config: JournalConfig) -> Rig {
    let mut rig = Rig::new(config, SimDisk::default(), 1);
    rig.settle();
    for number in 0..count {
        rig.put(&number.to_le_bytes(), &[number as u8; 50]);
    }
    rig
}

fn large_segments() -> JournalConfig {
    JournalConfig { segment_bytes: 1 << 20, ..small() }
}

#[test]
fn a_damaged_byte_costs_the_batch_that_it_is_in_and_is_named() {
    let frame = 88; // 24 + 7 + 4 + 50, padded to 8
    for (offset, lost) in [(64, 0_u32), (64 + 30, 0), (64 + 5 * frame + 4, 5), (64 + 5 * frame + 87 - 3, 5)] {
        let mut rig = numbered(20, large_segments());
        assert!(rig.disk.damage("00000001.journal", offset, 1));
        let (mut rig, records, recovered) = rig.restart();
        let expected: Records = (0..20)
            .filter(|n| *n != lost)
            .map(|n: u32| ((0, n.to_le_bytes().to_vec()), vec![n as u8; 50]))
            .collect();
        assert_eq!(records, expected);
        let (begin, bytes) = (64 + u64::from(lost) * frame as u64, frame as u64);
        let kind = DamageKind::Lost { batches: Some(1) };
        let damage = Damage { file: "00000001.journal".into(), offset: begin, bytes, kind };
        assert_eq!(recovered.unwrap().damage, [damage]);
        rig.put(b"new", b"value");
        assert_eq!(rig.restart().1.len(), 20, "and it goes on");
    }
}

#[test]
fn damage_in_the_last_write_is_taken_for_a_torn_end() {
    let mut rig = numbered(20, large_segments());
    rig.disk.damage("00000001.journal", 64 + 19 * 88 + 40, 1);
    let (rig, records, recovered) = rig.restart();
    assert_eq!(records.len(), 19);
    let kind = DamageKind::TornEnd;
    let damage = Damage { file: "00000001.journal".into(), offset: 64 + 19 * 88, bytes: 88, kind };
    assert_eq!(
        damage.to_string(),
        "00000001.journal: 88 bytes from 1736 on are torn and cut off: they were not acknowledged"
    );
    assert_eq!(recovered.unwrap().damage, [damage]);
    let (_, records, recovered) = rig.restart();
    assert_eq!((records.len(), recovered.unwrap().damage), (19, vec![]), "it is told once");
}

#[test]
fn a_torn_group_stands_up_to_the_tear() {
    let mut rig = numbered(3, large_segments());
    for number in 3..10_u32 {
        let mut batch = Batch::new();
        batch.put(0, number.to_le_bytes().to_vec(), vec![0; 50]);
        rig.append(&batch);
    }
    rig.flush();
    rig.step();
    rig.disk.damage("00000001.journal", 64 + 3 * 88, 0);
    let file = rig.disk.files().find(|(name, _)| *name == "00000001.journal").unwrap().1.to_vec();
    let mut torn = file.clone();
    torn[64 + 5 * 88 + 30] ^= 1;
    rig.disk.put("00000001.journal", torn);
    let (_, records, recovered) = rig.restart();
    assert_eq!(records.len(), 5, "whole frames behind the tear do not stand without it");
    assert_eq!(recovered.unwrap().damage[0].bytes, 5 * 88);
}

#[test]
fn a_damaged_header_costs_nothing_while_another_names_the_salt() {
    let mut rig = numbered(20, large_segments());
    rig.disk.damage("00000001.journal", 20, 1);
    let (rig, records, recovered) = rig.restart();
    assert_eq!(records.len(), 20);
    let damage = recovered.unwrap().damage;
    assert_eq!((damage.len(), damage[0].offset, damage[0].bytes), (1, 0, 64));
    assert_eq!(rig.restart().1.len(), 20);
}

#[test]
fn a_segment_that_is_gone_is_named() {
    let rig = numbered(60, small());
    let mut disk = SimDisk::default();
    for (name, content) in rig.disk.files().filter(|(name, _)| *name != "00000002.journal") {
        disk.put(name, content.to_vec());
    }
    let (_, records, recovered) = Rig::new(small(), disk, 1).restart();
    let damage = recovered.unwrap().damage;
    let [Damage { file, bytes: 0, kind: DamageKind::Lost { batches: Some(lost) }, .. }] = &damage[..] else {
        panic!("{damage:?}")
    };
    assert_eq!((file.as_str(), records.len() as u64 + lost), ("00000003.journal", 60));
    assert!(*lost > 10);
}

#[test]
fn the_count_of_starts_survives_damage() {
    let (rig, _, recovered) = numbered(3, small()).restart();
    assert_eq!(recovered.unwrap().start, 2);
    let (mut rig, _, recovered) = rig.restart();
    assert_eq!(recovered.unwrap().start, 3);
    // Slot by slot: 3 is in the first, 2 in the second.
    rig.disk.damage("identity.journal", 30, 0xff);
    let (mut rig, _, recovered) = rig.restart();
    assert_eq!(recovered.unwrap().start, 3, "a torn write of the count: that start was never told");
    rig.disk.damage("identity.journal", 30, 0xff);
    rig.disk.damage("identity.journal", 512 + 30, 0xff);
    let (_, records, recovered) = rig.restart();
    let recovered = recovered.unwrap();
    assert!(recovered.start > 1 << 20, "{}", recovered.start);
    assert_eq!(recovered.damage[0].kind, DamageKind::StartsLost);
    assert_eq!(records.len(), 3);
}

#[test]
fn a_newer_version_is_refused_and_not_touched() {
    let rig = numbered(60, small());
    let mut disk = rig.disk.clone();
    let (name, content) = rig.disk.files().nth(2).unwrap();
    let mut newer = content.to_vec();
    newer[8] = 9;
    let crc = crc32fast::hash(&newer[..60]);
    newer[60..64].copy_from_slice(&crc.to_le_bytes());
    disk.put(name, newer);
    let before: Vec<_> = disk.files().map(|(name, content)| (name.to_owned(), content.to_vec())).collect();
    let mut rig = Rig::new(small(), disk, 1);
    rig.settle();
    let why = Unusable::Newer { file: name.into(), version: 9 };
    assert_eq!(rig.events, [JournalEvent::Unusable(why.clone())]);
    rig.put(b"key", b"value");
    let reason = Refused::Unusable(why);
    assert_eq!(rig.events[1], JournalEvent::Refused { from: 1, to: 1, reason: reason.clone() });
    assert!(reason.to_string().contains("has format 9, this program knows 1"), "{reason}");
    let after: Vec<_> = rig.disk.files().map(|(name, content)| (name.to_owned(), content.to_vec())).collect();
    assert_eq!(before, after);
}

#[test]
fn foreign_files_with_names_of_segments_are_refused_and_others_left_alone() {
    let mut disk = SimDisk::default();
    disk.put("00000001.journal", b"Dear diary, ".repeat(100));
    disk.put("notes.txt", vec![1]);
    let mut rig = Rig::new(small(), disk, 1);
    rig.settle();
    let why = Unusable::NoJournal { file: "00000001.journal".into() };
    assert_eq!(rig.events, [JournalEvent::Unusable(why)]);
    assert_eq!(rig.disk.files().count(), 2);
    let mut disk = SimDisk::default();
    disk.put("notes.txt", vec![1]);
    let mut rig = Rig::new(small(), disk, 1);
    rig.settle();
    rig.put(b"key", b"value");
    let (rig, records, _) = rig.restart();
    assert_eq!(records.len(), 1);
    assert!(rig.disk.files().any(|(name, _)| name == "notes.txt"));
}

#[test]
fn what_cannot_be_read_is_damage_and_the_rest_stands() {
    // Pieces that fail whole are read again in small ones; here about one in a hundred of those fails.
    let mut rig =
        Rig::new(JournalConfig { segment_bytes: 16 << 20, ..JournalConfig::new(3) }, SimDisk::default(), 4);
    rig.settle();
    for number in 0..3000_u32 {
        let mut batch = Batch::new();
        batch.put(0, number.to_le_bytes().to_vec(), vec![number as u8; 1000]);
        rig.append(&batch);
        if number % 8 == 7 {
            rig.flush();
            rig.settle();
        }
    }
    let (mut rig, records, _) = rig.restart();
    assert_eq!(records.len(), 3000, "in several pieces");
    let file = rig.disk.files().find(|(name, _)| *name == "00000001.journal").unwrap().1.to_vec();
    let mut bent = file.clone();
    (0..20).for_each(|n| bent[100_000 * n + 500_000 + n] ^= 0x10);
    rig.disk.put("00000001.journal", bent);
    let (_, records, recovered) = rig.restart();
    assert_eq!((records.len(), recovered.unwrap().damage.len()), (2980, 20));
}
