use super::*;
use crate::event::{BridgeId, PeerId};
use crate::journal::Operation;
use aldis_envelope::{ContentType, EntityId, Label, Message, Name, Now, ServiceId, Source};
use std::sync::Arc;

fn held(service: usize) -> Held {
    let source = Source::new(EntityId::new(1).unwrap(), ServiceId::new(5).unwrap());
    let label = Label::broadcast(ContentType::Umaa, Name::new("T").unwrap(), source);
    let message = Message::new(Arc::new(label), Bytes::new());
    Held::new(Now::default(), Work::new(Origin::Service(service), message))
}

fn value(bytes: usize) -> Bytes {
    vec![7; bytes].into()
}

fn origins(keeping: &mut Keeping) -> Vec<Origin> {
    std::iter::from_fn(|| keeping.next_kept()).map(|held| held.work.origin).collect()
}

#[test]
fn what_waits_behind_others_goes_when_they_go() {
    let mut keeping = Keeping::default();
    keeping.keep(held(1), value(10)).map_err(|_| ()).unwrap();
    keeping.hold(held(1));
    assert_eq!(keeping.take_batches(false).len(), 1);
    keeping.keep(held(2), value(10)).map_err(|_| ()).unwrap();
    assert_eq!(keeping.take_batches(false)[0].0, 2);
    assert!(keeping.holds(Origin::Service(1)) && !keeping.holds(Origin::Peer(BridgeId(0), PeerId(1))));
    assert!(keeping.next_kept().is_none());
    keeping.written(1);
    assert_eq!(origins(&mut keeping), [Origin::Service(1), Origin::Service(1)]);
    assert!(!keeping.holds(Origin::Service(1)) && keeping.is_waiting());
    keeping.written(2);
    assert_eq!(origins(&mut keeping), [Origin::Service(2)]);
    assert_eq!(keeping.bytes, 0);
}

#[test]
fn what_is_refused_waits_no_longer_and_what_was_to_be_forgotten_is_forgotten_later() {
    let mut keeping = Keeping { forgotten: vec![3, 4], ..Keeping::default() };
    keeping.keep(held(1), value(10)).map_err(|_| ()).unwrap();
    keeping.hold(held(1));
    let batches = keeping.take_batches(false);
    assert_eq!(batches[0].1.operations().len(), 3, "they go along");
    assert_eq!(keeping.refused(1, 1).len(), 1);
    assert_eq!(origins(&mut keeping), [Origin::Service(1)], "what waited behind it goes");
    assert_eq!(keeping.forgotten, [3, 4]);
    assert!(!keeping.has_batches(), "alone they are not worth a sync");
    keeping.keep(held(1), value(10)).map_err(|_| ()).unwrap();
    let batches = keeping.take_batches(false);
    let kinds: Vec<_> =
        batches.iter().map(|(_, b)| matches!(b.operations()[0], Operation::Forget { .. })).collect();
    assert_eq!((batches.len(), kinds.contains(&true)), (2, true), "by themselves: they free space");
    assert_eq!(keeping.bytes, batches.iter().map(|(_, batch)| batch.encoded_bytes()).sum::<usize>());
}

#[test]
fn what_is_on_its_way_is_bounded_and_batches_are_not_too_large() {
    let mut keeping = Keeping::default();
    assert!(keeping.keep(held(1), value(2 << 20)).is_err_and(|not| matches!(not.1, Refused::Batch(_))));
    let mut kept = 0;
    let why = loop {
        match keeping.keep(held(1), value(500_000)) {
            Ok(()) => kept += 1,
            Err(not_kept) => break not_kept.1,
        }
    };
    assert!(matches!(why, Refused::Behind { pending } if pending > BYTES_MAX), "{why}");
    assert_eq!(kept, BYTES_MAX / (500_000 + OPERATION_BYTES));
    let batches = keeping.take_batches(false);
    assert!(batches.iter().all(|(_, batch)| batch.encoded_bytes() <= BATCH_BYTES_MAX));
    assert_eq!(batches.iter().map(|(number, _)| *number).collect::<Vec<_>>(), [1, 2, 3, 4]);
    keeping.written(4);
    assert_eq!((origins(&mut keeping).len(), keeping.bytes), (kept, 0));
}

#[test]
fn much_to_forget_goes_alone_and_in_its_order() {
    let forgotten = (0..FORGOTTEN_AT_ONCE as u64 + 5).collect();
    let mut keeping = Keeping { forgotten, ..Keeping::default() };
    assert!(keeping.has_batches());
    let batches = keeping.take_batches(false);
    assert_eq!(batches.len(), 1, "the rest is not worth one");
    assert_eq!(keeping.forgotten.len(), 5);
    assert_eq!(keeping.take_batches(true)[0].1.operations().len(), 5);
}

#[test]
fn what_is_dropped_is_neither_handed_on_nor_kept() {
    let mut keeping = Keeping::default();
    for service in [1, 2, 1] {
        keeping.keep(held(service), value(10)).map_err(|_| ()).unwrap();
    }
    keeping.hold(held(1));
    assert_eq!(keeping.take_batches(false)[0].0, 1);
    keeping.drop_all_of(Origin::Service(1));
    assert_eq!(keeping.forgotten, [1, 3]);
    keeping.written(1);
    assert!(!keeping.holds(Origin::Service(1)));
    assert_eq!(origins(&mut keeping), [Origin::Service(2)]);
}
