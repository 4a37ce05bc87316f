//! The journal on real files.

use super::*;
use aldis_services::journal::{Recovered, Unusable};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::mpsc::channel;

/// A directory that goes with the test.
struct Directory(PathBuf);

impl Directory {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("aldis-journal-{}-{name}", std::process::id()));
        Self(path)
    }
}

impl Drop for Directory {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

struct Opened {
    thread: JournalThread,
    events: std::sync::mpsc::Receiver<JournalEvent>,
    records: BTreeMap<Vec<u8>, Vec<u8>>,
    recovered: Recovered,
}

fn open(directory: &Directory, config: JournalConfig) -> Opened {
    let (tell, events) = channel();
    let thread = JournalThread::start(&directory.0, config, move |told: &mut Vec<JournalEvent>| {
        told.drain(..).for_each(|event| tell.send(event).unwrap_or_default());
    });
    let mut records = BTreeMap::new();
    let thread = thread.unwrap();
    loop {
        match events.recv().unwrap() {
            JournalEvent::Recovered { key, value, .. } => {
                records.insert(key.to_vec(), value.to_vec());
            }
            JournalEvent::RecoveredAll(recovered) => return Opened { thread, events, records, recovered },
            other => panic!("{other:?}"),
        }
    }
}

fn put(key: u32, bytes: usize) -> Batch {
    let mut batch = Batch::new();
    batch.put(1, key.to_be_bytes().to_vec(), vec![key as u8; bytes]);
    batch
}

fn written(opened: &Opened, number: u64) {
    loop {
        match opened.events.recv().unwrap() {
            JournalEvent::Written { up_to } if up_to >= number => return,
            JournalEvent::Written { .. } => {}
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn records_outlive_the_process_and_segments_are_cleaned() {
    let directory = Directory::new("outlive");
    let config = JournalConfig { segment_bytes: 1 << 16, ..JournalConfig::new(seed()) };
    let mut opened = open(&directory, config.clone());
    assert_eq!((opened.recovered.start, opened.records.len()), (1, 0));
    let identity = opened.recovered.identity;
    let last = (0..10_000).map(|n| opened.thread.append(put(n % 100, 200)).unwrap()).last().unwrap();
    written(&opened, last);
    drop(opened);
    let bytes: u64 =
        std::fs::read_dir(&directory.0).unwrap().map(|file| file.unwrap().metadata().unwrap().len()).sum();
    assert!(bytes < 20 << 16, "{bytes} bytes for 100 records");
    let opened = open(&directory, config);
    assert_eq!(
        opened.recovered,
        Recovered { start: 2, is_kept: true, identity, records: 100, damage: vec![] }
    );
    assert_eq!(opened.records[&99_u32.to_be_bytes().to_vec()], vec![99; 200]);
}

#[test]
fn what_was_appended_is_written_before_the_thread_ends() {
    let directory = Directory::new("ends");
    let mut opened = open(&directory, JournalConfig::new(seed()));
    (0..1000).for_each(|n| {
        opened.thread.append(put(n, 20)).unwrap();
    });
    drop(opened);
    assert_eq!(open(&directory, JournalConfig::new(seed())).records.len(), 1000);
}

#[test]
fn two_processes_do_not_share_a_journal() {
    let directory = Directory::new("lock");
    let opened = open(&directory, JournalConfig::new(seed()));
    let second = JournalThread::start(&directory.0, JournalConfig::new(1), |_| {});
    let why = second.err().expect("it is locked").to_string();
    assert!(why.contains("used by another process") && why.contains("aldis-journal"), "{why}");
    drop(opened);
    open(&directory, JournalConfig::new(seed()));
}

#[test]
fn a_directory_that_cannot_be_is_named() {
    let file = Directory::new("file");
    std::fs::write(&file.0, "no directory").unwrap();
    let why = JournalThread::start(&file.0, JournalConfig::new(1), |_| {}).err().unwrap().to_string();
    assert!(why.contains("cannot make the directory of the journal in"), "{why}");
    std::fs::remove_file(&file.0).unwrap();
}

#[test]
fn too_much_at_once_is_refused_at_once() {
    let directory = Directory::new("behind");
    let config = JournalConfig { pending_bytes_max: 1 << 20, ..JournalConfig::new(seed()) };
    let mut opened = open(&directory, config);
    let (mut taken, mut refused) = (0_u64, 0);
    for n in 0..100 {
        match opened.thread.append(put(n, 500_000)) {
            Ok(number) => taken = number,
            Err(Refused::Behind { .. }) => refused += 1,
            Err(other) => panic!("{other}"),
        }
    }
    assert!(taken >= 2 && refused > 0 && taken + refused == 100, "{taken} taken, {refused} refused");
    // What was taken is written, or refused later where the journal itself is behind.
    loop {
        match opened.events.recv().unwrap() {
            JournalEvent::Written { up_to } if up_to >= taken => break,
            JournalEvent::Refused { to, reason: Refused::Behind { .. }, .. } if to >= taken => break,
            JournalEvent::Written { .. } | JournalEvent::Refused { reason: Refused::Behind { .. }, .. } => {}
            other => panic!("{other:?}"),
        }
    }
    assert!(opened.thread.append(put(1, 1)).is_ok());
}

#[test]
fn a_newer_journal_is_refused() {
    let directory = Directory::new("newer");
    drop(open(&directory, JournalConfig::new(seed())));
    let identity = directory.0.join("identity.journal");
    let mut bytes = std::fs::read(&identity).unwrap();
    bytes[8] = 2;
    let crc = crc32(&bytes[..60]).to_le_bytes();
    bytes[60..64].copy_from_slice(&crc);
    std::fs::write(&identity, &bytes).unwrap();
    let (tell, events) = channel();
    let thread =
        JournalThread::start(&directory.0, JournalConfig::new(1), move |told: &mut Vec<JournalEvent>| {
            told.drain(..).for_each(|event| tell.send(event).unwrap_or_default());
        });
    let why = Unusable::Newer { file: "identity.journal".into(), version: 2 };
    assert_eq!(events.recv().unwrap(), JournalEvent::Unusable(why));
    drop(thread);
    assert_eq!(std::fs::read(&identity).unwrap(), bytes);
}

/// CRC-32 bit by bit, as IEEE 802.3 defines it.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(
            crc ^ u32::from(*byte),
            |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 },
        )
    })
}
