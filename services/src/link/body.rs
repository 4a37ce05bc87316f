//! A message as it travels in a frame: its label, its origin and all that differs from message to message.

use super::wire::{Malformed, Reader, put_run, put_varint, put_zigzag};
use aldis_envelope::stamp::{VIA_MAX, Via};
use aldis_envelope::{
    Address, Attributes, BootId, Change, ContentType, Descriptor, EntityId, Envelope, Group, Instance,
    KeyHash, KeyWidth, Label, Message, Name, Priority, ServiceId, Source, Stamp, Wall,
};
use bytes::Bytes;
use std::sync::Arc;

/// What the messages of a stream have in common, as both ends keep it under a number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct LabelEntry {
    pub(super) label: Arc<Label>,
    pub(super) priority: Priority,
    /// The microsecond from which source times are counted.
    pub(super) base: i64,
}

/// Who stamped a message and which way it came.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Origin {
    pub(super) node: EntityId,
    pub(super) boot: BootId,
    pub(super) via: Via,
}

/// Source times travel in whole microseconds.
pub(super) fn microseconds(time: Wall) -> i64 {
    time.0.div_euclid(1_000)
}

fn wall(microseconds: i64) -> Wall {
    Wall(microseconds.saturating_mul(1_000))
}

impl LabelEntry {
    pub(super) fn write(&self, out: &mut Vec<u8>) {
        let Attributes { content_type, descriptor, source_group, source } = &self.label.attributes;
        out.push(self.priority.into());
        put_zigzag(self.base, out);
        put_varint(source.entity.get(), out);
        put_varint(source.service.get().into(), out);
        put_run(content_type.as_str().as_bytes(), out);
        put_run(descriptor.as_str().as_bytes(), out);
        put_run(source_group.as_str().as_bytes(), out);
        match self.label.is_broadcast() {
            true => put_run(&[], out),
            false => put_run(self.label.address.to_string().as_bytes(), out),
        }
    }

    pub(super) fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        let bad = reader.malformed();
        let priority = Priority::try_from(reader.byte()?).map_err(|_| bad)?;
        let base = reader.zigzag()?;
        let entity = EntityId::new(reader.varint()?).map_err(|_| bad)?;
        let service = ServiceId::new(reader.varint()?).map_err(|_| bad)?;
        let content_type = ContentType::new(reader.text()?).map_err(|_| bad)?;
        let descriptor = Descriptor::new(reader.text()?).map_err(|_| bad)?;
        let source_group = Group::new(reader.text()?).map_err(|_| bad)?;
        let address = match reader.text()? {
            "" => Address::Name(Name::new(descriptor.as_str()).map_err(|_| bad)?),
            text => Address::new(text).map_err(|_| bad)?,
        };
        let source = Source::new(entity, service);
        let attributes = Attributes { content_type, descriptor, source_group, source };
        Ok(Self { label: Arc::new(Label { address, attributes }), priority, base })
    }
}

impl Origin {
    pub(super) fn of(stamp: &Stamp) -> Self {
        Self { node: stamp.node, boot: stamp.boot, via: stamp.via.clone() }
    }

    pub(super) fn write(&self, out: &mut Vec<u8>) {
        put_varint(self.node.get(), out);
        put_varint(self.boot.0, out);
        put_varint(self.via.len() as u64, out);
        for node in self.via.iter() {
            put_varint(node.get(), out);
        }
    }

    pub(super) fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        let bad = reader.malformed();
        let node = EntityId::new(reader.varint()?).map_err(|_| bad)?;
        let boot = BootId(reader.varint()?);
        let passed = reader.varint()?;
        if passed > VIA_MAX as u64 {
            return Err(bad);
        }
        let via = (0..passed).map(|_| EntityId::new(reader.varint()?).map_err(|_| bad));
        Ok(Self { node, boot, via: via.collect::<Result<_, _>>()? })
    }
}

/// Appends an instance, or that there is none.
pub(super) fn write_instance(instance: Option<&Instance>, out: &mut Vec<u8>) {
    let Some(instance) = instance else { return out.push(0) };
    let Some(key) = &instance.key else {
        out.push(1);
        return out.extend_from_slice(&instance.hash.0);
    };
    let of = |width| Instance::of_key(key.clone(), width).hash == instance.hash;
    match (of(KeyWidth::Fits16), of(KeyWidth::Wider)) {
        (true, _) => out.push(2),
        (_, true) => out.push(3),
        _ => {
            out.push(4);
            out.extend_from_slice(&instance.hash.0);
        }
    }
    put_run(key, out);
}

