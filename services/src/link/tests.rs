//! Two ends over a wire of the test's own, and what a stranger may send.

use super::body::tests::envelope;
use super::*;
use aldis_envelope::{Address, Envelope, Label, Wall};
use bytes::Bytes;
use proptest::prelude::*;
use std::sync::Arc;
use std::time::Duration;

/// A link whose journal writes at once and whose frames the test carries.
struct End {
    link: Link,
    frames: Vec<(CarrierId, Vec<u8>)>,
    delivered: Vec<Delivery>,
    tickets: Vec<(Ticket, TicketState)>,
    notes: Vec<String>,
    journal: BTreeMap<Bytes, Bytes>,
}

fn entity(number: u64) -> EntityId {
    EntityId::new(number).unwrap()
}

fn config(own: u64, peer: u64, carriers: u8, keys: &[LinkKey]) -> LinkConfig {
    let carrier = |id| CarrierConfig {
        id: CarrierId(id),
        rate: 10_000,
        mtu: 256,
        round_trip: Duration::from_millis(100),
        loss: 0.0,
    };
    let config = LinkConfig::new(entity(own), entity(peer), (0..carriers).map(carrier).collect());
    LinkConfig { keys: keys.to_vec(), ..config }
}

fn now(milliseconds: u64) -> Now {
    Now { monotonic: Monotonic::since_start(Duration::from_millis(milliseconds)), wall: Wall(1_000_000_000) }
}

impl End {
    fn new(config: LinkConfig, boot: u64, journal: BTreeMap<Bytes, Bytes>) -> Self {
        let carriers: Vec<_> = config.carriers.iter().map(|carrier| carrier.id).collect();
        let link = Link::new(config, BootId(boot));
        let (frames, delivered, tickets, notes) = Default::default();
        let mut end = Self { link, frames, delivered, tickets, notes, journal: journal.clone() };
        for (key, value) in journal {
            end.give(0, Event::ReadBack { key, value });
        }
        end.give(0, Event::ReadBackEnd);
        for carrier in carriers {
            end.give(0, Event::CarrierUp(carrier, 256));
        }
        end
    }

    fn give(&mut self, at: u64, event: Event) {
        let (mut events, mut effects) = (vec![event], Vec::new());
        while !events.is_empty() {
            self.link.handle(now(at), &mut events, &mut effects);
            for effect in effects.drain(..) {
                match effect {
                    Effect::Transmit(carrier, frame) => self.frames.push((carrier, frame)),
                    Effect::Deliver(delivery) => self.delivered.push(delivery),
                    Effect::Ticket(ticket, state) => self.tickets.push((ticket, state)),
                    Effect::Note(text) => self.notes.push(text),
                    Effect::Persist(batch, records) => {
                        for record in records {
                            match record {
                                Record::Put { key, value } => self.journal.insert(key, value),
                                Record::Forget { key } => self.journal.remove(&key),
                            };
                        }
                        events.push(Event::Written(batch));
                    }
                    Effect::Peer(_) | Effect::Arm(_) => {}
                }
            }
        }
    }

    fn offer(&mut self, at: u64, ticket: u64, envelope: Envelope, class: Class) {
        let offer = Offer::new(Ticket(ticket), envelope, class);
        self.give(at, Event::Offer(offer));
    }

    fn numbers(&self) -> Vec<u64> {
        self.delivered.iter().map(|delivery| delivery.envelope.stamp.sequence).collect()
    }
}

fn carry(sender: &mut End, receiver: &mut End, at: u64, passes: &mut impl FnMut(CarrierId, &[u8]) -> bool) {
    sender.give(at, Event::Deadline);
    for (carrier, frame) in std::mem::take(&mut sender.frames) {
        if passes(carrier, &frame) {
            receiver.give(at, Event::Frame(carrier, Bytes::from(frame)));
        }
    }
}

/// Carries frames both ways for a while, in steps of 10 ms. `passes` says which arrive.
fn run(a: &mut End, b: &mut End, from: u64, to: u64, mut passes: impl FnMut(CarrierId, &[u8]) -> bool) {
    for at in (from..to).step_by(10) {
        carry(a, b, at, &mut passes);
        carry(b, a, at, &mut passes);
    }
}

