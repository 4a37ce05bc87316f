//! The frames that went out by one carrier and what was in them, until it is known what became of them.

use aldis_envelope::Monotonic;
use std::collections::BTreeMap;
use std::time::Duration;

/// A later frame that was acknowledged shows an earlier one to be lost when it is so many numbers later, on a carrier on which
/// frames were seen to change places. On others the next one does.
const OVERTAKEN: u64 = 4;

/// How many frames that are taken for lost are remembered: their acknowledgement may still come and is worth knowing.
const LOST_MAX: usize = 512;

/// A piece of something in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Carried {
    /// Bytes `start..end` of a command.
    Command { number: u64, start: u32, end: u32 },
    /// That these commands do not come.
    Void { start: u64, end: u64 },
    /// A sample of an instance.
    State { alias: u32, origin: u32, sequence: u64 },
    /// Bytes of a large message.
    Piece { transfer: u32, start: u32, end: u32 },
    /// That a large message begins.
    Start { transfer: u32 },
    /// What the sender believes the receiver to hold.
    Digest,
    /// What of the digest differs.
    Differ,
    /// What the receiver holds of a large message.
    Have { transfer: u32 },
    /// Which life this is.
    Hello,
}

/// A frame that was sent.
#[derive(Debug, Clone)]
pub(super) struct SentFrame {
    pub(super) at: Monotonic,
    pub(super) bytes: usize,
    /// Whether the peer is to acknowledge it.
    pub(super) eliciting: bool,
    pub(super) carried: Vec<Carried>,
}

/// What an acknowledgement told.
#[derive(Debug, Default)]
pub(super) struct Outcome {
    /// Frames that arrived.
    pub(super) arrived: Vec<SentFrame>,
    /// Frames that are taken for lost now.
    pub(super) lost: Vec<SentFrame>,
    /// The newest frame that arrived, if it was not known before.
    pub(super) newest: Option<(Monotonic, usize)>,
}

/// The frames of one carrier.
#[derive(Debug, Default)]
pub(super) struct Sent {
    /// The number of the next frame.
    pub(super) next: u64,
    waiting: BTreeMap<u64, SentFrame>,
    lost: BTreeMap<u64, SentFrame>,
    /// A frame taken for lost arrived: frames change places here.
    reorders: bool,
}

impl Sent {
    pub(super) fn add(&mut self, frame: SentFrame) {
        if frame.eliciting {
            self.waiting.insert(self.next, frame);
        }
        self.next += 1;
    }

    /// Takes in the numbers of an acknowledgement, highest first.
    pub(super) fn acknowledge(&mut self, numbers: &[u64]) -> Outcome {
        let mut outcome = Outcome::default();
        for number in numbers {
            if let Some(frame) = self.waiting.remove(number) {
                if Some(number) == numbers.first() {
                    outcome.newest = Some((frame.at, frame.bytes));
                }
                outcome.arrived.push(frame);
            } else if let Some(frame) = self.lost.remove(number) {
                self.reorders = true;
                outcome.arrived.push(frame);
            }
        }
        if let Some(largest) = numbers.first() {
            let limit = largest.saturating_sub(if self.reorders { OVERTAKEN - 1 } else { 0 });
            while let Some(first) = self.waiting.first_entry().filter(|first| *first.key() < limit) {
                let (number, frame) = first.remove_entry();
                outcome.lost.push(self.give_up(number, frame));
            }
        }
        outcome
    }

    /// Frames that are not acknowledged in the time that one of their length has.
    pub(super) fn overdue(&mut self, now: Monotonic, time: impl Fn(usize) -> Duration) -> Vec<SentFrame> {
        let mut lost = Vec::new();
        while let Some(first) =
            self.waiting.first_entry().filter(|first| first.get().at + time(first.get().bytes) <= now)
        {
            let (number, frame) = first.remove_entry();
            lost.push(self.give_up(number, frame));
        }
        lost
    }

    /// All frames that wait, because the peer that would acknowledge them is gone.
    pub(super) fn take_all(&mut self) -> Vec<SentFrame> {
        self.lost.clear();
        std::mem::take(&mut self.waiting).into_values().collect()
    }

    /// When the oldest frame that waits was sent, and its length.
    pub(super) fn oldest(&self) -> Option<(Monotonic, usize)> {
        self.waiting.first_key_value().map(|(_, frame)| (frame.at, frame.bytes))
    }

    fn give_up(&mut self, number: u64, frame: SentFrame) -> SentFrame {
        self.lost.insert(number, frame.clone());
        while self.lost.len() > LOST_MAX {
            self.lost.pop_first();
        }
        frame
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sent(count: u64) -> Sent {
        let mut sent = Sent::default();
        for second in 0..count {
            let at = Monotonic::since_start(Duration::from_secs(second));
            let carried = vec![Carried::Void { start: second, end: second + 1 }];
            sent.add(SentFrame { at, bytes: 10, eliciting: true, carried });
        }
        sent
    }

    #[test]
    fn what_is_overtaken_is_lost_and_may_still_arrive() {
        let mut sent = sent(5);
        let outcome = sent.acknowledge(&[3]);
        assert_eq!((outcome.arrived.len(), outcome.lost.len()), (1, 3));
        assert_eq!(outcome.newest, Some((Monotonic::since_start(Duration::from_secs(3)), 10)));
        let late = sent.acknowledge(&[3, 0]);
        assert_eq!((late.arrived.len(), late.lost.len(), late.newest), (1, 0, None));
    }

    #[test]
    fn what_nobody_acknowledges_is_overdue() {
        let mut sent = sent(3);
        let lost =
            sent.overdue(Monotonic::since_start(Duration::from_millis(2_500)), |_| Duration::from_secs(2));
        assert_eq!((lost.len(), sent.oldest().unwrap().0.elapsed().as_secs()), (1, 1));
        assert_eq!(sent.take_all().len(), 2);
    }
}
