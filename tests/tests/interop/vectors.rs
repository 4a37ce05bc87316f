//! Headers and keys that Rust writes and Python reads by WIRE.md, and the other way round: byte by byte, field by field.

use super::harness::{FLEET, lines_of};
use aldis_envelope::codec::native::{Decoder, encode};
use aldis_envelope::{
    Address, BootId, Call, CallId, Change, ContentType, Descriptor, EntityId, Envelope, Fleet, Group,
    Instance, KeyWidth, Keys, Label, Message, Name, Prefix, Priority, Refusal, Role, ServiceId, Source,
    Space, Stamp, Wall,
};
use aldis_tests::python;
use bytes::Bytes;
use fastrand::Rng;
use serde_json::{Value, json};
use std::sync::Arc;

const COUNT: usize = 3_000;
const CONTENT: &str = "content";
const PIECES: [&str; 20] = [
    ".", "::", ":", "eid", "sid", "a", "B", "7", "_", "-", "@", "*", "/", "%", "é", "?", "#", " ", "海",
    "c.d",
];

fn keys() -> Keys {
    Keys::new(&Fleet::new(FLEET).expect("a fleet"))
}

#[test]
fn python_reads_what_rust_writes() {
    let Some(python) = python::plain() else { return };
    let mut draw = Rng::with_seed(1);
    let vectors: Vec<_> = (0..COUNT).map(|_| written(&envelope(&mut draw))).collect();
    let input: String = vectors.iter().map(|vector| format!("{vector}\n")).collect();
    let read = lines_of(&python, "vectors.py", &["read", FLEET], input);
    assert_eq!(read.len(), COUNT);
    for (read, written) in read.iter().zip(&vectors) {
        assert_eq!(read, written);
    }
}

#[test]
fn rust_reads_what_python_writes() {
    let Some(python) = python::plain() else { return };
    let count = COUNT.to_string();
    let vectors = lines_of(&python, "vectors.py", &["write", FLEET, "2", &count], String::new());
    assert_eq!(vectors.len(), COUNT);
    let mut decoder = Decoder::new(keys());
    for vector in &vectors {
        let text = |field: &str| vector[field].as_str().expect("a text");
        let deleted = vector["deleted"] == true;
        let content = Bytes::from_static(CONTENT.as_bytes());
        let read = decoder.decode(text("key"), deleted, &unhex(text("header")), content);
        let mut read = read.unwrap_or_else(|why| panic!("{why}: {vector}"));
        if read.message.change == Change::Put && read.message.label.is_broadcast() {
            assert_eq!(read.message.instance.as_ref().and_then(|instance| instance.key.as_ref()), None);
        }
        read.message.content = Bytes::from_static(CONTENT.as_bytes());
        assert_eq!(&written(&read), vector);
    }
}

#[test]
fn python_subscribes_as_rust_does() {
    let Some(python) = python::plain() else { return };
    let mut draw = Rng::with_seed(3);
    let mut pairs = Vec::new();
    while pairs.len() < COUNT {
        let to = address(&mut draw);
        let whole = if draw.bool() { to.to_string() } else { address(&mut draw).to_string() };
        let cut: String = whole.chars().take(draw.usize(0..10)).collect();
        // What is half an id is no prefix.
        let Ok(prefix) = Prefix::new(&cut) else { continue };
        pairs.push((prefix, to));
    }
    let line = |(prefix, to): &(Prefix, Address)| format!("{}\n", json!({ "prefix": prefix, "address": to }));
    let read = lines_of(&python, "vectors.py", &["read", FLEET], pairs.iter().map(line).collect());
    assert_eq!(read.len(), COUNT);
    assert!(read.iter().filter(|line| line[1] == true).count() > COUNT / 10);
    for (read, (prefix, to)) in read.iter().zip(&pairs) {
        let expected = json!([keys().subscription(Space::Data, prefix), prefix.matches(to)]);
        assert_eq!(*read, expected, "{prefix:?} {to}");
    }
}