fn pair(carriers: u8, keys: &[LinkKey]) -> (End, End) {
    let a = End::new(config(400, 1, carriers, keys), 1, BTreeMap::new());
    let b = End::new(config(1, 400, carriers, keys), 1, BTreeMap::new());
    (a, b)
}

fn keys() -> Vec<LinkKey> {
    vec![LinkKey { number: 1, secret: [1; 32] }]
}

#[test]
fn a_command_arrives_whole_once_and_its_sender_hears_of_it() {
    for keys in [vec![], keys()] {
        let (mut a, mut b) = pair(1, &keys);
        run(&mut a, &mut b, 10, 1_000, |_, _| true);
        let sent = envelope(7, b"take off");
        a.offer(1_000, 5, sent.clone(), Class::Command);
        run(&mut a, &mut b, 1_000, 3_000, |_, _| true);
        assert_eq!(b.numbers(), [7]);
        assert_eq!(b.delivered[0].envelope, sent);
        let words: Vec<_> = a.tickets.iter().map(|(ticket, state)| (ticket.0, state)).collect();
        assert!(matches!(
            words[..],
            [
                (5, TicketState::Accepted { .. }),
                (5, TicketState::OnAir { tries: 1 }),
                ..,
                (5, TicketState::Delivered { .. })
            ]
        ));
    }
}

#[test]
fn a_receiver_that_was_not_done_gets_it_again_after_a_restart_and_only_then() {
    let (mut a, mut b) = pair(1, &[]);
    a.offer(10, 1, envelope(1, b"one"), Class::Command);
    a.offer(10, 2, envelope(2, b"two"), Class::Command);
    run(&mut a, &mut b, 10, 2_000, |_, _| true);
    let first = b.delivered[0].id.unwrap();
    b.give(2_000, Event::Done { delivery: first, with: vec![] });
    let mut b = End::new(config(1, 400, 1, &[]), 2, b.journal.clone());
    assert_eq!((b.numbers(), b.delivered[0].recovered), (vec![2], true));
    run(&mut a, &mut b, 2_000, 4_000, |_, _| true);
    assert_eq!(b.numbers(), [2]);
}

#[test]
fn names_are_known_after_both_ends_restart() {
    let (mut a, mut b) = pair(1, &[]);
    a.offer(10, 1, envelope(1, b"one"), Class::Command);
    run(&mut a, &mut b, 10, 2_000, |_, _| true);
    let mut a = End::new(config(400, 1, 1, &[]), 2, a.journal.clone());
    let mut b = End::new(config(1, 400, 1, &[]), 2, b.journal.clone());
    b.delivered.clear();
    run(&mut a, &mut b, 2_010, 3_000, |_, _| true);
    let before = a.link.counters().bytes_sent;
    a.offer(3_000, 2, envelope(2, b"two"), Class::Command);
    run(&mut a, &mut b, 3_000, 3_400, |_, _| true);
    // No definition goes out again: one frame, a little longer than the content.
    assert!(a.link.counters().bytes_sent - before < 40);
    assert_eq!(b.numbers(), [2]);
}

#[test]
fn a_peer_with_an_empty_journal_gets_the_names_again() {
    let (mut a, mut b) = pair(1, &[]);
    a.offer(10, 1, envelope(1, b"one"), Class::Command);
    run(&mut a, &mut b, 10, 2_000, |_, _| true);
    let mut b = End::new(config(1, 400, 1, &[]), 2, BTreeMap::new());
    run(&mut a, &mut b, 2_010, 3_000, |_, _| true);
    a.offer(3_000, 2, envelope(2, b"two"), Class::Command);
    run(&mut a, &mut b, 3_000, 5_000, |_, _| true);
    assert_eq!(b.numbers(), [2]);
}

#[test]
fn cutting_the_preferred_carrier_loses_nothing_and_doubles_nothing() {
    let (mut a, mut b) = pair(2, &[]);
    for number in 1..=40 {
        let at = 1_000 + number * 500;
        a.offer(at, number, envelope(number, b"go"), Class::Command);
        run(&mut a, &mut b, at, at + 500, |carrier, _| at < 8_000 || carrier.0 == 1);
    }
    run(&mut a, &mut b, 21_500, 40_000, |carrier, _| carrier.0 == 1);
    assert_eq!(b.numbers(), (1..=40).collect::<Vec<_>>());
}

