use super::*;
use crate::codec::delimited::{payload_offset, read_head};
use crate::{ContentType, EntityId, Name, ServiceId, Source};
use bytes::Bytes;
use proptest::prelude::*;

fn frame(body: &[u8]) -> Vec<u8> {
    frame_with(body, body.len(), u64::from(checksum(body)))
}

fn frame_with(body: &[u8], size: usize, sum: u64) -> Vec<u8> {
    [b"+=+=+=+=", size.to_string().as_bytes(), SIZE_END, body, BODY_END, sum.to_string().as_bytes(), TAIL]
        .concat()
}

fn items(reader: &mut Reader, bytes: &[u8]) -> Vec<Item> {
    reader.buffer().extend_from_slice(bytes);
    std::iter::from_fn(|| reader.next_item()).collect()
}

/// The messages that come out when the bytes go in by pieces of one size.
fn messages(bytes: &[u8], piece: usize) -> Vec<Vec<u8>> {
    let mut reader = Reader::new(1 << 20);
    let mut all = Vec::new();
    for piece in bytes.chunks(piece) {
        for item in items(&mut reader, piece) {
            if let Item::Message(body) = item {
                all.push(body.to_vec());
            }
        }
    }
    all
}

const GOOD: &[u8] = b"a$lmcp|a||1|1$good";

#[test]
fn what_the_writer_writes_the_reader_reads() {
    let source = Source::new(EntityId::new(100).unwrap(), ServiceId::new(61).unwrap());
    let label =
        Arc::new(Label::broadcast(ContentType::Lmcp, Name::new("afrl.cmasi.Circle").unwrap(), source));
    let mut writer = Writer::new(Dialect::OpenUxas);
    let mut out = Vec::new();
    writer.write(&label, b"payload", &mut out);
    writer.write(&label, b"other", &mut out);
    let body = b"afrl.cmasi.Circle$lmcp|afrl.cmasi.Circle||100|61$payload";
    assert!(out.starts_with(&frame(body)));
    for piece in [1, 2, 7, 1000] {
        let read = messages(&out, piece);
        assert_eq!(read.len(), 2);
        let payload = payload_offset(&read[1]).unwrap();
        assert_eq!(read_head(&read[1][..payload]).unwrap().source, Some(source));
        assert_eq!(&read[1][payload..], b"other");
    }
}

#[test]
fn a_payload_may_hold_every_sentinel_and_a_whole_frame() {
    let inner = frame(b"x$lmcp|x||1|1$inner");
    let body =
        [b"a$lmcp|a||1|1$".as_slice(), HEAD, SIZE_END, BODY_END, TAIL, &inner, b"!%!%!%!%1?^?^?^?^"].concat();
    let bytes = [frame(&body), frame(GOOD)].concat();
    for piece in [1, 3, 8, bytes.len()] {
        assert_eq!(messages(&bytes, piece), [body.clone(), GOOD.to_vec()], "pieces of {piece}");
    }
}

#[test]
fn junk_between_frames_is_skipped_and_counted() {
    let bytes = [b"junk+=+=".as_slice(), &frame(GOOD), b"+=+=+=+=+=+=12#@", &frame(GOOD), b"+=+="].concat();
    for piece in [1, 5, 400] {
        let mut reader = Reader::new(1 << 20);
        let found: Vec<_> = bytes.chunks(piece).flat_map(|piece| items(&mut reader, piece)).collect();
        assert_eq!(found.iter().filter(|item| matches!(item, Item::Message(_))).count(), 2);
        assert_eq!(reader.counters().messages, 2);
        assert!(reader.counters().bytes_skipped >= 8);
    }
}

