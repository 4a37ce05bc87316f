use super::*;
use crate::call::{CallId, Refusal, Role};
use crate::change::{Instance, KeyWidth};
use crate::id::{ServiceId, Source};
use crate::key::{Fleet, Keys, Space};
use crate::name::{Descriptor, Group, Name};
use crate::time::Wall;
use bytes::Bytes;
use proptest::prelude::*;
use serde::Serialize;
use std::sync::Arc;

/// The header as WIRE.md lists it, for postcard to write.
#[derive(Serialize)]
struct Twin<'a> {
    version: u8,
    spelling: TwinSpelling<'a>,
    content_type: TwinContentType<'a>,
    descriptor: Option<&'a str>,
    group: &'a str,
    node: u64,
    boot: u64,
    priority: u8,
    sequence: u64,
    source_time: i64,
    lifespan_left_ms: Option<u32>,
    skipped: u32,
    via: Vec<u64>,
    change: Change,
    key: Option<&'a [u8]>,
    call: Option<&'a Call>,
}

#[derive(Serialize)]
enum TwinSpelling<'a> {
    Dots,
    Colons,
    Exact(&'a str),
}

#[derive(Serialize)]
enum TwinContentType<'a> {
    Lmcp,
    Umaa,
    Cdr,
    Aldis,
    Other(&'a str),
}

fn postcard_writes(envelope: &Envelope) -> Vec<u8> {
    let Envelope { message, stamp } = envelope;
    let attributes = &message.label.attributes;
    let exact = match &message.label.address {
        Address::Name(name) => spelling(name.as_str()),
        _ => Spelling::Dots,
    };
    let twin = Twin {
        version: VERSION,
        spelling: match &exact {
            Spelling::Dots => TwinSpelling::Dots,
            Spelling::Colons => TwinSpelling::Colons,
            Spelling::Exact(text) => TwinSpelling::Exact(text),
        },
        content_type: match &attributes.content_type {
            ContentType::Lmcp => TwinContentType::Lmcp,
            ContentType::Umaa => TwinContentType::Umaa,
            ContentType::Cdr => TwinContentType::Cdr,
            ContentType::Aldis => TwinContentType::Aldis,
            ContentType::Other(name) => TwinContentType::Other(name.as_str()),
        },
        descriptor: (!message.label.is_broadcast()).then(|| attributes.descriptor.as_str()),
        group: attributes.source_group.as_str(),
        node: stamp.node.get(),
        boot: stamp.boot.0,
        priority: stamp.priority.into(),
        sequence: stamp.sequence,
        source_time: stamp.source_time.0,
        lifespan_left_ms: stamp.lifespan_left_ms,
        skipped: stamp.skipped,
        via: stamp.via.iter().map(|node| node.get()).collect(),
        change: message.change,
        key: key_on_the_wire(message),
        call: message.call.as_deref(),
    };
    postcard::to_allocvec(&twin).unwrap()
}

fn entity() -> impl Strategy<Value = EntityId> {
    (1..=EntityId::MAX).prop_map(|n| EntityId::new(n).unwrap())
}

prop_compose! {
    fn stamp()(
        node in entity(), boot in any::<u64>(), sequence in 1..u64::MAX, time in any::<i64>(),
        lifespan_left_ms in any::<Option<u32>>(), priority in 1u8..=7, skipped in any::<u32>(),
        via in proptest::collection::vec(entity(), 0..4),
    ) -> Stamp {
        Stamp {
            node, boot: BootId(boot), sequence, source_time: Wall(time), lifespan_left_ms,
            priority: Priority::try_from(priority).unwrap(), skipped, via: via.into_iter().collect(),
        }
    }
}

fn call() -> impl Strategy<Value = Option<Box<Call>>> {
    let role = prop_oneof![
        any::<u32>().prop_map(|time_left_ms| Role::Request { time_left_ms }),
        any::<bool>().prop_map(|last| Role::Reply { last }),
        "[a-z ]{0,9}".prop_map(|why| Role::Refused { reason: Refusal::NotAllowed(why) }),
    ];
    proptest::option::of((any::<u64>(), role).prop_map(|(id, role)| Box::new(Call { id: CallId(id), role })))
}

