//! When a command that is on the air goes out again.
//!
//! A copy goes out, then a time-out passes. If nothing came back, the next round is as many copies as bring the
//! chance that none arrived below a tenth of what the round before allowed, spread over half a round trip. Parts of a copy are
//! spread over the commands by their numbers.

use crate::link::ranges::Ranges;
use aldis_envelope::Monotonic;
use std::time::Duration;

/// The chance that no copy arrived which the second round of copies allows; each round after it a tenth of that.
const RESIDUE: f64 = 0.01;

/// The most copies in one round.
const COPIES_MAX: u32 = 4;

/// What the carrier says about sending again.
#[derive(Debug, Clone, Copy)]
pub(in crate::link) struct Hedge {
    /// The part of frames that is lost.
    pub(in crate::link) loss: f64,
    /// How long to wait for an acknowledgement, without the frame itself.
    pub(in crate::link) timeout: Duration,
    pub(in crate::link) round_trip: Duration,
    /// The carrier's rate in bytes per second.
    pub(in crate::link) bytes_of_a_second: usize,
    /// Nobody is heard: one copy at a time goes out, often.
    pub(in crate::link) probing: bool,
}

/// The same for one command.
#[derive(Debug, Clone, Copy)]
pub(in crate::link) struct CommandHedge {
    loss: f64,
    timeout: Duration,
    round_trip: Duration,
    probe_after: Option<Duration>,
    crowded: bool,
}

impl Hedge {
    pub(in crate::link) fn of(&self, bytes: usize, crowded: bool) -> CommandHedge {
        let airtime = Duration::from_secs_f64(bytes as f64 / self.bytes_of_a_second.max(1) as f64);
        // A probe costs at most a fifth of the rate, and comes at least twice a second where that allows it.
        let probe_after = self.probing.then(|| (airtime * 5).max(Duration::from_millis(330)));
        let Self { loss, timeout, round_trip, .. } = *self;
        CommandHedge { loss, timeout: timeout + airtime, round_trip, probe_after, crowded }
    }
}

/// A command on the air.
#[derive(Debug)]
pub(in crate::link) struct Flight {
    /// How often all of it was sent.
    pub(in crate::link) copies: u32,
    /// Where the present copy has come to.
    pub(in crate::link) cursor: u32,
    /// Bytes that arrived.
    pub(in crate::link) acknowledged: Ranges,
    /// When it is to be sent again.
    pub(in crate::link) next: Monotonic,
    round: i32,
    /// Copies that are left in this round.
    left: u32,
    /// When the first copy of the round went out.
    began: Monotonic,
    /// When the last bytes went out.
    last: Monotonic,
    /// What is added before parts of a copy are rounded up, -1/4 to 1/2. It also keeps the measured loss, which errs by a few
    /// hundredths, from taking a copy away.
    part: f64,
}

impl Flight {
    pub(in crate::link) fn new(now: Monotonic, number: u64) -> Self {
        let part = (number % 4) as f64 / 4.0 - 0.25;
        let acknowledged = Ranges::default();
        Self { copies: 0, cursor: 0, acknowledged, next: now, round: 0, left: 0, began: now, last: now, part }
    }

    /// Whether nothing of it went out after `at`, and nothing more is to go in this round.
    pub(in crate::link) fn is_last_copy(&self, at: Monotonic) -> bool {
        self.last <= at && self.left == 0 && self.cursor == 0
    }

    /// Bytes up to `end` of `length` went out.
    pub(in crate::link) fn sent(
        &mut self,
        now: Monotonic,
        end: u32,
        length: u32,
        expires: Option<Monotonic>,
        hedge: &CommandHedge,
    ) {
        self.last = now;
        self.cursor = self.acknowledged.first_missing(end.into()) as u32;
        if self.cursor < length {
            // The rest of this copy follows at once.
            self.next = now;
            return;
        }
        self.cursor = 0;
        self.copies += 1;
        if let Some(probe_after) = hedge.probe_after {
            (self.left, self.began) = (0, now);
            self.next = now + probe_after;
            return;
        }
        if self.left == 0 {
            self.round += 1;
            self.began = now;
            self.left = self.copies_of_round(now, expires, hedge);
        }
        self.left -= 1;
        let spread = hedge.round_trip / 2 / (COPIES_MAX - 1).max(self.left + 1);
        self.next = if self.left > 0 { now + spread } else { (self.began + hedge.timeout).max(now + spread) };
    }

    /// How many copies the round has that begins with the copy just sent.
    fn copies_of_round(&self, now: Monotonic, expires: Option<Monotonic>, hedge: &CommandHedge) -> u32 {
        if hedge.crowded {
            return 1;
        }
        let loss = hedge.loss.clamp(0.001, 0.9);
        // A command that cannot wait for an acknowledgement twice gets all its copies now.
        let hurried = expires.is_some_and(|expires| now + hedge.timeout * 2 > expires);
        let round = if hurried { self.round.max(2) } else { self.round };
        if round < 2 {
            return 1;
        }
        let residue = RESIDUE * 0.1f64.powi(round - 2);
        let wanted = (residue.ln() / loss.ln() + self.part).ceil() as u32;
        wanted.saturating_sub(self.copies - 1).clamp(1, COPIES_MAX)
    }

    /// All of it goes again at once, in a new round.
    pub(in crate::link) fn hurry(&mut self, now: Monotonic) {
        (self.cursor, self.left, self.next) = (0, 0, now);
        self.round = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(milliseconds: u64) -> Monotonic {
        Monotonic::since_start(Duration::from_millis(milliseconds))
    }

    fn sends(loss: f64, probing: bool, until: u64) -> Vec<u64> {
        let round_trip = Duration::from_millis(600);
        let hedge = Hedge { loss, timeout: round_trip, round_trip, bytes_of_a_second: 1_000, probing };
        let mut flight = Flight::new(at(0), 4);
        let mut sends = Vec::new();
        while flight.next < at(until) {
            sends.push(flight.next.elapsed().as_millis() as u64);
            flight.sent(flight.next, 80, 80, None, &hedge.of(80, false));
        }
        sends
    }

    #[test]
    fn later_rounds_have_the_copies_that_the_loss_calls_for() {
        assert_eq!(sends(0.0, false, 2_000), [0, 680, 1_360]);
        assert_eq!(sends(0.3, false, 1_400), [0, 680, 780, 880, 1_360]);
        assert_eq!(sends(0.5, false, 1_300).len(), 5);
    }

    #[test]
    fn while_nobody_is_heard_one_copy_goes_out_often() {
        assert_eq!(sends(0.3, true, 1_300), [0, 400, 800, 1_200]);
    }

    #[test]
    fn a_command_in_pieces_goes_out_without_what_arrived() {
        let mut flight = Flight::new(at(0), 4);
        let hedge = Hedge {
            loss: 0.0,
            timeout: Duration::from_secs(1),
            round_trip: Duration::from_secs(1),
            bytes_of_a_second: 1_000,
            probing: false,
        };
        flight.acknowledged.insert_range(100, 200);
        flight.sent(at(0), 100, 250, None, &hedge.of(250, false));
        assert_eq!((flight.cursor, flight.copies), (200, 0));
        flight.sent(at(0), 250, 250, None, &hedge.of(250, false));
        assert_eq!((flight.cursor, flight.copies), (0, 1));
    }
}
