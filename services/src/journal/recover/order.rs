//! What has to be done to the files before the journal goes on.

use super::Recovery;
use crate::journal::disk::DiskOperation;
use crate::journal::format::{Header, IDENTITY, SLOT, segment_name};
use crate::journal::{Journal, JournalOutput, Recovered, State};
use bytes::Bytes;

/// Where the count of starts is lost, this is added to the last that any segment knows of: more than there can have been since.
const STARTS_JUMP: u64 = 1 << 20;

impl Journal {
    /// What must be done to the files; then what stands is told.
    pub(super) fn put_in_order(
        &mut self,
        recovery: Recovery,
        last_group: Option<DiskOperation>,
        out: &mut JournalOutput,
    ) {
        self.salt = recovery.salt().unwrap_or(self.config.seed);
        self.start = recovery.next_start();
        self.sequence = recovery.expected.map_or(0, |next| next.saturating_sub(1));
        self.mends.extend(recovery.identity_writes(self.salt, self.start));
        if let Some((place, offset)) = recovery.cut_at() {
            let whole = recovery.files[place].length;
            let keeps_it = recovery.keeps(place, offset);
            let gone = if keeps_it { place + 1 } else { place };
            let names = recovery.files[gone..].iter().rev().map(|file| segment_name(file.number));
            self.mends.extend(names.map(|file| DiskOperation::Remove { file }));
            self.index.cut(gone);
            if keeps_it && offset < whole {
                let file = segment_name(recovery.files[place].number);
                self.mends.push_back(DiskOperation::Truncate { file, length: u64::from(offset) });
                self.index.set_length(offset);
            }
        }
        self.mends.extend(last_group);
        if let Some(newest) = self.index.newest() {
            let file = segment_name(newest.number);
            self.mends.push_back(DiskOperation::Sync { file, is_new: true });
        }
        let damage = recovery.damage();
        self.opening =
            Some(Recovered { start: self.start, identity: self.salt, damage, ..Recovered::default() });
        self.state = State::Ready;
        self.next(out);
    }
}

impl Recovery {
    fn next_start(&self) -> u64 {
        let slots = self.slots.iter().flatten().map(|header| header.start).max();
        let segments = self.files.iter().filter_map(|file| file.header).map(|header| header.start).max();
        match (slots, segments) {
            (Some(start), _) => start + 1,
            (None, Some(start)) => start + STARTS_JUMP,
            // Its first write may have been torn, but it may have counted on for long too.
            (None, None) if self.has_identity => STARTS_JUMP,
            (None, None) => 1,
        }
    }

    /// Writes the count of starts into the older slot, in place: that needs no space on a full disk.
    fn identity_writes(&self, salt: u64, start: u64) -> [DiskOperation; 2] {
        let header = Header { segment: 0, salt, start, first_sequence: 0 }.encode();
        let newest = (0..2).max_by_key(|&slot| self.slots[slot].map(|header| header.start));
        let slot = match newest {
            Some(newest) if self.slots[newest].is_some() => 1 - newest,
            _ => 0,
        };
        let file = || IDENTITY.to_owned();
        let whole = self.slots != [None; 2];
        let (offset, bytes) = if whole {
            ((slot * SLOT) as u64, Bytes::copy_from_slice(&header))
        } else {
            let mut both = vec![0; 2 * SLOT];
            both[..header.len()].copy_from_slice(&header);
            (0, both.into())
        };
        [
            DiskOperation::Write { file: file(), offset, bytes },
            DiskOperation::Sync { file: file(), is_new: true },
        ]
    }
}