#[test]
fn a_bad_frame_does_not_hold_up_the_good_one_behind_it() {
    let sum = u64::from(checksum(GOOD));
    for (bad, error) in [
        (frame_with(GOOD, GOOD.len(), sum + 1), StreamError::WrongChecksum(GOOD.len())),
        (frame_with(GOOD, GOOD.len(), 9_999_999_999), StreamError::WrongChecksum(GOOD.len())),
        (frame_with(GOOD, GOOD.len() - 1, sum), StreamError::WrongSize(GOOD.len() - 1)),
        (frame_with(GOOD, GOOD.len() + 3, sum), StreamError::WrongSize(GOOD.len() + 3)),
        (frame_with(GOOD, 500_000, sum), StreamError::WrongSize(500_000)),
        (frame_with(GOOD, 2_000_000, sum), StreamError::TooLarge { declared: 2_000_000, limit: 1 << 20 }),
        (b"+=+=+=+=#@#@#@#@".to_vec(), StreamError::NoSize),
        (b"+=+=+=+=12345678901#@#@#@#@".to_vec(), StreamError::NoSize),
        (b"+=+=+=+=18#@#@#@#@a$lmcp|a||1|1$good!%!%!%!%?^?^?^?^".to_vec(), StreamError::WrongChecksum(18)),
    ] {
        let mut reader = Reader::new(1 << 20);
        let found = items(&mut reader, &[bad, frame(GOOD)].concat());
        assert_eq!(found.first(), Some(&Item::Bad(error)));
        assert_eq!(found.last(), Some(&Item::Message(Bytes::from_static(GOOD))), "after {error}");
        assert_eq!(reader.counters().frames_bad, 1);
    }
}

#[test]
fn a_frame_cut_short_gives_way_to_those_behind_it() {
    let cut = &frame_with(&[b'x'; 600], 600, 0)[..50];
    let mut reader = Reader::new(1 << 20);
    assert_eq!(items(&mut reader, &[cut, &frame(GOOD)].concat()), []);
    assert_eq!(reader.abandon_unfinished(), Some(Item::Bad(StreamError::Unfinished(600))));
    let found = items(&mut reader, &[]);
    assert_eq!(found.last(), Some(&Item::Message(Bytes::from_static(GOOD))));
    // Nothing behind it: the sender is merely slow, and nothing is given up.
    assert_eq!(items(&mut reader, cut), []);
    assert_eq!(reader.abandon_unfinished(), None);
}

#[test]
fn a_message_of_megabytes_goes_through() {
    let body = [GOOD, &vec![b'!'; 1_200_000]].concat();
    let mut reader = Reader::new(16 << 20);
    let found: Vec<_> = frame(&body).chunks(65_536).flat_map(|piece| items(&mut reader, piece)).collect();
    assert_eq!(found, [Item::Message(body.into())]);
}

proptest! {
    #[test]
    fn frames_survive_any_noise_between_them(
        noise in proptest::collection::vec(proptest::collection::vec("[+=#@!%?^0-9a]", 0..30), 1..6),
        piece in 1usize..40,
    ) {
        let mut bytes = Vec::new();
        for part in &noise {
            let mut noise = part.concat();
            // Noise that opens a frame of its own swallows what follows, by the rules of the form.
            noise = noise.replace("+=+=+=+=", "+=+=+=");
            bytes.extend_from_slice(noise.trim_end_matches(['+', '=']).as_bytes());
            bytes.extend(frame(GOOD));
        }
        prop_assert_eq!(messages(&bytes, piece), vec![GOOD.to_vec(); noise.len()]);
    }

    #[test]
    fn any_bytes_are_read_without_panic(bytes in "[+=#@!%?^0-9a]{0,300}", piece in 1usize..40) {
        let mut reader = Reader::new(1000);
        for piece in bytes.as_bytes().chunks(piece) {
            items(&mut reader, piece);
            reader.abandon_unfinished();
        }
    }
}

#[test]
fn damage_that_cancels_out_in_the_sum_is_found_by_the_crc() {
    let source = Source::new(EntityId::new(100).unwrap(), ServiceId::new(61).unwrap());
    let label = Arc::new(Label::broadcast(ContentType::Lmcp, Name::new("a.B").unwrap(), source));
    let written = |check| {
        let mut out = Vec::new();
        let mut writer = Writer::new(Dialect::OpenUxas).with_check(check);
        for _ in 0..3 {
            writer.write(&label, b"payload", &mut out);
        }
        out
    };
    let read = |check, bytes: &[u8], piece: usize| {
        let mut reader = Reader::new(1_000).with_check(check);
        let mut came = Vec::new();
        for piece in bytes.chunks(piece) {
            came.extend(items(&mut reader, piece));
        }
        came.into_iter().filter(|item| matches!(item, Item::Message(_))).count()
    };
    for check in [Check::Sum, Check::Crc] {
        let mut bytes = written(check);
        assert!((1..bytes.len()).all(|piece| read(check, &bytes, piece) == 3), "{check:?}");
        let at = bytes.windows(7).position(|window| window == b"payload").unwrap();
        bytes[at] += 1;
        bytes[at + 1] -= 1;
        assert_eq!(read(check, &bytes, 5), if check == Check::Sum { 3 } else { 2 });
    }
}
