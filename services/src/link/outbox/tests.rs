use super::*;
use aldis_envelope::Wall;

fn at(milliseconds: u64) -> Monotonic {
    Monotonic::since_start(Duration::from_millis(milliseconds))
}

fn entry(ticket: u64, expires: Option<u64>, body: usize) -> Entry {
    Entry {
        ticket: Ticket(ticket),
        accepted: at(0),
        expires: expires.map(at),
        stream: 1,
        after: 0,
        urgency: 5,
        body: vec![7; body].into(),
    }
}

fn hedge() -> Hedge {
    let round_trip = Duration::from_millis(600);
    Hedge { loss: 0.0, timeout: round_trip, round_trip, bytes_of_a_second: 1_200, probing: false }
}

fn filled(expires: &[Option<u64>]) -> Outbox {
    let mut outbox = Outbox::new();
    for (ticket, expires) in expires.iter().enumerate() {
        let number = outbox.add(entry(ticket as u64 + 1, *expires, 40));
        outbox.release(number);
    }
    outbox
}

#[test]
fn the_nearest_deadline_goes_first_and_each_names_the_one_before() {
    let mut outbox = filled(&[None, Some(9_000), Some(5_000)]);
    let take = |outbox: &mut Outbox| outbox.take(at(0), 250, 250, &hedge()).map(|(number, ..)| number);
    assert_eq!([take(&mut outbox), take(&mut outbox), take(&mut outbox)], [Some(3), Some(2), Some(1)]);
    assert_eq!(outbox.take(at(0), 250, 250, &hedge()), None);
    assert_eq!(outbox.item(3, 0, 40, at(0)).unwrap().after, 2);
    assert_eq!(outbox.item(3, 0, 40, at(1_000)).unwrap().lifespan, Some(62));
    assert!(outbox.is_due(at(700)));
}

#[test]
fn what_does_not_fit_beside_others_waits_for_its_own_frame_and_what_is_larger_is_cut() {
    let mut outbox = Outbox::new();
    for body in [200, 600] {
        let number = outbox.add(entry(1, None, body));
        outbox.release(number);
    }
    assert_eq!(outbox.take(at(0), 100, 250, &hedge()), None);
    assert_eq!(outbox.take(at(0), 250, 250, &hedge()), Some((1, 0, 200)));
    let mut pieces = Vec::new();
    while let Some((2, start, end)) = outbox.take(at(0), 250, 250, &hedge()) {
        pieces.push((start, end));
    }
    assert_eq!((pieces[0].0, pieces.last().unwrap().1, pieces.len()), (0, 600, 3));
    assert!(pieces.windows(2).all(|pair| pair[0].1 == pair[1].0));
    assert!(outbox.arrived(2, pieces[0].0, pieces[0].1).is_none());
    assert!(outbox.arrived(2, pieces[1].0, 600).is_some());
}

#[test]
fn word_of_an_earlier_copy_leaves_no_piece_out() {
    let mut outbox = Outbox::new();
    let number = outbox.add(entry(1, None, 600));
    outbox.release(number);
    while outbox.take(at(0), 250, 250, &hedge()).is_some() {}
    // The second copy is under way when word comes that all but the first piece of the former arrived.
    let (_, start, end) = outbox.take(at(60_000), 250, 250, &hedge()).unwrap();
    assert_eq!(start, 0);
    assert!(outbox.arrived(number, end, 600).is_none());
    assert_eq!(outbox.take(at(60_000), 250, 250, &hedge()), Some((number, 0, end)));
}

#[test]
fn what_expires_is_void_and_told() {
    let mut outbox = filled(&[Some(500), None]);
    assert!(outbox.expire(at(499)).is_none());
    let left = outbox.expire(at(500)).unwrap();
    assert_eq!((left.entry.ticket, left.tries, outbox.len()), (Ticket(1), 0, 1));
    assert!(outbox.voids.contains(1) && outbox.floor() == 2);
}

#[test]
fn a_command_comes_back_from_the_journal_with_no_more_time_than_it_had() {
    let outbox = filled(&[Some(60_000), None]);
    let now =
        |milliseconds: u64, wall: i64| Now { monotonic: at(milliseconds), wall: Wall(wall * 1_000_000) };
    let values = [1, 2].map(|number| outbox.encode(number, now(10_000, 500_000)).unwrap());
    for (wall, left) in [(510_000, 40_000), (100_000, 50_000), (900_000, 0)] {
        let mut restored = Outbox::new();
        for (number, value) in [1, 2].into_iter().zip(&values) {
            restored.restore(number, value, now(3_000, wall)).unwrap();
        }
        restored.resume(1_000);
        let expires = restored.entry(1).unwrap().expires.unwrap();
        assert_eq!(expires - at(3_000), Duration::from_millis(left), "at {wall}");
        assert_eq!((restored.next(), restored.floor(), restored.entry(2).unwrap().after), (1_000, 1, 1));
        assert!(restored.voids.covers(3, 1_000) && !restored.voids.contains(2));
    }
    assert!(Outbox::new().restore(1, &[1], now(0, 0)).is_err());
}