#[test]
fn keys_change_without_a_gap() {
    let (mut a, mut b) = pair(1, &keys());
    let both = [keys(), vec![LinkKey { number: 2, secret: [2; 32] }]].concat();
    for number in 1..=20 {
        let at = number * 1_000;
        if number == 5 {
            a.give(at, Event::Keys(both.clone()));
        }
        if number == 10 {
            b.give(at, Event::Keys(both.clone()));
        }
        a.offer(at, number, envelope(number, b"go"), Class::Command);
        run(&mut a, &mut b, at, at + 1_000, |_, _| true);
        assert_eq!(b.numbers().len() as u64, number);
    }
    assert_eq!((a.link.counters().frames_forged, b.link.counters().frames_forged), (0, 0));
}

#[test]
fn a_wrong_key_and_a_replay_are_counted_and_not_answered() {
    let (mut a, mut b) = pair(1, &keys());
    let mut recorded = Vec::new();
    a.offer(10, 1, envelope(1, b"one"), Class::Command);
    run(&mut a, &mut b, 10, 2_000, |_, frame| {
        recorded.push(frame.to_vec());
        true
    });
    b.give(2_000, Event::Deadline);
    b.frames.clear();
    let before = b.link.counters().clone();
    for frame in &recorded {
        b.give(2_000, Event::Frame(CarrierId(0), frame.clone().into()));
    }
    let after = b.link.counters();
    let refused = |c: &LinkCounters| c.frames_repeated + c.frames_foreign + c.frames_forged + c.frames_stale;
    assert_eq!((refused(after) - refused(&before)) as usize, recorded.len());
    let mut stranger =
        End::new(config(400, 1, 1, &[LinkKey { number: 1, secret: [9; 32] }]), 9, BTreeMap::new());
    stranger.give(2_000, Event::Deadline);
    for (carrier, frame) in stranger.frames {
        b.give(2_000, Event::Frame(carrier, frame.into()));
    }
    assert!(b.link.counters().frames_forged > 0 && b.frames.is_empty() && b.numbers() == [1]);
}

#[test]
fn another_version_is_told_once() {
    let (_, mut b) = pair(1, &[]);
    for number in 0..5 {
        b.give(10, Event::Frame(CarrierId(0), vec![5 << 5, 1, 0, number].into()));
    }
    assert_eq!((b.notes.len(), b.link.counters().frames_foreign), (1, 5));
    assert!(b.notes[0].contains("version 5"), "{:?}", b.notes);
}

#[test]
fn silence_is_kept_and_commands_wait_or_expire_in_it() {
    let (mut a, mut b) = pair(1, &[]);
    run(&mut a, &mut b, 10, 1_000, |_, _| true);
    a.give(1_000, Event::Silent(true));
    a.offer(1_000, 1, envelope(1, b"later"), Class::Command);
    let mut short = envelope(2, b"soon");
    short.stamp.lifespan_left_ms = Some(5_000);
    a.offer(1_000, 2, short, Class::Command);
    run(&mut a, &mut b, 1_000, 20_000, |_, frame| frame[0] != 0 && frame.is_empty());
    assert!(b.numbers().is_empty());
    assert!(a.tickets.contains(&(Ticket(2), TicketState::Expired { tries: 0 })), "{:?}", a.tickets);
    let sent = a.link.counters().frames_sent;
    run(&mut a, &mut b, 20_000, 30_000, |_, _| true);
    assert_eq!(a.link.counters().frames_sent, sent);
    a.give(30_000, Event::Silent(false));
    run(&mut a, &mut b, 30_000, 34_000, |_, _| true);
    assert_eq!(b.numbers(), [1]);
}

#[test]
fn what_cannot_be_in_time_is_refused_with_the_estimate() {
    let (mut a, mut b) = pair(1, &[]);
    run(&mut a, &mut b, 10, 1_000, |_, _| true);
    let mut hopeless = envelope(1, &[0; 4_000]);
    hopeless.stamp.lifespan_left_ms = Some(300);
    a.offer(1_000, 1, hopeless, Class::Command);
    assert!(
        matches!(a.tickets[..], [(Ticket(1), TicketState::Refused(Reason::TooSlow { .. }))]),
        "{:?}",
        a.tickets
    );
    let mut back = envelope(2, b"");
    back.stamp.via = [entity(7), entity(1)].into_iter().collect();
    a.offer(1_000, 2, back, Class::Command);
    assert_eq!(a.tickets[1], (Ticket(2), TicketState::Refused(Reason::Loop)));
}

