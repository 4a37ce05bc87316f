//! Sound inputs: objects of all types in each form, headers, frames.

use crate::samples::{self, Described};
use aldis_envelope::codec::cdr::Schema;
use aldis_envelope::codec::{native, stream, zmtp};
use aldis_envelope::description::DescriptionError;
use aldis_envelope::lmcp::{Kind, Object, Slot, TypeInfo, descendants, encode, to_json, to_xml, types};
use aldis_envelope::umaa::{v5_2_1, v6_0};
use aldis_envelope::{
    Address, BootId, Call, CallId, ContentType, Descriptor, Dialect, EntityId, Envelope, Label, Message,
    Priority, Role, ServiceId, Source, Stamp, Wall,
};
use bytes::Bytes;
use fastrand::Rng;
use std::error::Error;
use std::sync::Arc;

/// Objects of each type: one with defaults, others with anything.
const OBJECTS: usize = 6;
/// How long the longest array is.
const ELEMENTS_MAX: usize = 120;

/// How long the longest text is: longer ones cost time and hold nothing new.
const TEXT_MAX: usize = 4 * 1024;

/// Sound inputs by decoder.
#[derive(Default)]
pub(crate) struct Corpus {
    pub(crate) lmcp: Vec<Vec<u8>>,
    pub(crate) json: Vec<Vec<u8>>,
    pub(crate) xml: Vec<Vec<u8>>,
    pub(crate) headers: Vec<Vec<u8>>,
    pub(crate) delimited: Vec<Vec<u8>>,
    pub(crate) frames: Vec<Vec<u8>>,
    /// What a peer that pushes sends, and what one that subscribes sends.
    pub(crate) zmtp: Vec<Vec<u8>>,
    pub(crate) cdr: Vec<Vec<u8>>,
    pub(crate) idl: Vec<Vec<u8>>,
}

impl Corpus {
    pub(crate) fn new(seed: u64) -> Result<Self, Box<dyn Error>> {
        let mut random = Rng::with_seed(seed);
        let mut corpus = Self::default();
        for info in types() {
            for round in 0..OBJECTS {
                let object =
                    if round == 0 { (info.default)() } else { object(&mut random, info, 3, round == 1) };
                corpus.lmcp.push(encode(object.as_ref())?);
                let texts = [to_json(object.as_ref()).to_string(), to_xml(object.as_ref())?];
                if texts.iter().all(|text| text.len() < TEXT_MAX) {
                    let [json, xml] = texts.map(String::into_bytes);
                    corpus.json.push(json);
                    corpus.xml.push(xml);
                }
            }
        }
        for (place, content) in corpus.lmcp.iter().enumerate() {
            let envelope = envelope(&mut random, place, content)?;
            let mut header = Vec::new();
            native::encode(&envelope, &mut header);
            corpus.headers.push(header);
            let mut message = Vec::new();
            let label = &envelope.message.label;
            aldis_envelope::codec::delimited::write_head(label, dialect(&mut random), &mut message);
            message.extend_from_slice(content);
            corpus.delimited.push(message);
            let mut frames = Vec::new();
            for _ in 0..random.usize(1..4) {
                stream::Writer::new(dialect(&mut random)).write(label, content, &mut frames);
            }
            corpus.frames.push(frames);
            corpus.zmtp.push(connection(&mut random, label, content));
        }
        corpus.cdr = samples::samples(&mut random, &schemas()?)?;
        corpus.idl = vec![samples::IDL.as_bytes().to_vec()];
        Ok(corpus)
    }
}

/// All that one end of a ZeroMQ connection says: a PUSH that sends messages, or a SUB that subscribes.
fn connection(random: &mut Rng, label: &Arc<Label>, content: &[u8]) -> Vec<u8> {
    let mut said = zmtp::GREETING.to_vec();
    if random.u8(..8) == 0 {
        said.extend(zmtp::ready(zmtp::SocketType::Sub));
        (0..random.usize(1..4)).for_each(|_| said.extend(zmtp::subscription(label.descriptor().as_bytes())));
        return said;
    }
    said.extend(zmtp::ready(zmtp::SocketType::Push));
    let framing = if random.bool() { zmtp::Framing::Single } else { zmtp::Framing::Multipart };
    let mut writer = zmtp::Writer::new(framing, dialect(random));
    for _ in 0..random.usize(1..4) {
        writer.write(label, content, None, &mut said);
    }
    said
}

