//! The rows of "Robustness found wanting in OpenUxAS" that concern streams, one test each.
//!
//! One node, two peers: what the first writes, the second receives. A bad message is always followed by a good one,
//! which must come out at once and first.

use aldis_tests::{Node, Peer, Received, Site, delimited, frame, sentinels};

/// A vehicle's node with two peers.
struct Stage {
    site: Site,
    first: Peer,
    second: Peer,
    _node: Node,
}

impl Stage {
    /// Shore, because it needs nobody else.
    fn new() -> Self {
        let site = Site::new();
        let node = site.start_shore();
        site.wait_for(1);
        let [first, second] = [0, 1].map(|_| site.peer(&node, site.shore_uxas));
        Self { site, first, second, _node: node }
    }

    /// The next message is this one.
    fn comes(&mut self, message: &[u8]) {
        assert_eq!(self.second.receive(), Received(message.to_vec().into()));
    }

    /// Bad bytes and a good frame in one write: the good one comes out, and the counters are as told.
    fn comes_after(&mut self, bad: &[u8], counted: &[(&str, u64)]) {
        let good = message(b"good");
        self.first.send(&[bad, &frame(&good)].concat());
        self.comes(&good);
        let status = self.site.status(1);
        for (name, value) in counted {
            assert_eq!(status["counters"][format!("uxas.{name}")], *value, "{name} in {status:#}");
        }
        assert_eq!(status["counters"]["uxas.imported"], 1, "{status:#}");
    }
}

/// A message of shore.
fn message(payload: &[u8]) -> Vec<u8> {
    delimited("afrl.cmasi.KeyValuePair", 1, 61, payload)
}

/// A frame whose parts are given as text.
fn framed(size: &str, body: &[u8], sum: &str) -> Vec<u8> {
    let [head, size_end, body_end, tail] = sentinels();
    [
        head.as_bytes(),
        size.as_bytes(),
        size_end.as_bytes(),
        body,
        body_end.as_bytes(),
        sum.as_bytes(),
        tail.as_bytes(),
    ]
    .concat()
}

#[test]
fn a_frame_split_anywhere_is_one_message() {
    let mut stage = Stage::new();
    let good = message(b"split");
    let whole = frame(&good);
    for at in 1..whole.len() {
        stage.first.send(&whole[..at]);
        stage.first.send(&whole[at..]);
        stage.comes(&good);
    }
}

#[test]
fn junk_between_frames_is_skipped_and_counted() {
    let junk = b"+=+=+=+junk#@#@#@#@ !%!%!%!%1?^?^?^?^";
    Stage::new().comes_after(junk, &[("bytes_skipped", junk.len() as u64), ("frames_bad", 0)]);
}

#[test]
fn a_wrong_checksum_is_refused() {
    let bad = message(b"bad");
    let frame = framed(&bad.len().to_string(), &bad, "12345");
    Stage::new().comes_after(&frame, &[("frames_bad", 1), ("bytes_skipped", 0)]);
}

#[test]
fn a_payload_may_hold_every_sentinel() {
    let mut stage = Stage::new();
    let inner = frame(&message(b"inside"));
    let good = message(&[&inner[..], sentinels().concat().as_bytes(), &inner, b"$|"].concat());
    stage.first.send(&frame(&good));
    stage.comes(&good);
    assert_eq!(stage.site.counter(1, "uxas.imported"), 1);
}

#[test]
fn a_message_of_more_than_a_megabyte_comes_whole() {
    let mut stage = Stage::new();
    let good = message(&(0..1_200_000u32).map(|i| (i % 251) as u8).collect::<Vec<_>>());
    stage.first.send(&frame(&good));
    stage.comes(&good);
}

#[test]
fn a_bad_and_a_good_frame_in_one_segment() {
    let bad = framed("9999", &message(b"its size is wrong"), "1");
    let mut stage = Stage::new();
    stage.comes_after(&bad, &[("imported", 1)]);
}

#[test]
fn a_checksum_beyond_32_bits_is_refused() {
    let bad = message(b"bad");
    for sum in ["2147483648", "4294967296", "99999999999999999999", "-1", ""] {
        Stage::new().comes_after(&framed(&bad.len().to_string(), &bad, sum), &[("frames_bad", 1)]);
    }
}

#[test]
fn a_size_that_is_none_is_refused() {
    let bad = message(b"bad");
    for size in ["", "-1", "x", "99999999999999999999", "4294967295"] {
        Stage::new().comes_after(&framed(size, &bad, "1"), &[("frames_bad", 1)]);
    }
}

#[test]
fn partial_frames_of_two_clients_do_not_mix() {
    let mut stage = Stage::new();
    let (of_first, of_second) = (message(b"of the first"), message(b"of the second"));
    let (one, two) = (frame(&of_first), frame(&of_second));
    stage.first.send(&one[..20]);
    stage.second.send(&two[..30]);
    stage.first.send(&one[20..]);
    stage.comes(&of_first);
    stage.second.send(&two[30..]);
    assert_eq!(stage.first.receive(), Received(of_second.into()));
}

#[test]
fn an_empty_message_is_refused() {
    Stage::new().comes_after(&frame(b""), &[("refused_malformed", 1)]);
}

#[test]
fn a_message_without_delimiter_is_refused() {
    Stage::new().comes_after(&frame(b"afrl.cmasi.KeyValuePair"), &[("refused_malformed", 1)]);
}

#[test]
fn four_attributes_are_refused() {
    Stage::new().comes_after(&frame(b"a.B$lmcp|a.B||1$payload"), &[("refused_malformed", 1)]);
}

#[test]
fn a_truncated_message_is_refused() {
    Stage::new().comes_after(&frame(b"a.B$lmcp|a.B||1|61"), &[("refused_malformed", 1)]);
}

#[test]
fn a_payload_that_is_no_lmcp_is_carried_as_it_is() {
    let mut stage = Stage::new();
    for garbage in [&b"LMCP\0\0\0\x05xx"[..], &[0; 300], &[0xff; 7], b"\r\n"] {
        let garbage = message(garbage);
        stage.first.send(&frame(&garbage));
        stage.comes(&garbage);
    }
}

#[test]
fn lmcp_with_a_wrong_checksum_is_carried_as_it_is() {
    let mut stage = Stage::new();
    // One root object that is absent: a size of 1, the object's one byte, and a checksum that is not that of the bytes.
    let wrong = message(b"LMCP\0\0\0\x01\0\xde\xad\xbe\xef");
    stage.first.send(&frame(&wrong));
    stage.comes(&wrong);
}
