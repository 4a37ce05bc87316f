//! The relay of `configs/`: what a UxAS writes on the vehicle comes out at shore, and the other way.

use aldis_envelope::codec::stream::{Item, Reader};
use aldis_tests::{Peer, Received, Site, delimited, frame, shared};

/// The messages of a stream of bytes.
fn messages(bytes: &[u8]) -> Vec<Received> {
    let mut reader = Reader::new(16 << 20);
    reader.buffer().extend_from_slice(bytes);
    let mut messages = Vec::new();
    while let Some(item) = reader.next_item() {
        let Item::Message(message) = item else { panic!("{item:?}") };
        messages.push(Received(message));
    }
    messages
}

fn texts(messages: &[Received]) -> Vec<String> {
    messages.iter().map(|message| String::from_utf8_lossy(&message.0).into_owned()).collect()
}

#[test]
fn what_openuxas_sent_comes_out_at_shore_whatever_pieces_it_came_in() {
    let Some(path) = shared("uxas/captures/waterway/tcp_raw.bin") else { return };
    let bytes = std::fs::read(path).unwrap();
    let sent = messages(&bytes);
    assert_eq!(sent.len(), 28);
    let site = Site::new();
    let (shore, vehicle) = site.start();
    let mut at_shore = site.peer(&shore, site.shore_uxas);
    let mut on_board = site.peer(&vehicle, site.vehicle_uxas);
    let mut check = |how: &str, size: &mut dyn FnMut() -> usize| {
        on_board.send_in_pieces(&bytes, size);
        let came = at_shore.receive_many(sent.len());
        assert_eq!(texts(&came), texts(&sent), "{how}");
        assert!(
            came.iter().all(|message| message.head().contains("|100|")),
            "{how}: the origin's ids are kept"
        );
    };
    for size in [1, 7, 97, 1_460, 8_192, 64 * 1024] {
        check(&format!("pieces of {size} bytes"), &mut || size);
    }
    for seed in 0..4 {
        let mut random = fastrand::Rng::with_seed(seed);
        check(&format!("pieces of chance, seed {seed}"), &mut || 1 << random.u32(0..15));
    }
    assert_eq!(site.counter(400, "uxas.imported"), 10 * 28);
    assert_eq!(site.counter(1, "uxas.exported"), 10 * 28);
    assert_eq!((site.counter(400, "uxas.bytes_skipped"), site.counter(400, "uxas.frames_bad")), (0, 0));
    assert_eq!(site.counter(1, "lost"), 0);
}

#[test]
fn frames_of_shore_come_out_on_the_vehicle() {
    let site = Site::new();
    let (shore, vehicle) = site.start();
    let mut on_board = site.peer(&vehicle, site.vehicle_uxas);
    let mut at_shore = site.peer(&shore, site.shore_uxas);
    for (number, address) in
        ["afrl.cmasi.KeyValuePair", "eid400.sid37", "eid400.sidall", "Mailbox"].iter().enumerate()
    {
        let message = delimited(address, 1, 60 + number as u64, format!("message {number}").as_bytes());
        at_shore.send(&frame(&message));
        assert_eq!(on_board.receive(), Received(message.into()));
    }
}

#[test]
fn two_clients_that_interleave_partial_frames_lose_nothing() {
    let site = Site::new();
    let (shore, vehicle) = site.start();
    let mut at_shore = site.peer(&shore, site.shore_uxas);
    let mut clients = [0, 1].map(|_| site.peer(&vehicle, site.vehicle_uxas));
    let sent = [61, 62].map(|service| {
        let payload = |number: u64| vec![service as u8; 1 + (number as usize * 37) % 700];
        (0..50).map(|number| delimited("a.B", 100, service, &payload(number))).collect::<Vec<_>>()
    });
    let mut streams =
        sent.clone().map(|messages| messages.iter().flat_map(|m| frame(m)).collect::<Vec<u8>>());
    let mut random = fastrand::Rng::with_seed(7);
    while streams.iter().any(|stream| !stream.is_empty()) {
        let turn = random.usize(0..2);
        let piece = random.usize(1..300).min(streams[turn].len());
        clients[turn].send(&streams[turn][..piece]);
        streams[turn].drain(..piece);
    }
    let came = at_shore.receive_many(100);
    for (sent, service) in sent.iter().zip([61, 62]) {
        let of_client = came.iter().filter(|message| message.head().ends_with(&format!("|100|{service}$")));
        assert!(of_client.map(|message| message.0.to_vec()).eq(sent.iter().cloned()), "client {service}");
    }
}

