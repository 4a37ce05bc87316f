//! The lossy link: a protocol between two gateways over carriers that lose, delay, repeat and reorder.
//!
//! Pure: [`Link::handle`] turns events into effects. One object serves one peer. `PROTOCOL.md` beside this file shows
//! frames and states; `spec` of what it must reach is measured by [`crate::sim::link`].

mod body;
mod bulk;
mod event;
pub mod export;
mod feedback;
mod frame;
mod held;
mod inbox;
mod journal;
mod names;
mod offer;
mod outbox;
mod path;
pub mod plan;
mod ranges;
mod receive;
mod received;
mod record;
mod seal;
mod send;
mod sent;
mod session;
mod state;
mod status;
mod unwritten;
mod wire;

pub use event::{
    BatchId, Class, Delivery, DeliveryId, Effect, Event, Offer, Reason, Record, Ticket, TicketState,
};
pub use export::LinkSpec;
pub use frame::VERSION;
pub use path::{CarrierConfig, CarrierId, GONE_AFTER, MTU_MIN};
pub use record::record_prefix;
pub use seal::{LinkKey, TAG_BYTES};
pub use session::sender_of;

use crate::counters::counters;
use aldis_envelope::{BootId, EntityId, Monotonic, Now};
use bulk::{BulkIn, BulkOut};
use feedback::InDoubt;
use held::Held;
use inbox::Inbox;
use journal::AfterWrite;
use names::Names;
use outbox::Outbox;
use path::Path;
use ranges::Ranges;
use record::RecordKeys;
use session::Session;
use state::States;
use std::collections::BTreeMap;
use unwritten::{Batch, Unwritten};

/// What is configured of a link.
#[derive(Debug, Clone)]
pub struct LinkConfig {
    /// The entity of this end.
    pub own: EntityId,
    /// The entity of the other end.
    pub peer: EntityId,
    /// The carriers, the preferred one first.
    pub carriers: Vec<CarrierConfig>,
    /// Keys shared with the peer. With none, frames are not authenticated.
    pub keys: Vec<LinkKey>,
    /// The part of the bytes that states and bulk get even when commands would take all, in per cent.
    pub lower_share: u8,
    /// The part of the bytes that bulk gets even when states would take all, in per cent.
    pub bulk_share: u8,
    /// How many commands may wait.
    pub commands_max: usize,
    /// The longest large message in bytes, and how many bytes of them may wait.
    pub bulk_bytes_max: usize,
    /// Whether the link begins in silent mode.
    pub silent: bool,
}

impl LinkConfig {
    /// A link with the usual limits.
    pub fn new(own: EntityId, peer: EntityId, carriers: Vec<CarrierConfig>) -> Self {
        Self {
            own,
            peer,
            carriers,
            keys: Vec::new(),
            lower_share: 10,
            bulk_share: 5,
            commands_max: 1_000_000,
            bulk_bytes_max: 16 << 20,
            silent: false,
        }
    }
}

counters! {
    /// What a link counts.
    LinkCounters {
    /// Frames sent.
    frames_sent,
    /// Bytes of the frames sent, from the first byte to the tag.
    bytes_sent,
    /// Frames received that were new and could be read.
    frames_received,
    /// Frames that came again, or too late to tell.
    frames_repeated,
    /// Frames that are none of ours: not for this link, not of this version, or malformed.
    frames_foreign,
    /// Frames whose tag is wrong.
    frames_forged,
    /// Frames of another life of the peer.
    frames_stale,
    /// Commands accepted.
    commands_accepted,
    /// Copies of commands sent.
    command_copies,
    /// Commands that the peer has.
    commands_delivered,
    /// Commands whose lifespan ended.
    commands_expired,
    /// Commands refused at once.
    commands_refused,
    /// Commands handed over here.
    commands_received,
    /// Commands that came after their lifespan.
    commands_late,
    /// Messages that had passed this node before.
    loops_stopped,
    /// Samples of states sent.
    states_sent,
    /// Samples of states handed over here.
    states_received,
    /// Samples of states replaced by newer ones before they were sent, or older than what was there.
    states_conflated,
    /// Samples of states that came and were not newer than what was held.
    states_old,
    /// Pieces of large messages sent.
    pieces_sent,
    /// Records that could not be read back, or batches that were not written.
    journal_failures,
    }
}

/// One end of a link.
#[derive(Debug)]
pub struct Link {
    config: LinkConfig,
    boot: BootId,
    silent: bool,
    /// The journal was read back.
    ready: bool,
    /// When this end's journal was born.
    born: u64,
    paths: Vec<Path>,
    session: Session,
    outbox: Outbox,
    inbox: Inbox,
    /// Voids that are on the air.
    voids_on_air: Ranges,
    /// Expired commands of which no word came back.
    in_doubt: BTreeMap<u64, InDoubt>,
    names: Names,
    peer_names: Names,
    states: States,
    held: Held,
    bulk_out: BulkOut,
    bulk_in: BulkIn,
    /// What the peer is to be told of transfers.
    have: BTreeMap<u32, u32>,
    /// The state of what the peer holds is to be compared.
    compare: Compare,
    /// Bytes that lower classes have lost to commands, and bulk to states.
    lower_credit: i64,
    bulk_credit: i64,
    next_probe: Monotonic,
    probes: u32,
    heard: bool,
    keys: RecordKeys,
    records: Vec<Record>,
    after_write: Vec<AfterWrite>,
    batches: BTreeMap<BatchId, Batch>,
    unwritten: Unwritten,
    next_batch: u64,
    reserved: u64,
    /// Commands of which a whole copy has just gone out, with how many there were.
    gone_out: Vec<(Ticket, u32)>,
    armed: Option<Monotonic>,
    counters: LinkCounters,
}

