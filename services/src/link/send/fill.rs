//! What goes into a frame, in the order of the classes.

use crate::link::feedback::DELAY_UNIT;
use crate::link::frame::{CommandItem, DIFFER_BYTES, Item, StateItem};
use crate::link::outbox::LIFESPAN_UNIT;
use crate::link::sent::Carried;
use crate::link::state::Sample;
use crate::link::wire::{put_zigzag, varint_len};
use crate::link::{Compare, Link, Ticket, body};
use aldis_envelope::{Monotonic, Now};
use std::time::Duration;

/// Fresh samples share a frame only up to this airtime: a longer frame makes all in it older than it spares bytes.
const FRESH_AIRTIME: Duration = Duration::from_millis(60);

/// Something chosen for a frame.
#[derive(Debug)]
enum Chosen {
    Ack { largest: u16, delay: u8, before: Vec<u8> },
    Loss(u8),
    Void { start: u64, count: u64 },
    Digest { count: u32, digest: u64 },
    Differ([u8; DIFFER_BYTES]),
    Start { transfer: u32, length: u32, digest: u64 },
    Have { transfer: u32, prefix: u32 },
    Piece { transfer: u32, start: u32, end: u32 },
    Command { number: u64, start: u32, end: u32 },
    State(u32, Sample),
    Compact(Vec<u8>),
}

/// What is chosen for a frame, and the room that is left.
#[derive(Debug)]
pub(super) struct Load {
    room: usize,
    used: usize,
    /// What the length of the last item adds when another follows.
    length_of_last: usize,
    chosen: Vec<Chosen>,
    pub(super) carried: Vec<Carried>,
}

impl Load {
    pub(super) fn new(room: usize) -> Self {
        Self { room, used: 0, length_of_last: 0, chosen: Vec::new(), carried: Vec::new() }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.chosen.is_empty()
    }

    pub(super) fn used(&self) -> usize {
        self.used
    }

    /// How many bytes an item may have that comes last.
    fn left(&self) -> usize {
        self.room.saturating_sub(self.used + self.length_of_last)
    }

    /// Adds an item of so many bytes, `content` of them behind a length where something follows.
    fn push(&mut self, chosen: Chosen, bytes: usize, content: Option<usize>) {
        self.used += self.length_of_last + bytes;
        self.length_of_last = content.map_or(0, |content| varint_len(content as u64));
        self.chosen.push(chosen);
    }
}

impl Link {
    /// Chooses what goes into a frame.
    pub(super) fn fill(&mut self, now: Now, index: usize, data: bool, probing: bool, load: &mut Load) {
        let now = now.monotonic;
        self.fill_feedback(now, index, data, load);
        if !data {
            return;
        }
        if probing {
            self.fill_commands(now, index, true, load);
            return;
        }
        self.fill_control(load);
        let before = load.carried.len();
        let mtu = self.paths[index].config.mtu as i64;
        let lower_waits = self.states.is_due() || self.bulk_out.next(1).is_some();
        let lower_first = lower_waits && self.lower_credit >= mtu;
        if !lower_first {
            let used = load.used;
            self.fill_commands(now, index, false, load);
            if load.carried.len() > before {
                if lower_waits {
                    let share = (load.used - used) as i64 * i64::from(self.config.lower_share) / 100;
                    self.lower_credit = (self.lower_credit + share).min(2 * mtu);
                }
                return;
            }
        }
        let used = load.used;
        self.fill_lower(now, index, load);
        self.lower_credit = (self.lower_credit - (load.used - used) as i64).max(-mtu);
    }

    fn fill_lower(&mut self, now: Monotonic, index: usize, load: &mut Load) {
        let mtu = self.paths[index].config.mtu as i64;
        let bulk_waits = self.bulk_out.next(1).is_some();
        let (used, before) = (load.used, load.carried.len());
        if !(bulk_waits && self.bulk_credit >= mtu) {
            self.fill_states(now, index, load);
            if load.carried.len() > before {
                if bulk_waits {
                    let share = (load.used - used) as i64 * i64::from(self.config.bulk_share) / 100;
                    self.bulk_credit = (self.bulk_credit + share).min(2 * mtu);
                }
                return;
            }
        }
        self.fill_piece(load);
        self.bulk_credit = (self.bulk_credit - (load.used - used) as i64).max(-mtu);
    }