#[test]
fn a_long_command_and_a_recording_arrive_in_pieces() {
    static LONG: [u8; 5_000] = [3; 5_000];
    let (mut a, mut b) = pair(1, &[]);
    a.offer(10, 1, envelope(1, &LONG), Class::Command);
    a.offer(10, 2, envelope(2, &LONG), Class::Bulk);
    let mut frames = 0;
    run(&mut a, &mut b, 10, 20_000, |_, _| {
        frames += 1;
        frames % 3 != 0
    });
    assert_eq!(b.numbers(), [1, 2]);
    assert!(b.delivered.iter().all(|delivery| delivery.envelope.message.content == LONG[..]));
}

#[test]
fn a_long_command_survives_a_restart_of_its_receiver_between_its_pieces() {
    static LONG: [u8; 2_000] = [4; 2_000];
    let (mut a, mut b) = pair(1, &[]);
    run(&mut a, &mut b, 10, 1_000, |_, _| true);
    a.offer(1_000, 1, envelope(1, &LONG), Class::Command);
    run(&mut a, &mut b, 1_000, 1_120, |_, _| true);
    assert!(b.numbers().is_empty() && a.tickets.len() == 1, "some of its pieces are through");
    let mut b = End::new(config(1, 400, 1, &[]), 2, b.journal.clone());
    run(&mut a, &mut b, 1_120, 6_000, |_, _| true);
    assert_eq!(b.numbers(), [1]);
    assert!(matches!(a.tickets.last(), Some((_, TicketState::Delivered { .. }))));
}

#[test]
fn late_word_of_a_piece_is_no_word_of_the_whole() {
    static LONG: [u8; 600] = [5; 600];
    let (mut a, mut b) = pair(1, &[]);
    a.offer(10, 1, envelope(1, b"names are agreed"), Class::Command);
    run(&mut a, &mut b, 10, 2_000, |_, _| true);
    let mut short = envelope(2, &LONG);
    short.stamp.lifespan_left_ms = Some(500);
    a.offer(2_000, 2, short, Class::Command);
    // Only the first piece arrives, and its acknowledgement waits on its way back.
    let mut pieces = 0;
    for at in (2_000..2_700).step_by(10) {
        carry(&mut a, &mut b, at, &mut |_, _| {
            pieces += 1;
            pieces == 1
        });
    }
    assert!(pieces > 2 && matches!(a.tickets.last(), Some((_, TicketState::Expired { tries: 1.. }))));
    carry(&mut b, &mut a, 2_700, &mut |_, _| true);
    assert!(matches!(a.tickets.last(), Some((_, TicketState::Expired { .. }))), "{:?}", a.tickets.last());
    assert_eq!(b.numbers(), [1]);
}

#[test]
fn a_cancelled_command_does_not_arrive_and_does_not_hold_others_up() {
    let (mut a, mut b) = pair(1, &[]);
    run(&mut a, &mut b, 10, 1_000, |_, _| true);
    for number in 1..=3 {
        a.offer(1_000, number, envelope(number, b"go"), Class::Command);
    }
    run(&mut a, &mut b, 1_000, 1_500, |_, _| false);
    a.give(1_500, Event::Cancel(Ticket(2)));
    run(&mut a, &mut b, 1_500, 6_000, |_, _| true);
    assert_eq!(b.numbers(), [1, 3]);
}

#[test]
fn a_frame_shows_its_sender_where_it_says_hello() {
    let mut a = End::new(config(400, 1, 1, &keys()), 1, BTreeMap::new());
    a.give(10, Event::Deadline);
    assert_eq!(sender_of(&a.frames[0].1), Some((entity(400), entity(1))));
    assert_eq!(sender_of(&[0x20, 1, 0, 0]), None);
    assert_eq!(sender_of(&[]), None);
}

