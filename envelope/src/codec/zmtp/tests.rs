//! Handshakes, messages and subscriptions, in pieces of every size.

use super::*;
use crate::{ContentType, Dialect, EntityId, Label, Name, ServiceId, Source};
use bytes::Bytes;
use proptest::prelude::*;
use std::sync::Arc;

fn label() -> Arc<Label> {
    let source = Source::new(EntityId::new(400).unwrap(), ServiceId::new(37).unwrap());
    Arc::new(Label::broadcast(ContentType::Lmcp, Name::new("afrl.cmasi.Circle").unwrap(), source))
}

/// What the other end says until it is ready.
fn opening(socket: SocketType) -> Vec<u8> {
    [&GREETING[..], &ready(socket)].concat()
}

/// Everything that a reader makes of bytes that come in pieces.
fn items(own: SocketType, max: usize, bytes: &[u8], piece: usize) -> Result<Vec<Item>, ZmtpError> {
    let mut reader = Reader::new(own, max);
    let mut items = Vec::new();
    for piece in bytes.chunks(piece) {
        reader.buffer().extend_from_slice(piece);
        while let Some(item) = reader.next_item()? {
            items.push(item);
        }
        assert!(
            reader.buffer().len() <= max + 64 + piece.len(),
            "no more is kept than a message and a piece"
        );
    }
    Ok(items)
}

fn written(framing: Framing, payload: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    assert!(Writer::new(framing, Dialect::OpenUxas).write(&label(), payload, None, &mut out));
    out
}

#[test]
fn both_framings_go_through_in_pieces_of_every_size() {
    let long = vec![b'$'; 300];
    let mut bytes = opening(SocketType::Push);
    bytes.extend(written(Framing::Single, b"x"));
    bytes.extend(written(Framing::Multipart, &long));
    bytes.extend(written(Framing::Single, &long));
    for piece in 1..bytes.len() {
        let items = items(SocketType::Pull, 1_000, &bytes, piece).unwrap();
        let [Item::Greeted, Item::Ready, Item::Single(one), Item::Several(seven), Item::Single(two)] =
            items.as_slice()
        else {
            panic!("{items:?}");
        };
        assert_eq!(one, "afrl.cmasi.Circle$lmcp|afrl.cmasi.Circle||400|37$x");
        assert_eq!(
            (seven.len(), &seven[0], &seven[6][..]),
            (7, &Bytes::from("afrl.cmasi.Circle"), &long[..])
        );
        assert!(two.ends_with(&long));
    }
}

#[test]
fn what_is_too_large_is_skipped_and_the_next_message_comes() {
    let mut bytes = opening(SocketType::Push);
    // Two frames of one message, together over the limit, the second alone too.
    frame_head(MORE, 10, &mut bytes);
    bytes.extend([7; 10]);
    frame_head(MORE, 2_000, &mut bytes);
    bytes.extend([7; 2_000]);
    frame_head(0, 3, &mut bytes);
    bytes.extend([7; 3]);
    bytes.extend(written(Framing::Single, b"x"));
    for piece in [1, 7, 64, 5_000] {
        let items = items(SocketType::Pull, 1_000, &bytes, piece).unwrap();
        assert!(matches!(items[2..], [Item::TooLarge(2_013), Item::Single(_)]), "{items:?}");
    }
}

#[test]
fn a_declared_length_costs_nothing() {
    let mut bytes = opening(SocketType::Push);
    bytes.push(LONG);
    bytes.extend(i64::MAX.to_be_bytes());
    assert_eq!(items(SocketType::Pull, 1_000, &bytes, 1).unwrap().len(), 2);
    let at = bytes.len() - 8;
    bytes[at] = 0xff;
    assert_eq!(items(SocketType::Pull, 1_000, &bytes, 1), Err(ZmtpError::NoFrame));
}