pub(super) fn read_instance(reader: &mut Reader<'_>) -> Result<Option<Instance>, Malformed> {
    let bad = reader.malformed();
    let hash = |reader: &mut Reader<'_>| Ok(KeyHash(reader.take(16)?.try_into().map_err(|_| bad)?));
    let key = |reader: &mut Reader<'_>| reader.run().map(Bytes::copy_from_slice);
    Ok(Some(match reader.byte()? {
        0 => return Ok(None),
        1 => Instance { hash: hash(reader)?, key: None },
        2 => Instance::of_key(key(reader)?, KeyWidth::Fits16),
        3 => Instance::of_key(key(reader)?, KeyWidth::Wider),
        4 => Instance { hash: hash(reader)?, key: Some(key(reader)?) },
        _ => return Err(bad),
    }))
}

pub(super) fn change_number(change: Change) -> u8 {
    match change {
        Change::Put => 0,
        Change::Dispose => 1,
        Change::Unregister => 2,
    }
}

pub(super) fn change_of(number: u8) -> Result<Change, Malformed> {
    match number {
        0 => Ok(Change::Put),
        1 => Ok(Change::Dispose),
        2 => Ok(Change::Unregister),
        _ => Err(Malformed("a change")),
    }
}

const CALL: u8 = 4;
const INSTANCE: u8 = 8;
const SKIPPED: u8 = 16;

/// Appends what differs from message to message; the content ends it.
pub(super) fn write_message(envelope: &Envelope, base: i64, out: &mut Vec<u8>) {
    let Envelope { message, stamp } = envelope;
    let flag = |set, flag| if set { flag } else { 0 };
    let flags = change_number(message.change)
        | flag(message.call.is_some(), CALL)
        | flag(message.instance.is_some(), INSTANCE)
        | flag(stamp.skipped > 0, SKIPPED);
    out.push(flags);
    put_varint(stamp.sequence, out);
    put_zigzag(microseconds(stamp.source_time).wrapping_sub(base), out);
    if stamp.skipped > 0 {
        put_varint(stamp.skipped.into(), out);
    }
    if message.instance.is_some() {
        write_instance(message.instance.as_deref(), out);
    }
    if let Some(call) = &message.call
        && let Ok(bytes) = postcard::to_allocvec(call)
    {
        out.extend_from_slice(&bytes);
    }
    out.extend_from_slice(&message.content);
}

/// Reads what [`write_message`] wrote. The lifespan is what is left of it on arrival.
pub(super) fn read_message(
    reader: &mut Reader<'_>,
    entry: &LabelEntry,
    origin: &Origin,
    lifespan_left_ms: Option<u32>,
) -> Result<Envelope, Malformed> {
    let flags = reader.byte()?;
    let change = change_of(flags & 3)?;
    let sequence = reader.varint()?;
    let source_time = wall(entry.base.wrapping_add(reader.zigzag()?));
    let skipped = if flags & SKIPPED != 0 { reader.varint_u32()? } else { 0 };
    let instance = if flags & INSTANCE != 0 { read_instance(reader)?.map(Arc::new) } else { None };
    let call = if flags & CALL != 0 { Some(Box::new(reader.value()?)) } else { None };
    if sequence == 0 || flags >= 32 || (change != Change::Put && instance.is_none()) {
        return Err(reader.malformed());
    }
    let content = Bytes::copy_from_slice(reader.rest());
    let message = Message { label: entry.label.clone(), change, instance, call, content };
    let stamp = stamp(entry, origin, sequence, source_time, skipped, lifespan_left_ms);
    Ok(Envelope { message, stamp })
}

fn stamp(
    entry: &LabelEntry,
    origin: &Origin,
    sequence: u64,
    source_time: Wall,
    skipped: u32,
    lifespan_left_ms: Option<u32>,
) -> Stamp {
    let Origin { node, boot, via } = origin.clone();
    Stamp { node, boot, sequence, source_time, lifespan_left_ms, priority: entry.priority, skipped, via }
}

/// A sample of an instance, put together from the tables and what came.
pub(super) fn sample(
    entry: &LabelEntry,
    origin: &Origin,
    instance: Option<Arc<Instance>>,
    what: (Change, u64, i64),
    lifespan_left_ms: Option<u32>,
    content: Bytes,
) -> Envelope {
    let (change, sequence, time) = what;
    let message = Message { label: entry.label.clone(), change, instance, call: None, content };
    Envelope { message, stamp: stamp(entry, origin, sequence, wall(time), 0, lifespan_left_ms) }
}

/// Appends a message that explains itself: for large ones, where the label is little beside the content.
pub(super) fn write_whole(envelope: &Envelope, out: &mut Vec<u8>) {
    let base = microseconds(envelope.stamp.source_time);
    let entry = LabelEntry { label: envelope.message.label.clone(), priority: envelope.stamp.priority, base };
    entry.write(out);
    Origin::of(&envelope.stamp).write(out);
    write_message(envelope, base, out);
}

pub(super) fn read_whole(bytes: &[u8]) -> Result<Envelope, Malformed> {
    let mut reader = Reader::new(bytes, "a large message");
    let entry = LabelEntry::read(&mut reader)?;
    let origin = Origin::read(&mut reader)?;
    read_message(&mut reader, &entry, &origin, None)
}

#[cfg(test)]
pub(super) mod tests;