fn label() -> impl Strategy<Value = Label> {
    let address = prop_oneof!["[a-c.:é%]{1,9}", Just("eid7sid9".to_owned()), Just("eid7".to_owned())]
        .prop_filter_map("an address", |text| Address::new(&text).ok());
    let content_type = prop_oneof![Just("lmcp"), Just("umaa"), Just("json")];
    (address, content_type, "[a-c.]{1,5}", "[a-z]{0,3}", any::<bool>()).prop_map(
        |(address, content_type, descriptor, group, broadcast)| {
            let source = Source::new(EntityId::new(400).unwrap(), ServiceId::new(37).unwrap());
            let content_type = ContentType::new(content_type).unwrap();
            let mut label = match &address {
                Address::Name(name) if broadcast => Label::broadcast(content_type, name.clone(), source),
                _ => Label::limitedcast(address, content_type, Descriptor::new(&descriptor).unwrap(), source),
            };
            label.attributes.source_group = Group::new(&group).unwrap();
            label
        },
    )
}

fn envelope() -> impl Strategy<Value = Envelope> {
    let key = proptest::option::of(proptest::collection::vec(any::<u8>(), 0..40));
    (label(), stamp(), call(), key, 0..3usize, any::<bool>()).prop_map(
        |(label, stamp, call, key, change, wide)| {
            let width = if wide { KeyWidth::Wider } else { KeyWidth::Fits16 };
            // On a limitedcast the hash is rebuilt from the key by its length.
            let width = match &key {
                Some(key) if !label.is_broadcast() && key.len() <= 16 => KeyWidth::Fits16,
                _ => width,
            };
            let change = match key {
                Some(_) => [Change::Put, Change::Dispose, Change::Unregister][change],
                None => Change::Put,
            };
            let instance = key.map(|key| {
                let mut instance = Instance::of_key(key.into(), width);
                if change == Change::Put && label.is_broadcast() {
                    instance.key = None;
                }
                Arc::new(instance)
            });
            let content = Bytes::from_static(b"content");
            Envelope { message: Message { label: Arc::new(label), change, instance, call, content }, stamp }
        },
    )
}

fn keys() -> Keys {
    Keys::new(&Fleet::new("blue").unwrap())
}

fn key_of(envelope: &Envelope) -> (String, bool) {
    let message = &envelope.message;
    let space = if message.change == Change::Unregister { Space::Writer } else { Space::Data };
    (keys().envelope(space, &message.label, message.instance.as_deref()), message.change == Change::Dispose)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn the_header_is_what_postcard_writes_and_reads_back(envelope in envelope()) {
        let mut header = Vec::new();
        encode(&envelope, &mut header);
        prop_assert_eq!(&header, &postcard_writes(&envelope));
        let (key, deleted) = key_of(&envelope);
        let mut decoder = Decoder::new(keys());
        for _ in 0..2 {
            let read = decoder.decode(&key, deleted, &header, envelope.message.content.clone());
            prop_assert_eq!(read.as_ref(), Ok(&envelope));
        }
    }

    #[test]
    fn a_damaged_header_is_an_error_or_another_envelope(
        envelope in envelope(), at in any::<prop::sample::Index>(), byte in any::<u8>(), cut in any::<prop::sample::Index>(),
    ) {
        let mut header = Vec::new();
        encode(&envelope, &mut header);
        let (key, deleted) = key_of(&envelope);
        let mut decoder = Decoder::new(keys());
        let cut = cut.index(header.len());
        prop_assert!(decoder.decode(&key, deleted, &header[..cut], Bytes::new()).is_err());
        let at = at.index(header.len());
        header[at] = byte;
        let _ = decoder.decode(&key, deleted, &header, Bytes::new());
    }
}

#[test]
fn what_is_not_ours_is_told_by_name() {
    let mut decoder = Decoder::new(keys());
    let key = "aldis/blue/400/37/-/a";
    let mut decode = |key: &str, deleted: bool, header: &[u8]| {
        decoder.decode(key, deleted, header, Bytes::new()).unwrap_err().to_string()
    };
    assert_eq!(decode(key, false, &[]), "the sample has no header");
    assert!(decode(key, false, &[9]).starts_with("header version 9 is not 1"));
    let label = Label::broadcast(ContentType::Lmcp, Name::new("a").unwrap(), {
        Source::new(EntityId::new(400).unwrap(), ServiceId::new(37).unwrap())
    });
    let mut header = Vec::new();
    encode_constant(&label, EntityId::new(400).unwrap(), BootId(7), Priority::Data, &mut header);
    header.extend([1, 0, 0, 0, 0, 0, 0, 0]);
    assert!(decode(key, true, &header).contains("Put came as a delete"));
    assert!(decode("aldis/blue/@writer/400/37/-/a", false, &header).contains("Put came as a put in Writer"));
    assert!(decode("aldis/red/400/37/-/a", false, &header).contains("not of this fleet"));
    header.push(0);
    assert_eq!(decode(key, false, &header), "1 bytes follow the end of the header");
}
