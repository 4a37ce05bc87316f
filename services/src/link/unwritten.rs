//! What is on its way to the journal, and what the journal has refused and must get later.

use super::Record;
use super::journal::AfterWrite;
use aldis_envelope::Monotonic;
use bytes::Bytes;
use std::collections::BTreeMap;
use std::time::Duration;

/// So many records are a batch, and what more comes in the same turn is another: the longest of them fill half a batch of the journal.
pub(super) const RECORDS_MAX: usize = 32;

/// So many records that were refused go along with a batch.
const AGAIN_MAX: usize = 256;

/// How soon what was refused is tried again. The journal itself tries its disk no sooner.
const AGAIN_AFTER: Duration = Duration::from_secs(1);

/// A batch on its way.
#[derive(Debug, Default)]
pub(super) struct Batch {
    pub(super) records: Vec<Record>,
    pub(super) after: Vec<AfterWrite>,
}

/// Records that were refused, of each key the last.
#[derive(Debug, Default)]
pub(super) struct Unwritten {
    records: BTreeMap<Bytes, Record>,
    after: Vec<AfterWrite>,
    due: Option<Monotonic>,
}

impl Unwritten {
    /// Keeps records that hold although they were refused.
    pub(super) fn keep(&mut self, now: Monotonic, records: Vec<Record>) {
        self.due = Some(now + AGAIN_AFTER);
        self.records.extend(records.into_iter().map(|record| (record.key().clone(), record)));
    }

    /// What is to follow once they are written.
    pub(super) fn release_later(&mut self, after: AfterWrite) {
        self.after.push(after);
    }

    /// When they are to be tried again.
    pub(super) fn due(&self) -> Option<Monotonic> {
        self.due
    }

    /// Those that go along with `newer` ones, which take the place of older ones with the same keys.
    pub(super) fn take(&mut self, now: Monotonic, newer: &[Record]) -> (Vec<Record>, Vec<AfterWrite>) {
        if self.due.is_none() {
            return (Vec::new(), Vec::new());
        }
        for record in newer {
            self.records.remove(record.key());
        }
        let some = (0..AGAIN_MAX).map_while(|_| self.records.pop_first());
        let some = some.map(|(_, record)| record).collect();
        if self.records.is_empty() {
            self.due = None;
            return (some, std::mem::take(&mut self.after));
        }
        self.due = Some(now);
        (some, Vec::new())
    }
}
