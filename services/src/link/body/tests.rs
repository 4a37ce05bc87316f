use super::*;
use aldis_envelope::{Call, CallId, Role};
use proptest::prelude::*;

pub(in super::super) fn envelope(sequence: u64, content: &'static [u8]) -> Envelope {
    let source = Source::new(EntityId::new(400).unwrap(), ServiceId::new(7).unwrap());
    let name = Name::new("UMAA::MM::Example").unwrap();
    let label = Arc::new(Label::broadcast(ContentType::Umaa, name, source));
    let stamp = Stamp {
        node: EntityId::new(400).unwrap(),
        boot: BootId(3),
        sequence,
        source_time: Wall(1_795_305_600_000_000_000),
        lifespan_left_ms: None,
        priority: Priority::Data,
        skipped: 0,
        via: Default::default(),
    };
    Envelope { message: Message::new(label, Bytes::from_static(content)), stamp }
}

fn some_envelope() -> impl Strategy<Value = Envelope> {
    let instance = prop_oneof![
        Just(None),
        prop::collection::vec(any::<u8>(), 0..40)
            .prop_map(|key| Some(Instance::of_key(key.into(), KeyWidth::Wider))),
        prop::collection::vec(any::<u8>(), 0..16)
            .prop_map(|key| Some(Instance::of_key(key.into(), KeyWidth::Fits16))),
        any::<[u8; 16]>().prop_map(|hash| Some(Instance { hash: KeyHash(hash), key: None })),
    ];
    let head = (1u64.., any::<i32>(), any::<u32>(), 0usize..VIA_MAX, any::<bool>());
    (head, instance, prop::option::of(any::<u64>()), prop::collection::vec(any::<u8>(), 0..99)).prop_map(
        |((sequence, time, skipped, via, limited), instance, call, content)| {
            let mut envelope = envelope(sequence, b"");
            envelope.stamp.source_time = Wall(i64::from(time) * 1_000);
            envelope.stamp.skipped = skipped;
            envelope.stamp.via = (1..=via as u64).map(|n| EntityId::new(n).unwrap()).collect();
            envelope.message.content = content.into();
            if limited {
                let label = (*envelope.message.label).clone();
                envelope.message.label =
                    Arc::new(Label { address: Address::new("eid9sid8").unwrap(), ..label });
            }
            if let Some(instance) = instance {
                envelope.message = envelope.message.of_instance(instance);
                envelope.message.change = Change::Dispose;
            }
            let role = Role::Reply { last: true };
            envelope.message.call = call.map(|id| Box::new(Call { id: CallId(id), role }));
            envelope
        },
    )
}

proptest! {
    #[test]
    fn what_explains_itself_comes_back(envelope in some_envelope()) {
        let mut bytes = Vec::new();
        write_whole(&envelope, &mut bytes);
        prop_assert_eq!(read_whole(&bytes), Ok(envelope));
    }

    #[test]
    fn no_bytes_are_too_strange(bytes: Vec<u8>) {
        let _ = read_whole(&bytes);
    }

    #[test]
    fn a_message_cut_short_is_refused_or_shorter(envelope in some_envelope(), cut: prop::sample::Index) {
        let mut bytes = Vec::new();
        write_whole(&envelope, &mut bytes);
        let cut = cut.index(bytes.len());
        if let Ok(read) = read_whole(&bytes[..cut]) {
            prop_assert!(read.message.content.len() < envelope.message.content.len());
        }
    }
}
