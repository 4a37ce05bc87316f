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
    take(&mut inbox, &of_stream(1, 3, 1));
    take(&mut inbox, &of_stream(1, 5, 3));
    take(&mut inbox, &of_stream(2, 4, 2));
    take(&mut inbox, &of_stream(2, 2, 0));
    assert_eq!(handed(&mut inbox), [2, 4]);
    assert!(inbox.void(1, 1));
    assert_eq!(handed(&mut inbox), [3, 5]);
}

/// The content of a command begins with its stream.
fn of_stream(stream: u8, number: u64, after: u64) -> CommandItem<'static> {
    const STREAMS: &[u8] = &[0, 1, 2, 3];
    let stream = usize::from(stream);
    item(number, after, &STREAMS[stream..=stream])
}

#[test]
fn over_one_that_is_not_coming_a_stream_waits_for_all_that_may_be_its_own() {
    let mut inbox = Inbox::default();
    take(&mut inbox, &of_stream(1, 1, 0));
    assert_eq!(handed(&mut inbox), [1]);
    // 2 to 4 are of the stream; 2 and 4 are still on the air when 3 and 5 are told not to come.
    take(&mut inbox, &of_stream(1, 6, 5));
    take(&mut inbox, &of_stream(1, 7, 6));
    assert!(inbox.void(3, 1) && inbox.void(5, 1));
    assert!(handed(&mut inbox).is_empty());
    take(&mut inbox, &of_stream(1, 4, 3));
    assert!(handed(&mut inbox).is_empty(), "2 may be of the stream");
    // What comes may be of another stream: then it is waited for no longer.
    take(&mut inbox, &of_stream(2, 2, 0));
    assert_eq!(handed(&mut inbox), [2, 4, 6, 7]);
}

#[test]
fn one_that_waits_holds_its_stream_after_several_are_not_coming() {
    let mut inbox = Inbox::default();
    take(&mut inbox, &of_stream(1, 2, 1));
    take(&mut inbox, &of_stream(1, 5, 4));
    take(&mut inbox, &of_stream(2, 6, 0));
    assert!(inbox.void(3, 2));
    assert_eq!(handed(&mut inbox), [6], "1 may come, and 2 waits for it");
    assert!(inbox.void(1, 1));
    assert_eq!(handed(&mut inbox), [2, 5]);
}

#[test]
fn who_begins_a_stream_anew_does_not_overtake_what_waits_of_it() {
    let mut inbox = Inbox::default();
    take(&mut inbox, &of_stream(1, 2, 1));
    // The sender has forgotten what is through, and was started anew.
    take(&mut inbox, &of_stream(1, 9, 0));
    assert!(handed(&mut inbox).is_empty());
    assert!(inbox.void(1, 1));
    assert_eq!(handed(&mut inbox), [2, 9]);
}

#[test]
fn what_comes_after_word_that_it_does_not_is_not_taken_for_delivered() {
    let mut inbox = Inbox::default();
    take(&mut inbox, &of_stream(1, 1, 0));
    assert!(inbox.void(1, 2));
    assert_eq!(inbox.take(at(0), &of_stream(1, 1, 0), Duration::ZERO), Took::Again(true));
    assert_eq!(inbox.take(at(0), &of_stream(1, 2, 1), Duration::ZERO), Took::No);
    // Very old word is forgotten, and never more than is true is known.
    for number in (4..400).step_by(2) {
        take(&mut inbox, &of_stream(1, number, 0));
        assert!(inbox.void(number + 1, 1));
    }
    assert_eq!(inbox.take(at(0), &of_stream(1, 399, 0), Duration::ZERO), Took::No);
    for number in (4..400).step_by(2) {
        assert_eq!(inbox.take(at(0), &of_stream(1, number, 0), Duration::ZERO), Took::Again(true));
    }
}

#[test]
fn a_restart_remembers_what_is_not_coming() {
    let mut inbox = Inbox::default();
    take(&mut inbox, &of_stream(1, 2, 1));
    assert!(inbox.void(3, 1));
    take(&mut inbox, &of_stream(2, 5, 0));
    let mut restored = Inbox::default();
    restored.restore_taken(&inbox.encode_taken()).unwrap();
    let now = Now { monotonic: at(0), wall: Wall(0) };
    restored.restore(2, &inbox.encode(2, now).unwrap(), now).unwrap();
    take(&mut restored, &of_stream(1, 4, 3));
    take(&mut restored, &of_stream(2, 6, 5));
    assert_eq!(handed(&mut restored), [6], "5 came, so what follows it does not wait for 1");
    assert!(restored.void(1, 1));
    assert_eq!(handed(&mut restored), [2, 4]);
    // A journal from before this was kept does not tell.
    let mut old = Vec::new();
    inbox.taken.encode(&mut old);
    let mut restored = Inbox::default();
    restored.restore_taken(&old).unwrap();
    take(&mut restored, &of_stream(2, 6, 5));
    assert!(handed(&mut restored).is_empty());
    assert!(restored.void(0, 6));
    assert_eq!(handed(&mut restored), [6]);
}

#[test]
fn the_oldest_unfinished_command_has_room_when_there_is_none() {
    let mut inbox = Inbox::default();
    let half = vec![0; COMMAND_BYTES_MAX / 2];
    let length = COMMAND_BYTES_MAX as u32;
    let piece = |number, at| CommandItem { piece: Some((length, at)), ..item(number, 0, &half) };
    let many = (PARTIAL_BYTES_MAX / half.len()) as u64;
    for number in 1..=many {
        assert_eq!(inbox.take(at(0), &piece(number, 0), Duration::ZERO), Took::Piece);
    }
    for number in [many + 1, 2] {
        assert_eq!(inbox.take(at(0), &piece(number, length / 2), Duration::ZERO), Took::No);
    }
    // What was acknowledged is still there.
    for number in 1..=many {
        assert_eq!(inbox.take(at(0), &piece(number, length / 2), Duration::ZERO), Took::New);
    }
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
    take(&mut inbox, &of_stream(1, 1, 0));
    take(&mut inbox, &CommandItem { lifespan: Some(100), ..of_stream(1, 2, 1) });
    let now = Now { monotonic: at(0), wall: Wall(0) };
    let mut restored = Inbox::default();
    restored.restore_taken(&inbox.encode_taken()).unwrap();
    for number in [1, 2] {
        restored.restore(number, &inbox.encode(number, now).unwrap(), now).unwrap();
    }
    assert_eq!(handed(&mut restored), [1, 2]);
    assert!(restored.get(2).unwrap().recovered);
    assert_eq!(restored.take(at(0), &of_stream(1, 2, 1), Duration::ZERO), Took::Again(true));
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
