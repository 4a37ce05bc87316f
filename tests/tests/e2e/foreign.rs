//! Other programs on the bus: what is no envelope is refused and counted, and holds up nothing.

use crate::zenoh_client::{envelope, open};
use aldis_tests::{Site, until};
use zenoh::{Session, Wait};

fn put(session: &Session, key: &str, header: Option<&[u8]>, content: &str) {
    let put = session.put(key.to_owned(), content.to_owned());
    match header {
        Some(header) => put.attachment(header.to_vec()).wait().unwrap(),
        None => put.wait().unwrap(),
    }
}

fn joined(site: &Site) -> Session {
    until("the session opens", || open(site.bus, None))
}

#[test]
fn foreign_samples_are_refused_and_counted_and_the_next_good_one_goes_through() {
    let site = Site::new();
    let shore = site.start_shore();
    let mut at_shore = site.peer(&shore, site.shore_uxas);
    site.wait_for(1);
    let session = joined(&site);
    let (key, header, content) = envelope(7, "a.B", 1, "good");
    let changed = |at: usize, to: u8| {
        let mut header = header.clone();
        header[at] = to;
        header
    };
    let longer = [&header[..], &[0]].concat();
    put(&session, &key, None, "no header");
    put(&session, &key, Some(&changed(0, 99)), "an unknown version");
    put(&session, &key, Some(&header[..header.len() - 1]), "a header that ends early");
    put(&session, &key, Some(&longer), "a header that does not end");
    put(&session, &key, Some(&changed(1, 9)), "a spelling that is none");
    put(&session, "aldis/fleet/x/61/-/a/B", Some(&header), "an entity that is none");
    put(&session, "aldis/fleet/7/61/-/eid0/B", Some(&header), "an address that is none");
    put(&session, "aldis/fleet/7/61/zz/a/B", Some(&header), "an instance that is none");
    put(&session, "aldis/fleet/7/61/-", Some(&header), "a key without an address");
    session.delete(key.clone()).attachment(header.clone()).wait().unwrap();
    put(&session, "aldis/red/7/61/-/a/B", Some(&header), "another fleet");
    put(&session, &key, Some(&header), &content);
    assert_eq!(at_shore.receive().0, "a.B$lmcp|a.B||7|61$good");
    let counters = site.status(1)["counters"].clone();
    assert_eq!(counters["refused_headers"], 10, "all but that of another fleet: {counters:#}");
    assert_eq!(counters["lost"], 0);
    assert_eq!(shore.log().count("sample refused"), 1, "the log is not filled: {}", shore.log().text());
    session.close().wait().unwrap();
}

#[test]
fn a_header_that_disagrees_with_its_key_is_refused() {
    let site = Site::new();
    let shore = site.start_shore();
    let mut at_shore = site.peer(&shore, site.shore_uxas);
    site.wait_for(1);
    let session = joined(&site);
    let (key, header, content) = envelope(7, "a.B", 1, "good");
    // Colons in the address, where the key's chunks come from dots: another message type.
    let text = b"x::Y";
    let elsewhere = [&[header[0], 2, text.len() as u8], &text[..], &header[2..]].concat();
    put(&session, &key, Some(&elsewhere), "on another's key");
    put(&session, &key, Some(&header), &content);
    assert_eq!(at_shore.receive().payload(), b"good");
    assert_eq!(site.counter(1, "refused_headers"), 1);
    assert!(shore.log().wait_for("sample refused").contains("disagree"), "{}", shore.log().text());
    session.close().wait().unwrap();
}

#[test]
fn a_gap_and_a_duplicate_in_a_stream_are_counted() {
    let site = Site::new();
    let shore = site.start_shore();
    let mut at_shore = site.peer(&shore, site.shore_uxas);
    site.wait_for(1);
    let session = joined(&site);
    for sequence in [5, 6, 6, 4, 9] {
        let (key, header, content) = envelope(7, "a.B", sequence, &sequence.to_string());
        put(&session, &key, Some(&header), &content);
    }
    let came = at_shore.receive_many(3);
    assert_eq!(came.iter().map(|message| message.payload()).collect::<Vec<_>>(), [b"5", b"6", b"9"]);
    let counters = site.status(1)["counters"].clone();
    assert_eq!((&counters["lost"], &counters["duplicates"]), (&2.into(), &2.into()), "{counters:#}");
    session.close().wait().unwrap();
}