#[test]
fn frames_of_a_foreign_entity_are_refused_and_counted() {
    let site = Site::new();
    let (shore, vehicle) = site.start();
    let mut at_shore = site.peer(&shore, site.shore_uxas);
    let mut on_board = site.peer(&vehicle, site.vehicle_uxas);
    on_board.send(&frame(&delimited("a.B", 300, 61, b"foreign")));
    on_board.send(&frame(&delimited("a.B", 300, 61, b"foreign again")));
    on_board.send(&frame(&delimited("a.B", 100, 61, b"own")));
    assert_eq!(at_shore.receive().payload(), b"own");
    assert_eq!(site.counter(400, "uxas.refused_foreign_entity"), 2);
    assert_eq!(site.counter(400, "uxas.imported"), 1);
    let said = vehicle.log().wait_for("does not speak for entity 300");
    assert!(said.contains("name it in `entities`"), "{said}");
    assert_eq!(vehicle.log().count("does not speak for"), 1, "the log is not filled");
}

/// That something does not come is shown by what comes first instead.
#[test]
fn a_message_goes_to_the_other_peers_and_never_back() {
    let site = Site::new();
    let (shore, vehicle) = site.start();
    let mut at_shore = site.peer(&shore, site.shore_uxas);
    let [mut first, mut second] = [0, 1].map(|_| site.peer(&vehicle, site.vehicle_uxas));
    first.send(&frame(&delimited("a.B", 100, 61, b"of the first")));
    for other in [&mut second, &mut at_shore] {
        assert_eq!(other.receive().payload(), b"of the first");
    }
    second.send(&frame(&delimited("a.B", 100, 62, b"of the second")));
    for other in [&mut first, &mut at_shore] {
        assert_eq!(other.receive().payload(), b"of the second");
    }
    at_shore.send(&frame(&delimited("a.B", 1, 63, b"of shore")));
    for other in [&mut first, &mut second] {
        assert_eq!(other.receive().payload(), b"of shore");
    }
}

#[test]
fn a_source_left_open_becomes_that_of_the_bridge_and_is_counted() {
    let site = Site::new();
    let (shore, vehicle) = site.start();
    let mut at_shore = site.peer(&shore, site.shore_uxas);
    let [mut first, mut second] = [0, 1].map(|_| site.peer(&vehicle, site.vehicle_uxas));
    first.send(&frame(&delimited("a.B", 0, 0, b"whose?")));
    let assigned = delimited("a.B", 400, 20, b"whose?");
    for other in [&mut second, &mut at_shore] {
        assert_eq!(other.receive(), Received(assigned.clone().into()));
    }
    assert_eq!(site.counter(400, "uxas.sources_assigned"), 1);
}

#[test]
fn both_spellings_are_read_and_the_configured_one_is_written() {
    let site = Site::new();
    let config = std::fs::read_to_string(site.shore_config("")).unwrap();
    let slides = config.replace("dialect = \"openuxas\"", "dialect = \"slides\"");
    assert_ne!(config, slides);
    let shore = aldis_tests::Node::start(&site.directory().write("slides.toml", &slides));
    let vehicle = site.start_vehicle();
    site.wait_for(1);
    site.wait_for(400);
    let mut at_shore: Peer = site.peer(&shore, site.shore_uxas);
    let mut on_board = site.peer(&vehicle, site.vehicle_uxas);
    on_board.send(&frame(b"eid1.sid7$lmcp|a.B||100|61$x"));
    assert_eq!(at_shore.receive().0, "eid1sid7$lmcp|a.B||eid100|sid61$x");
    at_shore.send(&frame(b"eid400sid7$lmcp|a.B|group|eid1|sid61$y"));
    assert_eq!(on_board.receive().0, "eid400.sid7$lmcp|a.B|group|1|61$y");
}
