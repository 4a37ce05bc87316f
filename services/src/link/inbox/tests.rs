use super::*;
use aldis_envelope::Wall;
use proptest::prelude::*;

fn at(milliseconds: u64) -> Monotonic {
    Monotonic::since_start(Duration::from_millis(milliseconds))
}

fn item(number: u64, after: u64, bytes: &[u8]) -> CommandItem<'_> {
    CommandItem { number, after, lifespan: None, piece: None, bytes }
}

fn handed(inbox: &mut Inbox) -> Vec<u64> {
    let mut handed = Vec::new();
    while let Some((number, _)) = inbox.next_to_hand(0) {
        inbox.set_handed(number);
        handed.push(number);
    }
    handed
}

fn take(inbox: &mut Inbox, item: &CommandItem<'_>) {
    assert_eq!(inbox.take(at(0), item, Duration::ZERO), Took::New);
    inbox.make_safe(item.number);
}

#[test]
fn a_stream_keeps_its_order_and_others_do_not_wait_for_it() {
    let mut inbox = Inbox::default();
    take(&mut inbox, &item(3, 1, b"3"));
    take(&mut inbox, &item(5, 3, b"5"));
    take(&mut inbox, &item(4, 2, b"4"));
    take(&mut inbox, &item(2, 0, b"2"));
    assert_eq!(handed(&mut inbox), [2, 4]);
    assert!(inbox.void(1, 1));
    assert_eq!(handed(&mut inbox), [3, 5]);
}

#[test]
fn what_came_before_is_known_again_and_is_safe_once_written() {
    let mut inbox = Inbox::default();
    assert_eq!(inbox.take(at(0), &item(1, 0, b"1"), Duration::ZERO), Took::New);
    assert_eq!(inbox.take(at(0), &item(1, 0, b"1"), Duration::ZERO), Took::Again(false));
    assert!(handed(&mut inbox).is_empty());
    inbox.undo(1);
    take(&mut inbox, &item(1, 0, b"1"));
    assert_eq!(inbox.take(at(0), &item(1, 0, b"1"), Duration::ZERO), Took::Again(true));
    assert_eq!(handed(&mut inbox), [1]);
    assert!(inbox.finish(1) && inbox.len() == 0);
    assert_eq!(inbox.take(at(0), &item(1, 0, b"1"), Duration::ZERO), Took::Again(true));
}

#[test]
fn what_comes_after_its_lifespan_is_not_taken() {
    let mut inbox = Inbox::default();
    let late = CommandItem { lifespan: Some(4), ..item(1, 0, b"") };
    assert_eq!(inbox.take(at(0), &late, Duration::from_millis(300)), Took::No);
    assert_eq!((inbox.late, inbox.take(at(0), &late, Duration::from_millis(200))), (1, Took::New));
    assert_eq!(inbox.get(1).unwrap().expires, Some(at(56)));
}

#[test]
fn a_received_command_survives_a_restart_and_is_handed_over_again() {
    let mut inbox = Inbox::default();
    take(&mut inbox, &item(1, 0, b"one"));
    take(&mut inbox, &CommandItem { lifespan: Some(100), ..item(2, 1, b"two") });
    let now = Now { monotonic: at(0), wall: Wall(0) };
    let mut restored = Inbox::default();
    restored.restore_taken(&inbox.encode_taken()).unwrap();
    for number in [1, 2] {
        restored.restore(number, &inbox.encode(number, now).unwrap(), now).unwrap();
    }
    assert_eq!(handed(&mut restored), [1, 2]);
    assert!(restored.get(2).unwrap().recovered);
    assert_eq!(restored.take(at(0), &item(2, 1, b"two"), Duration::ZERO), Took::Again(true));
}

proptest! {
    #[test]
    fn pieces_make_the_whole_in_any_order(
        body in prop::collection::vec(any::<u8>(), 2..300),
        cuts in prop::collection::vec((any::<prop::sample::Index>(), 1usize..80), 0..30),
    ) {
        let mut inbox = Inbox::default();
        let length = body.len() as u32;
        let mut took = Took::Piece;
        for (at_place, size) in cuts {
            let start = at_place.index(body.len());
            let end = (start + size).min(body.len());
            let piece = CommandItem { piece: Some((length, start as u32)), ..item(1, 0, &body[start..end]) };
            took = inbox.take(at(0), &piece, Duration::ZERO);
            if took != Took::Piece {
                break;
            }
        }
        if took == Took::Piece {
            for start in (0..body.len()).step_by(50) {
                let end = (start + 50).min(body.len());
                let piece = CommandItem { piece: Some((length, start as u32)), ..item(1, 0, &body[start..end]) };
                took = inbox.take(at(0), &piece, Duration::ZERO);
                if took == Took::New {
                    break;
                }
            }
        }
        prop_assert_eq!(took, Took::New);
        prop_assert_eq!(&inbox.get(1).unwrap().body[..], &body[..]);
    }

    #[test]
    fn strange_pieces_take_no_more_than_they_are_long(
        pieces in prop::collection::vec((1u64..9, any::<u32>(), any::<u32>(), 0usize..60), 0..60)
    ) {
        let mut inbox = Inbox::default();
        for (number, length, start, size) in pieces {
            let bytes = vec![0; size];
            let piece = CommandItem { piece: Some((length, start)), ..item(number, 0, &bytes) };
            inbox.take(at(0), &piece, Duration::ZERO);
        }
        prop_assert!(inbox.partial_bytes <= 60 * 60);
    }
}
