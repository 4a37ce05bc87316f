//! One carrier to the peer: its pace, its round trip, its loss, and when it was heard.

use super::received::Received;
use super::sent::Sent;
use aldis_envelope::Monotonic;
use std::collections::VecDeque;
use std::time::Duration;

/// A carrier, by the number that both ends configure for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct CarrierId(pub u8);

/// What is configured of a carrier.
#[derive(Debug, Clone, PartialEq)]
pub struct CarrierConfig {
    /// Its number, the same at both ends.
    pub id: CarrierId,
    /// Bytes per second that may be sent.
    pub rate: u64,
    /// The longest frame in bytes, at least [`MTU_MIN`].
    pub mtu: usize,
    /// The round trip until one is measured.
    pub round_trip: Duration,
    /// The part of frames lost until it is measured, 0 to 1.
    pub loss: f64,
}

/// The smallest MTU: a hello, a tag and a piece of a message fit.
pub const MTU_MIN: usize = 128;

/// How long a carrier may be silent before another is preferred, at least. Shorter and a few lost frames move the traffic.
const SILENT_AFTER: Duration = Duration::from_secs(3);

/// Frames closer together than this count as one: what loses one may lose the other.
const APART: Duration = Duration::from_millis(100);

/// How surely a peer that is there is heard within the silence that counts as gone: at 30 % loss about one false alarm in ten hours.
const UNHEARD: f64 = 4e-5;

/// Silence after which the peer counts as gone.
pub const GONE_AFTER: Duration = Duration::from_secs(10);

/// About the bytes of a frame with an acknowledgement alone.
const ACK_BYTES: usize = 10;

/// How long an acknowledgement waits for a second frame, at most.
pub(super) const ACK_DELAY: Duration = Duration::from_millis(100);

/// The state of a carrier.
#[derive(Debug)]
pub(super) struct Path {
    pub(super) config: CarrierConfig,
    pub(super) up: bool,
    pub(super) free: bool,
    pub(super) next_send: Monotonic,
    pub(super) last_sent: Monotonic,
    pub(super) last_heard: Option<Monotonic>,
    pub(super) sent: Sent,
    pub(super) received: Received,
    pub(super) acks: Acks,
    /// The part of our frames that the peer does not hear.
    pub(super) loss_out: f64,
    /// What the peer was last told of the loss here, and when.
    told_loss: (u8, Monotonic),
    smoothed: Duration,
    variation: Duration,
    /// When the last frames went out, those close together as one.
    recent: VecDeque<Monotonic>,
    /// How long the peer takes to make a command safe.
    delay: Duration,
    measured: bool,
}

/// Acknowledgements that are to go out.
#[derive(Debug, Default)]
pub(super) struct Acks {
    /// When the next must go.
    pub(super) due: Option<Monotonic>,
    /// How many more copies are to go.
    pub(super) copies: u32,
    /// How long after one copy the next goes.
    pub(super) apart: Duration,
    /// Frames taken since the last one.
    pub(super) taken: u32,
    /// When the newest frame in it came.
    pub(super) newest: Monotonic,
}

impl Path {
    pub(super) fn new(config: CarrierConfig) -> Self {
        Self {
            smoothed: config.round_trip,
            variation: config.round_trip / 8,
            loss_out: config.loss,
            up: false,
            free: true,
            next_send: Monotonic::START,
            last_sent: Monotonic::START,
            last_heard: None,
            sent: Sent::default(),
            received: Received::default(),
            acks: Acks::default(),
            told_loss: ((config.loss * 255.0) as u8, Monotonic::START),
            recent: VecDeque::new(),
            delay: Duration::ZERO,
            measured: false,
            config,
        }
    }

    /// How long so many bytes take at the configured rate.
    pub(super) fn airtime(&self, bytes: usize) -> Duration {
        Duration::from_nanos((bytes as u64).saturating_mul(1_000_000_000) / self.config.rate.max(1))
    }

    /// A frame goes out: the next may follow when its bytes are paid for. Nothing is saved up while nothing is sent, so in no ten
    /// seconds goes more than the rate and one frame.
    pub(super) fn pay(&mut self, now: Monotonic, bytes: usize) {
        self.next_send = self.next_send.max(now) + self.airtime(bytes);
        self.last_sent = now;
        if self.recent.back().is_none_or(|last| now - *last >= APART) {
            self.recent.push_back(now);
        }
        while self.recent.len() > self.frames_wanted() {
            self.recent.pop_front();
        }
    }

    /// An acknowledgement of the newest frame came.
    pub(super) fn measure(&mut self, now: Monotonic, sent: (Monotonic, usize), delay: Duration) {
        let (at, bytes) = sent;
        let trip = (now - at).saturating_sub(self.airtime(bytes)).saturating_sub(delay);
        self.delay = self.delay * 7 / 8 + delay / 8;
        if !self.measured {
            (self.smoothed, self.variation, self.measured) = (trip, trip / 8, true);
            return;
        }
        let error = trip.max(self.smoothed) - trip.min(self.smoothed);
        self.variation = self.variation * 3 / 4 + error / 4;
        self.smoothed = self.smoothed * 7 / 8 + trip / 8;
    }

