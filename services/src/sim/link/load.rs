//! What is sent in the measurements, and how results are counted.

use aldis_envelope::{
    Address, BootId, ContentType, EntityId, Envelope, Instance, Label, Message, Name, Priority, ServiceId,
    Source, Stamp, Wall,
};
use std::sync::Arc;
use std::time::Duration;

/// An entity of the measurements. Numbers here are never 0.
pub(super) fn entity(number: u64) -> EntityId {
    EntityId::new(number.max(1)).unwrap_or_else(|_| unreachable!("the number is in range"))
}

fn source(node: u64) -> Source {
    Source::new(entity(node), ServiceId::LOG)
}

fn name(text: &str) -> Name {
    Name::new(text).unwrap_or_else(|_| unreachable!("a name of this file"))
}

fn stamp(node: u64, sequence: u64, at: Duration, lifespan: Option<Duration>) -> Stamp {
    Stamp {
        node: entity(node),
        boot: BootId(1),
        sequence,
        source_time: Wall(1_795_305_600_000_000_000 + at.as_nanos() as i64),
        lifespan_left_ms: lifespan.map(|lifespan| lifespan.as_millis() as u32),
        priority: Priority::Data,
        skipped: 0,
        via: Default::default(),
    }
}

/// A command of 64 bytes from a node to a service of an entity, the `number`th of its stream.
pub(super) fn command(from: u64, to: u64, number: u64, at: Duration, lifespan: Duration) -> Envelope {
    command_of(64, (from, to), number, at, lifespan)
}

/// The same with so many bytes, at least 16, from one node to another.
pub(super) fn command_of(
    bytes: usize,
    (from, to): (u64, u64),
    number: u64,
    at: Duration,
    lifespan: Duration,
) -> Envelope {
    let mut content = vec![0x5a; bytes.max(16)];
    content[..8].copy_from_slice(&from.to_be_bytes());
    content[8..16].copy_from_slice(&number.to_be_bytes());
    let address = Address::Service(Source::new(entity(to), ServiceId::HEALTH));
    let content_type = ContentType::Umaa;
    let label = Label::limitedcast(address, content_type, name("UMAA::Bench::Command").into(), source(from));
    let message = Message::new(Arc::new(label), content.into());
    Envelope { message, stamp: stamp(from, number, at, Some(lifespan)) }
}

/// Who sent a command, and its number.
pub(super) fn command_number(content: &[u8]) -> (u64, u64) {
    let number = |bytes: &[u8]| bytes.iter().fold(0, |n, b| n << 8 | u64::from(*b));
    (number(&content[..8]), number(&content[8..16]))
}

/// A sample of an instance, with at least 8 bytes.
pub(super) fn state(node: u64, instance: i64, sequence: u64, at: Duration, bytes: usize) -> Envelope {
    let label = Label::broadcast(ContentType::Umaa, name("UMAA::Bench::State"), source(node));
    let mut content = vec![0xa5; bytes.max(8)];
    content[..8].copy_from_slice(&sequence.to_be_bytes());
    let message = Message::new(Arc::new(label), content.into()).of_instance(Instance::of_number(instance));
    Envelope { message, stamp: stamp(node, sequence, at, None) }
}

/// A large message.
pub(super) fn bulk(node: u64, sequence: u64, at: Duration, bytes: usize) -> Envelope {
    let label = Label::broadcast(ContentType::Umaa, name("UMAA::Bench::Recording"), source(node));
    // No two messages have the same content.
    let content: Vec<u8> = (0..bytes as u64).map(|n| (n * 31 + sequence * 7 + n / 251) as u8).collect();
    Envelope {
        message: Message::new(Arc::new(label), content.into()),
        stamp: stamp(node, sequence, at, None),
    }
}

/// The value below which a part of the values lies, 0 where there are none. Sorts them.
pub(super) fn percentile(values: &mut [f64], part: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let place = (values.len() as f64 * part).ceil() as usize;
    values.get(place.saturating_sub(1)).copied().unwrap_or(0.0)
}

pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_values() {
        let mut values: Vec<_> = (1..=1_000).rev().map(f64::from).collect();
        assert_eq!([0.5, 0.99, 0.999].map(|part| percentile(&mut values, part)), [500.0, 990.0, 999.0]);
        assert_eq!((percentile(&mut [], 0.5), mean(&[1.0, 3.0])), (0.0, 2.0));
    }

    #[test]
    fn commands_tell_their_number() {
        let envelope = command(9, 400, 77, Duration::ZERO, Duration::from_secs(1));
        assert_eq!(command_number(&envelope.message.content), (9, 77));
        assert_eq!(envelope.message.content.len(), 64);
    }
}