    /// Acknowledgements and the measured loss.
    fn fill_feedback(&mut self, now: Monotonic, index: usize, data: bool, load: &mut Load) {
        let path = &mut self.paths[index];
        // One alone names the few frames before it; in a flow they name more, because some of them are lost.
        let bits = if path.acks.taken < 2 { 1 } else { 2 };
        if path.acks.copies > 0
            && let Some((largest, before)) = path.received.acknowledgement(bits)
        {
            let delay = (now - path.acks.newest).as_millis() / DELAY_UNIT.as_millis();
            let delay = delay.min(255) as u8;
            let bytes = 3 + usize::from(delay > 0) + before.len();
            load.push(Chosen::Ack { largest, delay, before }, bytes, None);
            path.acks.taken = 0;
            path.acks.copies -= 1;
            path.acks.due = (path.acks.copies > 0).then_some(now + path.acks.apart);
        }
        if !data && let Some(loss) = path.loss_to_tell(now) {
            load.push(Chosen::Loss(loss), 2, None);
        }
    }

    /// Small things that the peer is to know.
    fn fill_control(&mut self, load: &mut Load) {
        while let Some((start, end)) = self.next_void().filter(|_| load.left() >= 24) {
            let count = end - start;
            load.push(Chosen::Void { start, count }, 1 + varint_len(start) + varint_len(count), None);
            load.carried.push(Carried::Void { start, end });
            self.voids_on_air.insert_range(start, end);
        }
        if self.session.differ_due && load.left() > DIFFER_BYTES {
            self.session.differ_due = false;
            load.push(Chosen::Differ(self.held.digest().1.encode()), 1 + DIFFER_BYTES, None);
            load.carried.push(Carried::Differ);
        }
        while let Some((transfer, prefix)) = self.have.pop_first() {
            let bytes = 1 + varint_len(transfer.into()) + varint_len(prefix.into());
            load.push(Chosen::Have { transfer, prefix }, bytes, None);
            load.carried.push(Carried::Have { transfer });
        }
        if self.compare == Compare::Wanted && self.states.is_settled() && load.left() > 16 {
            let (count, parts) = self.states.digest();
            self.compare = if count == 0 { Compare::Settled } else { Compare::OnAir };
            if count > 0 {
                let bytes = 9 + varint_len(count.into());
                load.push(Chosen::Digest { count, digest: parts.whole() }, bytes, None);
                load.carried.push(Carried::Digest);
            }
        }
    }

    fn fill_commands(&mut self, now: Monotonic, index: usize, probing: bool, load: &mut Load) {
        let hedge = self.hedge(index, probing);
        while let Some((number, start, end)) = self.outbox.take(now, load.left(), load.room, &hedge) {
            let bytes = self.outbox.item(number, start, end, now).map_or(0, |item| item.overhead());
            let content = (end - start) as usize;
            load.push(Chosen::Command { number, start, end }, bytes + content, Some(content));
            load.carried.push(Carried::Command { number, start, end });
            self.counters.command_copies += 1;
            self.note_copy(number, end);
            if probing {
                break;
            }
        }
    }

    /// The sender is told of each whole copy.
    fn note_copy(&mut self, number: u64, end: u32) {
        let entry = self.outbox.entry(number).filter(|entry| end as usize == entry.body.len());
        let ticket = entry.map(|entry| entry.ticket).filter(|ticket| *ticket != Ticket::default());
        self.gone_out.extend(ticket.zip(self.outbox.tries(number)));
    }

    fn fill_states(&mut self, now: Monotonic, index: usize, load: &mut Load) {
        let (mut block, mut before) = (Vec::new(), None);
        let limit = self.paths[index].config.rate as f64 * FRESH_AIRTIME.as_secs_f64();
        let mut fresh = 0;
        while let Some((number, sample)) = self.states.next(now) {
            let Some(entry) = self.names.instances.get(&number) else { break };
            let wraps = before.is_some_and(|before| number <= before);
            let used = (load.used, block.len());
            let short = self.states.short(number, entry, before, now).filter(|_| !wraps && fresh == 0);
            if let Some(short) = short {
                if load.left() < 1 + block.len() + short.len() {
                    break;
                }
                block.extend(short);
                before = Some(number);
            } else {
                let item = self.state_item(number, &sample, now);
                let bytes = item_bytes(&item);
                let enough = fresh > 0 && load.used + bytes > limit as usize;
                if before.is_some() || load.left() < bytes || enough {
                    break;
                }
                fresh += 1;
                let content = sample.content.len();
                load.push(Chosen::State(number, sample.clone()), bytes, Some(content));
            }
            let Sample { origin, sequence, .. } = sample;
            load.carried.push(Carried::State { alias: number, origin, sequence });
            let bytes = load.used - used.0 + block.len() - used.1;
            self.states.sent(number, now, self.paths[index].airtime(bytes));
            self.counters.states_sent += 1;
        }
        if before.is_some() {
            let bytes = 1 + block.len();
            load.push(Chosen::Compact(block), bytes, None);
        }
    }