/// A frame of an end that is well on its way, and the ends.
fn under_way() -> (End, End, Vec<Vec<u8>>) {
    let (mut a, mut b) = pair(1, &[]);
    let mut frames = Vec::new();
    let label = |address: &str| {
        let mut envelope = envelope(1, b"x");
        let label = (*envelope.message.label).clone();
        envelope.message.label = Arc::new(Label { address: Address::new(address).unwrap(), ..label });
        envelope
    };
    a.offer(10, 1, label("eid1sid2"), Class::Command);
    a.offer(10, 0, label("eid1sid3"), Class::State);
    a.offer(10, 2, envelope(1, &[1; 900]), Class::Bulk);
    run(&mut a, &mut b, 10, 3_000, |_, frame| {
        frames.push(frame.to_vec());
        true
    });
    (a, b, frames)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn strange_frames_are_not_answered_and_break_nothing(
        strange in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), any::<u8>()), 1..60),
        noise in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..80), 0..20),
    ) {
        let (mut a, mut b, frames) = under_way();
        for (which, place, value) in strange {
            let mut frame = which.get(&frames).clone();
            // The head and the hello stay: what is behind them is reached.
            let skip = frame.len().min(4);
            if frame.len() > skip {
                let place = skip + place.index(frame.len() - skip);
                frame[place] = value;
            }
            b.give(3_000, Event::Frame(CarrierId(0), frame.into()));
        }
        for frame in noise {
            b.give(3_000, Event::Frame(CarrierId(0), frame.into()));
            b.give(3_000, Event::Frame(CarrierId(9), Bytes::new()));
        }
        // Whatever came, the link goes on: a new life of the peer is heard.
        let mut a2 = End::new(config(400, 1, 1, &[]), u64::MAX, a.journal.clone());
        std::mem::swap(&mut a, &mut a2);
        run(&mut a, &mut b, 3_010, 4_000, |_, _| true);
    }

    #[test]
    fn with_keys_no_stranger_is_answered(noise in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..99), 1..60)) {
        let (mut a, mut b) = pair(1, &keys());
        run(&mut a, &mut b, 10, 1_000, |_, _| true);
        b.give(1_000, Event::Deadline);
        b.frames.clear();
        let received = b.link.counters().frames_received;
        for mut frame in noise {
            if let Some(first) = frame.first_mut() {
                // The version is right.
                *first = 0x20 | *first & 0x1e;
            }
            b.give(1_000, Event::Frame(CarrierId(0), frame.into()));
        }
        prop_assert!(b.frames.is_empty());
        prop_assert_eq!(b.link.counters().frames_received, received);
    }
}

/// What a link wants written because of an event, and what else it wants.
fn persisted(end: &mut End, at: u64, event: Event) -> (Option<(BatchId, Vec<Record>)>, Vec<Effect>) {
    let mut effects = Vec::new();
    end.link.handle(now(at), &mut vec![event], &mut effects);
    let batch = effects.iter().find_map(|effect| match effect {
        Effect::Persist(batch, records) => Some((*batch, records.clone())),
        _ => None,
    });
    (batch, effects)
}

#[test]
fn of_what_the_journal_refuses_commands_are_told_and_names_are_written_later() {
    let (mut a, _) = pair(1, &[]);
    let offer = Offer::new(Ticket(5), envelope(7, b"take off"), Class::Command);
    let (batch, _) = persisted(&mut a, 1_000, Event::Offer(offer));
    let (batch, records) = batch.unwrap();
    let (again, effects) = persisted(&mut a, 1_001, Event::WriteFailed(batch, "full".into()));
    assert!(again.is_none(), "not at once");
    let refused = |effect: &Effect| matches!(effect, Effect::Ticket(Ticket(5), TicketState::Refused(Reason::Journal(why))) if why == "full");
    assert!(effects.iter().any(refused), "{effects:?}");
    let (later, effects) = persisted(&mut a, 2_001, Event::Deadline);
    let (second, later) = later.unwrap();
    assert!(!effects.iter().any(|effect| matches!(effect, Effect::Ticket(..))));
    // All keys are there again; of them the command alone is forgotten now.
    let keys = |records: &[Record]| records.iter().map(|r| r.key().clone()).collect::<Vec<_>>();
    let (mut before, mut after) = (keys(&records), keys(&later));
    before.sort();
    after.sort();
    assert_eq!(before, after);
    let forgotten = later.iter().filter(|record| matches!(record, Record::Forget { .. })).count();
    assert_eq!(forgotten, 1);
    // The names go out once they are written.
    assert_eq!(a.link.waiting().0, 2, "a label and an origin");
    persisted(&mut a, 2_002, Event::Written(second));
    let (_, effects) = persisted(&mut a, 2_500, Event::Deadline);
    assert!(effects.iter().any(|effect| matches!(effect, Effect::Transmit(..))), "{effects:?}");
}
