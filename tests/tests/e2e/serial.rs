//! A serial line with damage: a pseudo-terminal stands for it.

use aldis_tests::{Directory, Node, Peer, delimited, frame, free_port, until};
use fastrand::Rng;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use std::fs::File;
use std::io::{Read, Write};

/// One byte in a hundred.
const DAMAGE: f64 = 0.01;
const FRAMES: usize = 10_000;

/// The far end of a line, a node at its near end, and a TCP peer of that node.
struct Stage {
    line: File,
    peer: Peer,
    node: Node,
    _directory: Directory,
}

impl Stage {
    fn new(check: &str) -> Self {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("there are pseudo-terminals");
        grantpt(&master).expect("it may be used");
        unlockpt(&master).expect("it may be opened");
        let device = ptsname(&master, Vec::new()).expect("it has a name").into_string().expect("a text");
        let (directory, port) = (Directory::new(), free_port());
        let text = format!(
            "name = \"line\"\nentities = [1]\n[[bridge]]\nkind = \"uxas-serial\"\nname = \"serial\"\nservice = 20\n\
             device = \"{device}\"\ncheck = \"{check}\"\n[[bridge]]\nkind = \"uxas-tcp\"\nname = \"tcp\"\nservice = 21\n\
             listen = \"127.0.0.1:{port}\"\n"
        );
        let node = Node::start(&directory.write("line.toml", &text));
        let peer = until("a bridge listens", || Peer::connect(port).ok());
        node.log().wait_for(&format!("{} is there", peer.name()));
        node.log().wait_for(&format!("{device} is there"));
        Self { line: File::from(master), peer, node, _directory: directory }
    }
}

/// CRC-32 bit by bit: a test that used the product's would only compare it with itself.
fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 })
    })
}

fn checked(message: &[u8]) -> Vec<u8> {
    [&frame(message)[..], format!("{:08x}", crc(message)).as_bytes()].concat()
}

#[test]
fn every_undamaged_frame_arrives_and_none_is_altered() {
    assert_eq!(crc(b"123456789"), 0xcbf4_3926);
    let Stage { mut line, mut peer, node, _directory } = Stage::new("crc");
    let mut random = Rng::with_seed(7);
    let (mut bytes, mut whole) = (Vec::new(), Vec::new());
    for number in 0..FRAMES {
        let payload: Vec<u8> = (0..random.usize(1..80)).map(|_| random.u8(..)).collect();
        let message = delimited("a.B", 1, 61, &[format!("{number} ").as_bytes(), &payload].concat());
        let mut sent = checked(&message);
        let mut damaged = false;
        for byte in &mut sent {
            if random.f64() < DAMAGE {
                *byte ^= random.u8(1..);
                damaged = true;
            }
        }
        if !damaged {
            whole.push(message);
        }
        bytes.extend(sent);
    }
    assert!(whole.len() > FRAMES / 5 && whole.len() < FRAMES / 2, "{}", whole.len());
    // Something must follow the last damage, or it would be waited for.
    for number in 0..3 {
        let message = delimited("a.B", 1, 61, format!("end {number}").as_bytes());
        bytes.extend(checked(&message));
        whole.push(message);
    }
    let writer = std::thread::spawn(move || {
        line.write_all(&bytes).expect("the line takes what is written");
        line
    });
    for (place, message) in whole.iter().enumerate() {
        let received = peer.receive();
        assert_eq!(received.0, message[..], "message {place} of {}", whole.len());
    }
    drop((writer.join(), node));
}

#[test]
fn what_goes_out_on_the_line_is_in_the_stream_form() {
    let Stage { mut line, mut peer, node, _directory } = Stage::new("sum");
    // Line ends, end of file, interrupt and flow control are bytes like all others.
    let message = delimited("a.B", 1, 61, &(0..=255).collect::<Vec<u8>>());
    peer.send(&frame(&message));
    let mut received = vec![0; frame(&message).len()];
    line.read_exact(&mut received).expect("the line gives what was sent");
    assert_eq!(received, frame(&message));
    drop(node);
}