/// The header that WIRE.md shows byte by byte is the one that the format gives.
#[test]
fn the_annotated_header_is_true() {
    let page = include_str!("../../../envelope/WIRE.md");
    let (_, shown) = page.split_once("01                                  version 1").expect("the header");
    let (shown, _) = shown.split_once("```").expect("its end");
    let hex = |line: &str| line.get(..36).unwrap_or_default().replace(' ', "");
    let header = unhex(&format!("01{}", shown.lines().map(hex).collect::<String>()));
    let key = "aldis/blue/1/100/-/eid400/sid37";
    assert!(page.contains(key));
    let keys = Keys::new(&Fleet::new("blue").expect("a fleet"));
    let read = Decoder::new(keys).decode(key, false, &header, Bytes::new()).expect("an envelope");
    let call = Call { id: CallId(7), role: Role::Request { time_left_ms: 2000 } };
    assert_eq!(read.message.call.as_deref(), Some(&call));
    assert_eq!((read.stamp.boot, read.stamp.sequence), (BootId(12), 300));
    assert_eq!(read.stamp.source_time, Wall(1_795_309_868_120_000_000));
    assert_eq!(read.message.label.descriptor(), aldis_envelope::aldis::PING);
    let mut again = Vec::new();
    encode(&read, &mut again);
    assert_eq!(again, header);
}

/// An envelope on the wire and its fields, as `vectors.py` writes them too.
fn written(envelope: &Envelope) -> Value {
    let Envelope { message, stamp } = envelope;
    let space = if message.change == Change::Unregister { Space::Writer } else { Space::Data };
    let key = keys().envelope(space, &message.label, message.instance.as_deref());
    let mut header = Vec::new();
    encode(envelope, &mut header);
    let attributes = &message.label.attributes;
    let by_content = message.change == Change::Put && message.label.is_broadcast();
    let serialized = message.instance.as_ref().and_then(|instance| instance.key.as_ref());
    let change = match message.change {
        Change::Put => "put",
        Change::Dispose => "dispose",
        Change::Unregister => "unregister",
    };
    json!({
        "key": key,
        "header": hex(&header),
        "deleted": message.change == Change::Dispose,
        "fields": {
            "source": [attributes.source.entity, attributes.source.service],
            "address": message.label.address,
            "content_type": attributes.content_type,
            "descriptor": attributes.descriptor,
            "source_group": attributes.source_group,
            "node": stamp.node,
            "boot": stamp.boot,
            "priority": stamp.priority,
            "sequence": stamp.sequence,
            "source_time": stamp.source_time,
            "lifespan_left_ms": stamp.lifespan_left_ms,
            "skipped": stamp.skipped,
            "via": stamp.via.to_vec(),
            "change": change,
            "instance": keys().parse(&key).expect("an own key").instance.map(|hash| hash.to_string()),
            "key": serialized.filter(|_| !by_content).map(|key| hex(key)),
            "call": message.call.as_deref().map(call_fields),
            "content": std::str::from_utf8(&message.content).expect("UTF-8"),
        },
    })
}