    /// The time from the end of a frame to the end of its acknowledgement, as measured.
    pub(super) fn round_trip(&self) -> Duration {
        self.smoothed
    }

    /// How long to wait for the acknowledgement of a frame.
    pub(super) fn timeout(&self, bytes: usize) -> Duration {
        // 3 ms: a shell's timer and a journal are no quicker. The second copy of an acknowledgement takes its time too.
        let slack = (self.variation * 3).max(Duration::from_millis(3) + self.airtime(2 * ACK_BYTES));
        self.smoothed + self.airtime(bytes) + self.delay + slack
    }

    /// Until when this carrier counts as heard.
    pub(super) fn heard_until(&self) -> Option<Monotonic> {
        let limit = SILENT_AFTER.max(self.timeout(self.config.mtu) * 4);
        self.last_heard.map(|heard| heard + limit)
    }

    /// Whether something was heard lately enough to prefer this carrier.
    pub(super) fn is_heard(&self, now: Monotonic) -> bool {
        self.up && self.heard_until().is_some_and(|until| now < until)
    }

    /// Whether a frame may go out now.
    pub(super) fn is_open(&self, now: Monotonic) -> bool {
        self.up && self.free && self.next_send <= now
    }

    /// How many frames must go out in the time that counts as silence, so that the peer does not take this end for gone.
    fn frames_wanted(&self) -> usize {
        // The measured loss errs by a few hundredths.
        let loss = (self.loss_out + 0.03).clamp(0.02, 0.8);
        (UNHEARD.ln() / loss.ln()).ceil().max(3.0) as usize
    }

    /// When something must go out so that the peer does not take this end for gone.
    pub(super) fn keep_alive_at(&self) -> Monotonic {
        let frames = self.frames_wanted();
        let within = GONE_AFTER.mul_f64(0.95);
        let pause = within / frames as u32;
        let even = self.last_sent + pause;
        // What went out anyway counts; but nobody is to be silent for long.
        let enough = self.recent.len() >= frames;
        let counted = self.recent.front().filter(|_| enough).map_or(even, |first| *first + within);
        counted.clamp(even, even + pause)
    }

    /// How many copies of an acknowledgement go out, by the loss on the way to the peer.
    pub(super) fn ack_copies(&self) -> u32 {
        match self.loss_out {
            loss if loss < 0.08 => 1,
            loss if loss < 0.4 => 2,
            _ => 3,
        }
    }

    /// The loss here, if the peer should be told anew: it changed, or it was told long ago.
    pub(super) fn loss_to_tell(&mut self, now: Monotonic) -> Option<u8> {
        let loss = (self.received.loss() * 255.0) as u8;
        let (told, at) = self.told_loss;
        let news = loss.abs_diff(told) >= 12 && now - at >= Duration::from_secs(1);
        let long_ago = (loss != 0 || told != 0) && now - at >= Duration::from_secs(10);
        (news || long_ago).then(|| {
            self.told_loss = (loss, now);
            loss
        })
    }

    /// When a frame that nothing was heard of counts as lost, though no later one arrived: its acknowledgement may wait for a
    /// second frame.
    pub(super) fn overdue_after(&self, idle: bool, bytes: usize) -> Duration {
        // While nothing else goes out, nothing is to be gained by waiting for later frames to tell.
        let others = if idle { 0 } else { 2 };
        // A short frame may be acknowledged behind a long one.
        self.timeout(bytes.max(self.config.mtu) + self.config.mtu * others) + ACK_DELAY
    }

    /// A frame came that is to be acknowledged at `due`.
    pub(super) fn owe(&mut self, due: Monotonic) {
        self.acks.due = Some(self.acks.due.map_or(due, |earlier| earlier.min(due)));
    }

    /// The peer began a new life, or this end did: numbers begin anew.
    pub(super) fn forget_peer(&mut self) {
        self.received = Received::default();
        self.acks = Acks::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path() -> Path {
        let round_trip = Duration::from_millis(600);
        Path::new(CarrierConfig { id: CarrierId(0), rate: 1_200, mtu: 256, round_trip, loss: 0.3 })
    }

    fn at(milliseconds: u64) -> Monotonic {
        Monotonic::since_start(Duration::from_millis(milliseconds))
    }

    #[test]
    fn bytes_are_paid_for_and_nothing_is_saved_up() {
        let mut path = path();
        path.pay(at(5_000), 120);
        assert_eq!(path.next_send, at(5_100));
        path.pay(at(5_100), 240);
        assert_eq!(path.next_send, at(5_300));
    }

    #[test]
    fn the_round_trip_is_without_the_frame_itself_and_without_the_peers_delay() {
        let mut path = path();
        path.measure(at(850), (at(0), 120), Duration::from_millis(50));
        assert_eq!(path.round_trip(), Duration::from_millis(700));
        assert!(path.timeout(120) > Duration::from_millis(800));
    }

    #[test]
    fn the_worse_the_link_the_more_often_one_speaks() {
        let mut path = path();
        let at_30_percent = path.keep_alive_at();
        path.loss_out = 0.0;
        let without_loss = path.keep_alive_at();
        assert!(without_loss.elapsed() > at_30_percent.elapsed() * 2);
        assert!(without_loss.elapsed() < GONE_AFTER / 3);
    }
}