    fn state_item<'a>(&self, number: u32, sample: &'a Sample, now: Monotonic) -> StateItem<'a> {
        let label = self.names.instances.get(&number).map_or(0, |entry| entry.label);
        let left = sample.expires.map(|expires| (expires - now).as_millis() / LIFESPAN_UNIT.as_millis());
        StateItem {
            alias: number,
            change: body::change_number(sample.change),
            origin: sample.origin,
            sequence: sample.sequence,
            time: sample.time.wrapping_sub(self.base(label)),
            lifespan: left.map(|left| left as u64),
            bytes: &sample.content,
        }
    }

    fn fill_piece(&mut self, load: &mut Load) {
        // A start, a transfer and an offset at their longest.
        let length = load.left().saturating_sub(8);
        let Some((transfer, ..)) = self.bulk_out.next(1) else { return };
        let Some((started, whole, digest)) = self
            .bulk_out
            .transfers
            .get(&transfer)
            .map(|transfer| (transfer.started, transfer.bytes.len() as u32, transfer.digest))
        else {
            return;
        };
        let length = if started { length } else { length.saturating_sub(19) };
        if length < 16 {
            return;
        }
        let Some((transfer, start, end)) = self.bulk_out.next(length as u32) else { return };
        if !started {
            let bytes = 9 + varint_len(transfer.into()) + varint_len(whole.into());
            load.push(Chosen::Start { transfer, length: whole, digest }, bytes, None);
            load.carried.push(Carried::Start { transfer });
        }
        let content = (end - start) as usize;
        let bytes = 1 + varint_len(transfer.into()) + varint_len(start.into()) + content;
        load.push(Chosen::Piece { transfer, start, end }, bytes, Some(content));
        load.carried.push(Carried::Piece { transfer, start, end });
        self.bulk_out.sent(transfer, start, end);
        self.counters.pieces_sent += 1;
    }

    /// Appends what was chosen.
    pub(super) fn write_load(&self, now: Monotonic, load: &Load, out: &mut Vec<u8>) {
        for (place, chosen) in load.chosen.iter().enumerate() {
            let last = place + 1 == load.chosen.len();
            match chosen {
                Chosen::Ack { largest, delay, before } => {
                    Item::Ack { largest: *largest, delay: *delay, before }.write(last, out);
                }
                Chosen::Loss(loss) => Item::Loss(*loss).write(last, out),
                Chosen::Void { start, count } => Item::Void { start: *start, count: *count }.write(last, out),
                Chosen::Digest { count, digest } => {
                    Item::Digest { count: *count, digest: *digest }.write(last, out);
                }
                Chosen::Differ(parts) => Item::Differ(parts).write(last, out),
                Chosen::Start { transfer, length, digest } => {
                    let (transfer, length, digest) = (*transfer, *length, *digest);
                    Item::Start { transfer, length, digest }.write(last, out);
                }
                Chosen::Have { transfer, prefix } => {
                    Item::Have { transfer: *transfer, prefix: *prefix }.write(last, out);
                }
                Chosen::Piece { transfer, start, end } => {
                    self.write_piece(*transfer, *start, *end, last, out)
                }
                Chosen::Command { number, start, end } => {
                    if let Some(item) = self.outbox.item(*number, *start, *end, now) {
                        CommandItem::write(&item, last, out);
                    }
                }
                Chosen::State(number, sample) => self.state_item(*number, sample, now).write(last, out),
                Chosen::Compact(block) => Item::Compact(block).write(last, out),
            }
        }
    }

    fn write_piece(&self, transfer: u32, start: u32, end: u32, last: bool, out: &mut Vec<u8>) {
        let bytes = self.bulk_out.transfers.get(&transfer).map(|whole| &whole.bytes);
        if let Some(bytes) = bytes.and_then(|bytes| bytes.get(start as usize..end as usize)) {
            Item::Piece { transfer, offset: start, bytes }.write(last, out);
        }
    }
}

/// How many bytes a sample takes as the last item.
fn item_bytes(item: &StateItem<'_>) -> usize {
    let mut time = Vec::with_capacity(10);
    put_zigzag(item.time, &mut time);
    let numbers = varint_len(item.alias.into()) + varint_len(item.origin.into()) + varint_len(item.sequence);
    1 + numbers + time.len() + item.lifespan.map_or(0, varint_len) + item.bytes.len()
}
