use super::*;
use proptest::prelude::*;

fn read_all(frame: &[u8]) -> Result<Vec<Item<'_>>, Malformed> {
    let mut reader = Reader::new(frame, "a frame");
    let mut items = Vec::new();
    while !reader.is_empty() {
        items.push(Item::read(&mut reader)?);
    }
    Ok(items)
}

#[test]
fn items_come_back_in_order() {
    let command = CommandItem { number: 300, after: 299, lifespan: Some(937), piece: None, bytes: b"body" };
    let items = [
        Item::Ack { largest: 65_000, delay: 3, before: &[1, 2] },
        Item::Loss(77),
        Item::Void { start: 9, count: 1_000 },
        Item::Digest { count: 400, digest: u64::MAX },
        Item::Differ(&[7; DIFFER_BYTES]),
        Item::Start { transfer: 2, length: 60_000, digest: 1 },
        Item::Have { transfer: 2, prefix: 4_096 },
        Item::Piece { transfer: 1, offset: 70_000, bytes: b"xyz" },
        Item::Command(CommandItem { after: 0, lifespan: None, ..command }),
        Item::Command(CommandItem { after: 100, piece: Some((999, 500)), ..command }),
        Item::State(StateItem {
            alias: 399,
            change: 2,
            origin: 0,
            sequence: 5,
            time: -9,
            lifespan: Some(1),
            bytes: b"",
        }),
        Item::Command(command),
    ];
    let mut frame = Vec::new();
    for (place, item) in items.iter().enumerate() {
        item.write(place + 1 == items.len(), &mut frame);
    }
    assert_eq!(read_all(&frame).unwrap(), items);
}

#[test]
fn a_command_costs_few_bytes() {
    let command = CommandItem { number: 300, after: 299, lifespan: Some(937), piece: None, bytes: b"" };
    assert_eq!(command.overhead(), 5);
    let mut bytes = Vec::new();
    command.write(true, &mut bytes);
    assert_eq!(bytes.len(), 5);
    let far = CommandItem { after: 7, piece: Some((300, 1)), ..command };
    bytes.clear();
    far.write(true, &mut bytes);
    assert_eq!(far.overhead(), bytes.len());
}

#[test]
fn heads_and_hellos_come_back() {
    let head = Head {
        hello: true,
        key: false,
        eliciting: true,
        asks: true,
        session: session_byte(300),
        number: 0xfffe,
    };
    let hello = Hello {
        sender: 400,
        receiver: 1,
        boot: 1_795_305_600_000_000_000,
        known_boot: 0,
        origin: 4,
        known_origin: 5,
        floor: 6,
        key: 2,
        number: 0xfffe,
    };
    let mut frame = Vec::new();
    head.write(&mut frame);
    assert_eq!(frame.len(), HEAD_BYTES);
    hello.write(&mut frame);
    let mut reader = Reader::new(&frame, "a frame");
    assert_eq!((Head::read(&mut reader).unwrap(), Hello::read(&mut reader).unwrap()), (head, hello));
    assert_ne!(session_byte(0x7fff), session_byte(0x8000));
}

proptest! {
    #[test]
    fn no_frame_is_too_strange(frame: Vec<u8>) {
        let mut reader = Reader::new(&frame, "a frame");
        if Head::read(&mut reader).is_ok() {
            let _ = Hello::read(&mut reader);
        }
        if let Ok(items) = read_all(&frame) {
            // What was read can be written, and is read again as the same.
            let mut again = Vec::new();
            for (place, item) in items.iter().enumerate() {
                item.write(place + 1 == items.len(), &mut again);
            }
            prop_assert_eq!(read_all(&again).unwrap(), items);
        }
    }
}