/// Comparing what the peer holds with what it is believed to hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Compare {
    /// Nothing is to be compared.
    #[default]
    Settled,
    /// The digest is to be sent when nothing else is to go out.
    Wanted,
    /// The digest is on the air.
    OnAir,
}

impl Link {
    /// One end of a link, in the life `boot` of its node. It waits for its journal.
    pub fn new(config: LinkConfig, boot: BootId) -> Self {
        Self {
            keys: RecordKeys::new(config.peer),
            silent: config.silent,
            paths: config.carriers.iter().cloned().map(Path::new).collect(),
            session: Session::default(),
            config,
            boot,
            ready: false,
            born: 0,
            outbox: Outbox::new(),
            inbox: Inbox::default(),
            voids_on_air: Ranges::default(),
            in_doubt: BTreeMap::new(),
            names: Names::default(),
            peer_names: Names::default(),
            states: States::default(),
            held: Held::default(),
            bulk_out: BulkOut::default(),
            bulk_in: BulkIn::default(),
            have: BTreeMap::new(),
            compare: Compare::default(),
            lower_credit: 0,
            bulk_credit: 0,
            next_probe: Monotonic::START,
            probes: 0,
            heard: false,
            records: Vec::new(),
            after_write: Vec::new(),
            batches: BTreeMap::new(),
            unwritten: Unwritten::default(),
            next_batch: 0,
            reserved: 1,
            gone_out: Vec::new(),
            armed: None,
            counters: LinkCounters::default(),
        }
    }

    /// Takes events in and says what is to be done.
    pub fn handle(&mut self, now: Now, events: &mut Vec<Event>, effects: &mut Vec<Effect>) {
        for event in events.drain(..) {
            self.on_event(now, event, effects);
            self.flush_much(now.monotonic, effects);
        }
        if self.ready {
            self.pass_time(now, effects);
            self.transmit(now, effects);
        }
        self.flush(now.monotonic, effects);
        self.arm(now.monotonic, effects);
    }

    fn on_event(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        match event {
            Event::Offer(offer) => self.on_offer(now, offer, effects),
            Event::Cancel(ticket) => self.on_cancel(ticket, effects),
            Event::Frame(carrier, bytes) => self.on_frame(now, carrier, &bytes, effects),
            Event::CarrierUp(carrier, mtu) => self.with_path(carrier, |path| {
                (path.up, path.free) = (true, true);
                path.config.mtu = mtu.max(MTU_MIN);
            }),
            Event::CarrierDown(carrier) => self.with_path(carrier, |path| path.up = false),
            Event::CarrierFree(carrier, free) => self.with_path(carrier, |path| path.free = free),
            Event::ReadBack { key, value } => self.on_read_back(now, &key, &value),
            Event::ReadBackEnd => self.on_read_back_end(now, effects),
            Event::Written(batch) => self.on_written(now, batch, effects),
            Event::WriteFailed(batch, why) => self.on_write_failed(now.monotonic, batch, &why, effects),
            Event::Done { delivery, with } => {
                if self.inbox.finish(delivery.0) {
                    self.records.push(self.keys.forget(record::Kind::Incoming, delivery.0));
                }
                self.records.extend(with);
            }
            Event::Silent(silent) => self.silent = silent,
            Event::Keys(keys) => self.config.keys = keys,
            Event::Deadline => self.armed = None,
        }
    }

    fn with_path(&mut self, carrier: CarrierId, change: impl FnOnce(&mut Path)) {
        if let Some(path) = self.paths.iter_mut().find(|path| path.config.id == carrier) {
            change(path);
        }
    }

    /// What the link has counted.
    pub fn counters(&self) -> &LinkCounters {
        &self.counters
    }

    /// Commands, instances and bytes of large messages that wait.
    pub fn waiting(&self) -> (usize, usize, usize) {
        (self.outbox.len(), self.states.waiting(), self.bulk_out.bytes())
    }

    /// How many commands wait or are on the air, those of the link itself aside, and their bytes.
    pub fn commands(&self) -> (usize, usize) {
        self.outbox.commands()
    }

    /// The life of its node, where that is known only when the journal is read back.
    pub fn set_boot(&mut self, boot: BootId) {
        self.boot = boot;
    }

    /// Whether the peer was heard lately.
    pub fn is_heard(&self) -> bool {
        self.heard
    }

    /// Whether the peer is known to hold the newest sample of every instance.
    pub fn is_settled(&self) -> bool {
        self.states.is_settled() && self.compare == Compare::Settled
    }

    /// What is measured of a carrier: the round trip in seconds, and the part of frames lost on the way out.
    pub fn measured(&self, carrier: CarrierId) -> Option<(f64, f64)> {
        let path = self.paths.iter().find(|path| path.config.id == carrier)?;
        Some((path.round_trip().as_secs_f64(), path.loss_out))
    }
}

#[cfg(test)]
mod tests;
