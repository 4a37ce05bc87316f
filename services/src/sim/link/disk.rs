//! A journal that crashes: only what was acknowledged as written is sure to survive, and nothing survives in part.

use crate::link::Record;
use bytes::Bytes;
use std::collections::{BTreeMap, VecDeque};

/// A journal and what is on its way into it.
#[derive(Debug, Clone, Default)]
pub struct Disk {
    written: BTreeMap<Bytes, Bytes>,
    pending: VecDeque<(u64, Vec<Record>)>,
    next: u64,
}

fn apply(written: &mut BTreeMap<Bytes, Bytes>, records: Vec<Record>) {
    for record in records {
        match record {
            Record::Put { key, value } => {
                written.insert(key, value);
            }
            Record::Forget { key } => {
                written.remove(&key);
            }
        }
    }
}

impl Disk {
    /// Begins to write records as one; [`Disk::finish`] is to follow with the number.
    pub fn begin(&mut self, records: Vec<Record>) -> u64 {
        self.next += 1;
        self.pending.push_back((self.next, records));
        self.next
    }

    /// A write is done. Writes are done in their order.
    pub fn finish(&mut self, number: u64) {
        while let Some((first, records)) = self.pending.pop_front() {
            apply(&mut self.written, records);
            if first == number {
                break;
            }
        }
    }

    /// The machine stops. Of what was on its way the first `survivors` writes are whole; the next is torn, which its checksum tells,
    /// and nothing after it is read.
    pub fn crash(&mut self, survivors: usize) {
        for (_, records) in std::mem::take(&mut self.pending).into_iter().take(survivors) {
            apply(&mut self.written, records);
        }
    }

    /// How many writes are on their way.
    pub fn pending(&self) -> usize {
        self.pending.len()
    }

    /// Everything under keys that begin so.
    pub fn read(&self, prefix: &[u8]) -> Vec<(Bytes, Bytes)> {
        let all = self
            .written
            .range(Bytes::copy_from_slice(prefix)..)
            .take_while(|(key, _)| key.starts_with(prefix));
        all.map(|(key, value)| (key.clone(), value.clone())).collect()
    }

    /// All is gone: another disk is put in.
    pub fn wipe(&mut self) {
        self.pending.clear();
        self.written.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_finished_survives_and_what_is_torn_does_not() {
        let mut disk = Disk::default();
        let put = |key: u8| vec![Record::Put { key: vec![1, key].into(), value: vec![key].into() }];
        let first = disk.begin(put(1));
        disk.finish(first);
        disk.begin(put(2));
        disk.begin(vec![Record::Forget { key: vec![1, 1].into() }]);
        disk.crash(1);
        let bytes = |bytes: &'static [u8]| Bytes::from_static(bytes);
        assert_eq!(disk.read(&[1]), [(bytes(&[1, 1]), bytes(&[1])), (bytes(&[1, 2]), bytes(&[2]))]);
        assert_eq!((disk.pending(), disk.read(&[2]).len()), (0, 0));
    }
}
