//! The frames that came by one carrier: which are new, which are acknowledged, how many were lost.

use super::frame::{ACK_BYTES_MAX, Item};

/// How many numbers below the highest are remembered. A frame that comes later than that counts as a replay.
const WINDOW: u64 = 128;

/// The weight of one frame in the measured loss: about the last 100 frames count. More weight, and chance looks like change.
const LOSS_WEIGHT: f64 = 0.01;

/// What was received on one carrier in the peer's present life.
#[derive(Debug, Clone, Default)]
pub(super) struct Received {
    /// One above the highest number seen.
    next: u64,
    /// Bit n: number `next - 1 - n` was seen.
    seen: u128,
    /// The same for those that may be acknowledged: all that they carried is safe.
    safe: u128,
    loss: f64,
}

impl Received {
    /// The whole number of a frame from its lowest bits: the nearest to what is expected.
    pub(super) fn whole(&self, low: u16) -> u64 {
        let distance = low.wrapping_sub(self.next as u16) as i16;
        let whole = self.next.wrapping_add_signed(distance.into());
        // Before the first wrap there is nothing below.
        if whole > self.next + u64::from(u16::MAX) { u64::from(low) } else { whole }
    }

    /// Whether a number was not seen before, as far as can be told.
    pub(super) fn is_new(&self, number: u64) -> bool {
        number >= self.next
            || (self.next - 1 - number < WINDOW && self.seen & 1 << (self.next - 1 - number) == 0)
    }

    /// Takes a number down; false for one that was seen before or is too old to tell.
    pub(super) fn see(&mut self, number: u64) -> bool {
        if number >= self.next {
            let step = number + 1 - self.next;
            let shift = |bits: u128| if step >= WINDOW { 0 } else { bits << step };
            (self.seen, self.safe) = (shift(self.seen) | 1, shift(self.safe));
            // A life's first frame says nothing about those before it.
            let lost = if self.next == 0 { 0 } else { step - 1 };
            for _ in 0..lost.min(WINDOW) {
                self.loss += (1.0 - self.loss) * LOSS_WEIGHT;
            }
            self.loss -= self.loss * LOSS_WEIGHT;
            self.next = number + 1;
            return true;
        }
        if !self.is_new(number) {
            return false;
        }
        let back = self.next - 1 - number;
        self.seen |= 1 << back;
        // It was counted as lost when the gap was seen.
        self.loss = (self.loss - LOSS_WEIGHT).max(0.0);
        true
    }

    /// All that the frame carried is safe: it may be acknowledged.
    pub(super) fn acknowledge(&mut self, number: u64) {
        let back = self.next.wrapping_sub(1).wrapping_sub(number);
        if back < WINDOW {
            self.safe |= 1 << back;
        }
    }

    /// The bits of an acknowledgement, and the highest number in it.
    /// At most so many bytes of bits: what is older was told before.
    pub(super) fn acknowledgement(&self, most: usize) -> Option<(u16, Vec<u8>)> {
        let skip = self.safe.trailing_zeros();
        if skip >= 128 {
            return None;
        }
        let largest = (self.next - 1 - u64::from(skip)) as u16;
        let before = (self.safe >> skip) >> 1;
        let bytes = before.to_le_bytes();
        let length = bytes
            .iter()
            .take(most.min(ACK_BYTES_MAX))
            .rposition(|byte| *byte != 0)
            .map_or(0, |last| last + 1);
        Some((largest, bytes[..length].to_vec()))
    }

    /// The part of the peer's frames that is lost here, 0 to 1.
    pub(super) fn loss(&self) -> f64 {
        self.loss
    }
}

/// The numbers that an acknowledgement names, whole, given the next number that would be sent. Highest first.
pub(super) fn acknowledged(item: &Item<'_>, next: u64) -> Vec<u64> {
    let Item::Ack { largest, before, .. } = item else { return Vec::new() };
    let back = (next as u16).wrapping_sub(*largest);
    // A number that was never sent: the peer speaks of another life, or lies.
    let Some(largest) = next.checked_sub(back.into()).filter(|_| back != 0) else { return Vec::new() };
    let bits = before.iter().flat_map(|byte| (0..8).map(move |bit| byte >> bit & 1 == 1));
    let older = bits.enumerate().filter(|(_, set)| *set);
    let older = older.filter_map(|(place, _)| largest.checked_sub(place as u64 + 1));
    std::iter::once(largest).chain(older).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    #[test]
    fn the_first_frame_may_have_any_number_and_is_not_loss() {
        let mut received = Received::default();
        assert!(received.see(received.whole(40)));
        assert_eq!(received.loss(), 0.0);
        assert!(received.see(received.whole(43)));
        assert!(received.loss() > 0.015 && received.loss() < 0.025);
    }

    #[test]
    fn numbers_are_whole_across_the_wrap() {
        let mut received = Received::default();
        for number in (0..200_000u64).step_by(7) {
            assert_eq!(received.whole(number as u16), number);
            assert!(received.see(number));
        }
        assert_eq!(received.whole(199_990u64 as u16), 199_990);
    }

    proptest! {
        #[test]
        fn a_frame_is_new_once_and_the_acknowledgement_names_what_is_safe(
            numbers in prop::collection::vec((0u64..60, any::<bool>()), 1..80)
        ) {
            let (mut received, mut seen, mut safe) = (Received::default(), BTreeSet::new(), BTreeSet::new());
            for (number, acknowledge) in numbers {
                prop_assert_eq!(received.see(number), seen.insert(number));
                if acknowledge {
                    received.acknowledge(number);
                    safe.insert(number);
                }
            }
            let told = received.acknowledgement(8).map(|(largest, before)| {
                acknowledged(&Item::Ack { largest, delay: 0, before: &before }, 60)
            });
            let told: BTreeSet<_> = told.unwrap_or_default().into_iter().collect();
            prop_assert_eq!(told, safe);
        }
    }
}