#[test]
fn who_does_not_fit_is_told_why() {
    let reader = |bytes: &[u8]| items(SocketType::Pull, 100, bytes, 9).unwrap_err();
    let greeted = |at: usize, to: u8| {
        let mut greeting = GREETING;
        greeting[at] = to;
        greeting
    };
    assert_eq!(reader(b"+=+=+=+=42"), ZmtpError::NotZmtp);
    assert_eq!(reader(&greeted(10, 1)), ZmtpError::Version(1));
    assert_eq!(reader(&greeted(12, b'M')), ZmtpError::Mechanism("MULL".into()));
    let found = "PUB".to_owned();
    assert_eq!(reader(&opening(SocketType::Pub)), ZmtpError::SocketType { own: "PULL", found });
    assert_eq!(reader(&[&GREETING[..], &[0, 1, b'x']].concat()), ZmtpError::NotReady);
    assert_eq!(reader(&[&GREETING[..], &[4, 4], b"\x05REA"].concat()), ZmtpError::NoCommand);
    assert_eq!(
        reader(&[&GREETING[..], b"\x04\x09\x05ERROR\x02no"].concat()),
        ZmtpError::Refused("no".into())
    );
    assert_eq!(reader(&[&opening(SocketType::Push)[..], &[8, 0]].concat()), ZmtpError::NoFrame);
}

#[test]
fn subscriptions_of_both_versions_are_understood() {
    let mut bytes = opening(SocketType::Sub);
    bytes.extend(subscription(b"afrl"));
    bytes.extend(b"\x04\x0d\x09SUBSCRIBEuxa");
    bytes.extend(b"\0\x05\0afrl\x04\x0a\x06CANCELuxa\x04\x09\x04PING\0\x01hi\x04\x06\x05OTHER");
    let items = items(SocketType::Pub, 100, &bytes, 3).unwrap();
    let [Item::Subscribe(a), Item::Subscribe(b), Item::Cancel(c), Item::Cancel(d), Item::Ping(ping)] =
        &items[2..]
    else {
        panic!("{items:?}");
    };
    assert_eq!([a, b, c, d], ["afrl", "uxa", "afrl", "uxa"]);
    assert_eq!(pong(ping), b"\x04\x07\x04PONGhi");
}

#[test]
fn a_subscriber_gets_what_begins_as_it_asked() {
    for (framing, beyond_the_address) in [(Framing::Single, true), (Framing::Multipart, false)] {
        let mut writer = Writer::new(framing, Dialect::OpenUxas);
        let mut wants = |topic: &str| {
            let mut topics = Topics::default();
            topics.subscribe(topic.as_bytes()).unwrap();
            let mut out = Vec::new();
            let wanted = writer.write(&label(), b"payload", Some(&topics), &mut out);
            assert_eq!(wanted, !out.is_empty());
            wanted
        };
        assert!(wants("") && wants("a") && wants("afrl.cmasi.Circle"));
        assert!(!wants("b") && !wants("afrl.cmasi.Circles"));
        assert_eq!(wants("afrl.cmasi.Circle$lmcp|afrl.cmasi.Circle||400|37$pay"), beyond_the_address);
        assert!(!wants("afrl.cmasi.Circle$lmcp|afrl.cmasi.Circle||400|37$pax"));
    }
    let mut topics = Topics::default();
    assert!(!topics.want(b"a", b""), "who has not subscribed gets nothing");
    for _ in 0..2 {
        topics.subscribe(b"a").unwrap();
    }
    topics.cancel(b"a");
    topics.cancel(b"b");
    assert!(topics.want(b"a", b""));
    topics.cancel(b"a");
    assert!(!topics.want(b"a", b""));
    assert!(matches!(topics.subscribe(&[0; 2_000]), Err(TopicError::TooLong(2_000))));
    assert_eq!((0..5_000u32).filter(|n| topics.subscribe(&n.to_be_bytes()).is_ok()).count(), 4_096);
}

proptest! {
    #[test]
    fn no_bytes_make_a_reader_panic(
        begin in 0_usize..3, bytes in prop::collection::vec(0_u8..12, 0..300), piece in 1_usize..40,
    ) {
        let opening = opening(SocketType::Sub);
        let begin = [&[][..], &GREETING[..], &opening[..]][begin];
        let mut reader = Reader::new(SocketType::Pub, 64);
        for piece in [begin, &bytes[..]].concat().chunks(piece) {
            reader.buffer().extend_from_slice(piece);
            while let Ok(Some(_)) = reader.next_item() {}
        }
    }
}