fn call_fields(call: &Call) -> Value {
    let mut fields = json!({ "id": call.id, "role": "request", "time_left_ms": 0, "last": true, "reason": "", "text": "" });
    let (role, field, value) = match &call.role {
        Role::Request { time_left_ms } => ("request", "time_left_ms", json!(time_left_ms)),
        Role::Reply { last } => ("reply", "last", json!(last)),
        Role::Refused { reason } => {
            let (name, text) = match reason {
                Refusal::NobodyThere => ("nobody there", ""),
                Refusal::NoAnswer => ("no answer", ""),
                Refusal::NotAllowed(why) => ("not allowed", why.as_str()),
                Refusal::NotUnderstood(why) => ("not understood", why.as_str()),
                Refusal::Failed(why) => ("failed", why.as_str()),
                Refusal::Overloaded(why) => ("overloaded", why.as_str()),
            };
            fields["text"] = text.into();
            ("refused", "reason", json!(name))
        }
    };
    fields["role"] = role.into();
    fields[field] = value;
    fields
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn unhex(text: &str) -> Vec<u8> {
    let digit = |at: usize| u8::from_str_radix(&text[at..at + 2], 16).expect("hexadecimal digits");
    (0..text.len()).step_by(2).map(digit).collect()
}

/// A number of any size, small ones as often as large ones.
fn number(draw: &mut Rng, bits: u32) -> u64 {
    draw.u64(..) >> (64 - draw.u32(1..=bits))
}

fn entity(draw: &mut Rng) -> EntityId {
    EntityId::new(number(draw, 48).max(1)).expect("an entity")
}

fn source(draw: &mut Rng) -> Source {
    Source::new(entity(draw), ServiceId::new(number(draw, 32).max(1)).expect("a service"))
}

fn name(draw: &mut Rng) -> Name {
    loop {
        let text: String = (0..draw.usize(1..9)).map(|_| PIECES[draw.usize(..PIECES.len())]).collect();
        if let Ok(name) = Name::new(&text) {
            return name;
        }
    }
}

fn address(draw: &mut Rng) -> Address {
    match draw.u8(..6) {
        0 => Address::Service(source(draw)),
        1 => Address::EntityServices(entity(draw)),
        2 => Address::Entity(entity(draw)),
        _ => Address::Name(name(draw)),
    }
}

fn call(draw: &mut Rng) -> Call {
    let text = name(draw).to_string();
    let role = match draw.u8(..8) {
        0 => Role::Request { time_left_ms: number(draw, 32) as u32 },
        1 => Role::Reply { last: draw.bool() },
        2 => Role::Refused { reason: Refusal::NobodyThere },
        3 => Role::Refused { reason: Refusal::NoAnswer },
        4 => Role::Refused { reason: Refusal::NotAllowed(text) },
        5 => Role::Refused { reason: Refusal::NotUnderstood(text) },
        6 => Role::Refused { reason: Refusal::Failed(text) },
        _ => Role::Refused { reason: Refusal::Overloaded(text) },
    };
    Call { id: CallId(number(draw, 64)), role }
}

fn envelope(draw: &mut Rng) -> Envelope {
    let content_type = match draw.u8(..5) {
        0 => ContentType::Lmcp,
        1 => ContentType::Umaa,
        2 => ContentType::Cdr,
        3 => ContentType::Aldis,
        _ => ContentType::Other(name(draw)),
    };
    let mut label = match address(draw) {
        Address::Name(to) if draw.bool() => Label::broadcast(content_type, to, source(draw)),
        to => Label::limitedcast(to, content_type, Descriptor::from(name(draw)), source(draw)),
    };
    if draw.bool() {
        label.attributes.source_group = Group::new(name(draw).as_str()).expect("a group");
    }
    let change = [Change::Put, Change::Dispose, Change::Unregister][draw.usize(..3)];
    let instance = (change != Change::Put || draw.bool()).then(|| {
        let bytes: Vec<_> = (0..[0, 4, 16, 17, 40][draw.usize(..5)]).map(|_| draw.u8(..)).collect();
        let width = if draw.bool() { KeyWidth::Fits16 } else { KeyWidth::Wider };
        Arc::new(Instance::of_key(bytes.into(), width))
    });
    let call = (draw.u8(..3) == 0).then(|| Box::new(call(draw)));
    let content = Bytes::from_static(CONTENT.as_bytes());
    let message = Message { label: Arc::new(label), change, instance, call, content };
    let stamp = Stamp {
        node: entity(draw),
        boot: BootId(number(draw, 64)),
        sequence: number(draw, 64).max(1),
        source_time: Wall(number(draw, 64) as i64),
        lifespan_left_ms: draw.bool().then(|| number(draw, 32) as u32),
        priority: Priority::try_from(draw.u8(1..=7)).expect("a priority"),
        skipped: number(draw, 32) as u32,
        via: (0..[0, 0, 1, 16][draw.usize(..4)]).map(|_| entity(draw)).collect(),
    };
    Envelope { message, stamp }
}
