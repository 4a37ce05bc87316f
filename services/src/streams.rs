//! Sequences: numbering what goes out, and finding gaps in what comes in.

use aldis_envelope::{Address, BootId, EntityId, Source, Stamp};
use std::collections::BTreeMap;

/// How many streams are tracked each way. 100 vehicles with 100 streams are a sixth of it; what is beyond is carried
/// without looking for gaps.
const STREAMS_MAX: usize = 65_536;

/// What a node sends under one source and address.
#[derive(Debug, Default, Clone, Copy)]
struct Outgoing {
    sequence: u64,
    skipped: u32,
}

/// Numbers the samples of outgoing streams.
#[derive(Debug, Default)]
pub struct Outbound {
    index: BTreeMap<(Source, Address), usize>,
    streams: Vec<Outgoing>,
}

impl Outbound {
    /// The place of a stream, new or known.
    pub fn place(&mut self, source: Source, address: &Address) -> usize {
        let next = self.streams.len();
        let place = *self.index.entry((source, address.clone())).or_insert(next);
        if place == next {
            self.streams.push(Outgoing::default());
        }
        place
    }

    /// The next number of a stream, and how many before it were left out.
    pub fn next(&mut self, place: usize) -> (u64, u32) {
        let stream = &mut self.streams[place];
        stream.sequence += 1;
        (stream.sequence, std::mem::take(&mut stream.skipped))
    }

    /// The sample that was just numbered does not go out after all: the one after it will tell.
    pub fn held_back(&mut self, place: usize, told: u32) {
        let stream = &mut self.streams[place];
        stream.skipped = stream.skipped.saturating_add(told).saturating_add(1);
    }
}

/// What a sample says about its stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Gap {
    /// Samples missing before it, neither told nor explained by an outage of our own.
    pub lost: u64,
    /// Samples that its sender left out and told.
    pub told: u64,
    /// Samples missing while our own session was down.
    pub offline: u64,
}

#[derive(Debug, Clone, Copy)]
struct Incoming {
    boot: BootId,
    last: u64,
    was_offline: bool,
}

/// Follows the sequences of incoming streams.
#[derive(Debug, Default)]
pub struct Inbound {
    index: BTreeMap<(EntityId, Source, Address), usize>,
    streams: Vec<Incoming>,
}

impl Inbound {
    /// The place of a stream that is followed already or can be; none when there are too many.
    pub fn place(&mut self, stamp: &Stamp, source: Source, address: &Address) -> Option<usize> {
        let key = (stamp.node, source, address.clone());
        if let Some(&place) = self.index.get(&key) {
            return Some(place);
        }
        if self.streams.len() >= STREAMS_MAX {
            return None;
        }
        self.index.insert(key, self.streams.len());
        // Nothing is missing before the first sample that one hears.
        let last = stamp.sequence.saturating_sub(1);
        self.streams.push(Incoming { boot: stamp.boot, last, was_offline: false });
        Some(self.streams.len() - 1)
    }

    /// Takes a sample's number: the gap before it, or none when it is old.
    pub fn accept(&mut self, place: usize, stamp: &Stamp) -> Option<Gap> {
        let stream = &mut self.streams[place];
        if stamp.boot < stream.boot || (stamp.boot == stream.boot && stamp.sequence <= stream.last) {
            return None;
        }
        let was_offline = std::mem::take(&mut stream.was_offline);
        if stamp.boot > stream.boot {
            *stream = Incoming { boot: stamp.boot, last: stamp.sequence, was_offline: false };
            return Some(Gap::default());
        }
        let missing = stamp.sequence - stream.last - 1;
        stream.last = stamp.sequence;
        let told = missing.min(u64::from(stamp.skipped));
        let rest = missing - told;
        let (lost, offline) = if was_offline { (0, rest) } else { (rest, 0) };
        Some(Gap { lost, told, offline })
    }

    /// Our own session is down: what is missing next was not lost by anybody.
    pub fn went_offline(&mut self) {
        for stream in &mut self.streams {
            stream.was_offline = true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aldis_envelope::{Priority, ServiceId, Wall};

    fn stamp(boot: u64, sequence: u64, skipped: u32) -> Stamp {
        Stamp {
            node: EntityId::new(4).unwrap(),
            boot: BootId(boot),
            sequence,
            source_time: Wall(0),
            lifespan_left_ms: None,
            priority: Priority::Data,
            skipped,
            via: Default::default(),
        }
    }

    #[test]
    fn gaps_are_lost_told_or_missed_by_ourselves() {
        let source = Source::new(EntityId::new(4).unwrap(), ServiceId::NODE);
        let address = Address::new("a").unwrap();
        let mut inbound = Inbound::default();
        let place = inbound.place(&stamp(1, 5, 0), source, &address).unwrap();
        let gap = |lost, told, offline| Some(Gap { lost, told, offline });
        assert_eq!(inbound.accept(place, &stamp(1, 5, 0)), gap(0, 0, 0), "the first that one hears");
        assert_eq!(inbound.accept(place, &stamp(1, 5, 0)), None, "a duplicate");
        assert_eq!(inbound.accept(place, &stamp(1, 6, 0)), gap(0, 0, 0));
        assert_eq!(inbound.accept(place, &stamp(1, 9, 0)), gap(2, 0, 0));
        assert_eq!(inbound.accept(place, &stamp(1, 13, 2)), gap(1, 2, 0));
        inbound.went_offline();
        assert_eq!(inbound.accept(place, &stamp(1, 20, 1)), gap(0, 1, 5));
        assert_eq!(inbound.accept(place, &stamp(1, 22, 0)), gap(1, 0, 0), "offline explains one gap only");
        assert_eq!(inbound.accept(place, &stamp(2, 3, 0)), gap(0, 0, 0), "a new life");
        assert_eq!(inbound.accept(place, &stamp(1, 99, 0)), None, "the former life");
    }

    #[test]
    fn what_is_held_back_is_told_by_the_next() {
        let source = Source::new(EntityId::new(4).unwrap(), ServiceId::NODE);
        let mut outbound = Outbound::default();
        let place = outbound.place(source, &Address::new("a").unwrap());
        assert_eq!(outbound.place(source, &Address::new("a").unwrap()), place);
        assert_eq!(outbound.next(place), (1, 0));
        for told in 0..2 {
            let (_, skipped) = outbound.next(place);
            assert_eq!(skipped, told);
            outbound.held_back(place, skipped);
        }
        assert_eq!(outbound.next(place), (4, 2));
    }
}