/// Every topic of Support Operations in both versions, appendable and final.
pub(crate) fn schemas() -> Result<Vec<Described>, Box<dyn Error>> {
    let unsound = |errors: Vec<DescriptionError>| format!("{errors:?}");
    let versions = [
        (v5_2_1::library().map_err(unsound)?, v5_2_1::described_topics()),
        (v6_0::library().map_err(unsound)?, v6_0::topics()),
    ];
    let mut schemas = Vec::new();
    for (library, topics) in &versions {
        for topic in topics {
            let schema = Schema::new(library, &topic.type_name)?;
            schemas.extend([schema.as_final(), schema].map(|schema| (library.clone(), schema)));
        }
    }
    Ok(schemas)
}

fn dialect(random: &mut Rng) -> Dialect {
    if random.bool() { Dialect::OpenUxas } else { Dialect::Slides }
}

/// An envelope with that content, broadcast, to a service or a call.
fn envelope(random: &mut Rng, place: usize, content: &[u8]) -> Result<Envelope, Box<dyn Error>> {
    let source = Source::new(EntityId::new(random.u64(1..9000))?, ServiceId::new(random.u64(1..200))?);
    let descriptor = types().nth(place % 164).map_or("a", |info| info.full_name);
    let address = Address::new(["a.B", "eid400sid37", "eid400", "AircraftPathPlanner"][place % 4])?;
    let label = Label::limitedcast(address, ContentType::Lmcp, Descriptor::new(descriptor)?, source);
    let mut message = Message::new(Arc::new(label), Bytes::copy_from_slice(content));
    if random.bool() {
        let role = Role::Request { time_left_ms: random.u32(..) };
        message.call = Some(Box::new(Call { id: CallId(random.u64(..)), role }));
    }
    let stamp = Stamp {
        node: source.entity,
        boot: BootId(random.u64(..)),
        sequence: random.u64(1..),
        source_time: Wall(random.i64(..)),
        lifespan_left_ms: random.bool().then(|| random.u32(..)),
        priority: Priority::Data,
        skipped: random.u32(..10),
        via: (1..random.u64(1..4)).map(EntityId::new).collect::<Result<_, _>>()?,
    };
    Ok(Envelope { message, stamp })
}

/// An object of the type or of one that descends from it, with anything in its fields.
fn object(random: &mut Rng, info: &'static TypeInfo, depth: usize, long: bool) -> Box<dyn Object> {
    let mut object = (info.default)();
    for field in info.fields() {
        if let Some(slot) = object.slot(field.name) {
            fill(random, slot, &field.kind, depth, long);
        }
    }
    object
}

fn fill(random: &mut Rng, slot: Slot<'_>, kind: &Kind, depth: usize, long: bool) {
    match slot {
        Slot::Bool(value) => *value = random.bool(),
        Slot::Byte(value) => *value = random.u8(..),
        Slot::Int32(value) => *value = random.i32(..),
        Slot::UInt32(value) => *value = random.u32(..),
        Slot::Int64(value) => *value = random.i64(..) >> random.u32(..64),
        Slot::Real32(value) => *value = random.f32() * 360.0 - 180.0,
        Slot::Real64(value) => *value = random.f64() * 360.0 - 180.0,
        Slot::Enum(value, info) => *value = info.values[random.usize(..info.values.len())].1,
        Slot::Text(value) => {
            *value = (0..random.usize(..40)).map(|_| random.char('a'..='é')).collect();
        }
        Slot::Object(reference) => match kind {
            Kind::Object(declared) if depth > 0 && random.u8(..8) > 0 => {
                let held: Vec<_> = descendants(declared).collect();
                let info = held[random.usize(..held.len())];
                // An object that the field does not hold would stay out, and the field as it was.
                let _ = reference.put(object(random, info, depth - 1, false));
            }
            _ => reference.clear(),
        },
        Slot::List(list) => {
            let Kind::List(element, _) = kind else { return };
            let length = if long { random.usize(..ELEMENTS_MAX) } else { random.usize(..4) };
            list.truncate(0);
            for index in 0..length.max(list.length()) {
                let Some(place) = list.place(index) else { break };
                fill(random, place, element, depth, false);
            }
        }
    }
}
