//! A simulated disk: what was written but not synced may be lost in a crash, whole, torn in sectors, or turned into anything.

use crate::journal::{DiskDone, DiskError, DiskOperation, DiskOutcome};
use bytes::Bytes;
use std::collections::BTreeMap;

/// What a disk writes whole or not at all.
const SECTOR: usize = 512;

/// A change that was not synced.
#[derive(Debug, Clone)]
enum Change {
    Write(usize, Bytes),
    Truncate(usize),
}

#[derive(Debug, Clone, Default)]
struct File {
    /// What a reader sees.
    seen: Vec<u8>,
    /// What is on the disk for sure.
    durable: Vec<u8>,
    /// Whether its name is.
    is_named: bool,
    /// What was done since the last sync.
    changes: Vec<Change>,
}

/// What a disk does wrong, as shares of operations from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DiskFaults {
    /// Syncs that fail. What they should have synced is then never synced, as Linux does it.
    pub sync_fails: f64,
    /// Writes that fail, after a part of them was written.
    pub write_fails: f64,
    /// Reads that fail.
    pub read_fails: f64,
    /// Syncs that are told as done and are not: no program can do anything about such a disk. For those who check the checks.
    pub syncs_lie: f64,
}

/// A directory on a simulated disk.
#[derive(Debug, Clone, Default)]
pub struct SimDisk {
    files: BTreeMap<String, File>,
    /// The most bytes that fit. None: as many as one likes.
    pub capacity: Option<usize>,
    /// What it does wrong.
    pub faults: DiskFaults,
}

fn write(content: &mut Vec<u8>, offset: usize, bytes: &[u8]) {
    let end = offset + bytes.len();
    if content.len() < end {
        content.resize(end, 0);
    }
    content[offset..end].copy_from_slice(bytes);
}

fn failed(what: &str) -> DiskError {
    DiskError::Failed(format!("the simulator lets a {what} fail"))
}

impl SimDisk {
    /// Carries out an operation.
    ///
    /// # Errors
    /// What the faults and the capacity make of it.
    pub fn carry_out(&mut self, operation: &DiskOperation, random: &mut fastrand::Rng) -> DiskOutcome {
        match operation {
            DiskOperation::List => {
                let names = self.files.iter().map(|(name, file)| (name.clone(), file.seen.len() as u64));
                return Ok(DiskDone::Listed(names.collect()));
            }
            DiskOperation::Read { file, offset, length } => {
                if random.f64() < self.faults.read_fails {
                    return Err(failed("read"));
                }
                let content = self.files.get(file).map(|file| &file.seen[..]).unwrap_or_default();
                let begin = (*offset as usize).min(content.len());
                let end = begin.saturating_add(*length).min(content.len());
                return Ok(DiskDone::Read(Bytes::copy_from_slice(&content[begin..end])));
            }
            DiskOperation::Write { file, offset, bytes } => {
                self.write(file, *offset as usize, bytes, random)?;
            }
            DiskOperation::Truncate { file, length } => {
                if let Some(file) = self.files.get_mut(file) {
                    file.seen.truncate(*length as usize);
                    file.changes.push(Change::Truncate(*length as usize));
                }
            }
            DiskOperation::Sync { file, is_new } => {
                let Some(file) = self.files.get_mut(file) else { return Err(failed("sync of no file")) };
                if random.f64() < self.faults.sync_fails {
                    file.changes.clear();
                    return Err(failed("sync"));
                }
                if self.faults.syncs_lie > 0.0 && random.f64() < self.faults.syncs_lie {
                    return Ok(DiskDone::Done);
                }
                for change in file.changes.drain(..) {
                    apply(&mut file.durable, &change);
                }
                file.is_named |= is_new;
            }
            DiskOperation::Remove { file } => {
                self.files.remove(file);
            }
        }
        Ok(DiskDone::Done)
    }

    fn write(
        &mut self,
        name: &str,
        offset: usize,
        bytes: &Bytes,
        random: &mut fastrand::Rng,
    ) -> Result<(), DiskError> {
        let used: usize = self.files.values().map(|file| file.seen.len()).sum();
        let file = self.files.entry(name.to_owned()).or_default();
        let growth = (offset + bytes.len()).saturating_sub(file.seen.len());
        let space = self.capacity.map_or(usize::MAX, |capacity| capacity.saturating_sub(used));
        let (fits, why) = if growth > space {
            (
                bytes.len() - (growth - space).min(bytes.len()),
                Some(DiskError::Full("the simulated disk".into())),
            )
        } else if random.f64() < self.faults.write_fails {
            (random.usize(0..=bytes.len()), Some(failed("write")))
        } else {
            (bytes.len(), None)
        };
        if fits > 0 {
            let written = bytes.slice(..fits);
            write(&mut file.seen, offset, &written);
            file.changes.push(Change::Write(offset, written));
        }
        why.map_or(Ok(()), Err)
    }

    /// The machine loses its power. (Where a process alone ends, all that was written is there.) Of what was not synced anything may be left: nothing, all, some sectors, garbage.
    pub fn crash(&mut self, random: &mut fastrand::Rng) {
        self.files.retain(|_, file| file.is_named || random.bool());
        for file in self.files.values_mut() {
            file.is_named = true;
            let keeps = random.f64();
            for change in std::mem::take(&mut file.changes) {
                lose_some(&mut file.durable, &change, keeps, random);
            }
            file.seen.clone_from(&file.durable);
        }
    }

    /// Damages a byte for good. False where there is none.
    pub fn damage(&mut self, file: &str, offset: usize, bits: u8) -> bool {
        let Some(file) = self.files.get_mut(file) else { return false };
        let Some(byte) = file.durable.get_mut(offset) else { return false };
        *byte ^= bits;
        file.seen[offset] = *byte;
        true
    }

    /// The files with what is in them.
    pub fn files(&self) -> impl Iterator<Item = (&str, &[u8])> + '_ {
        self.files.iter().map(|(name, file)| (name.as_str(), &file.seen[..]))
    }

    /// Puts a file on the disk, or another in its place.
    pub fn put(&mut self, name: &str, content: Vec<u8>) {
        let file = File { seen: content.clone(), durable: content, is_named: true, changes: Vec::new() };
        self.files.insert(name.to_owned(), file);
    }
}

fn apply(content: &mut Vec<u8>, change: &Change) {
    match change {
        Change::Write(offset, bytes) => write(content, *offset, bytes),
        Change::Truncate(length) => content.truncate(*length),
    }
}

/// What a crash leaves of a change: each sector by chance, some of them as garbage.
fn lose_some(content: &mut Vec<u8>, change: &Change, keeps: f64, random: &mut fastrand::Rng) {
    match change {
        Change::Truncate(length) if random.bool() => content.truncate(*length),
        Change::Truncate(_) => {}
        Change::Write(offset, bytes) => {
            let mut at = 0;
            while at < bytes.len() {
                let end = (at + SECTOR - (offset + at) % SECTOR).min(bytes.len());
                let chance = random.f64();
                if chance < keeps * 0.95 {
                    write(content, offset + at, &bytes[at..end]);
                } else if chance < keeps && offset + at >= content.len() {
                    // The file was made longer, the sector was not written: what it held before shows.
                    let garbage: Vec<u8> = (at..end).map(|_| random.u8(..)).collect();
                    write(content, offset + at, &garbage);
                }
                at = end;
            }
        }
    }
}
