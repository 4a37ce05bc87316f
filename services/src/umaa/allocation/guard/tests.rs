//! What a guard believes, by its own clock.

use super::*;
use crate::umaa::tests::bus::{guids, source};
use aldis_envelope::umaa::{
    ResourceAllocationControlInfo, ResourceAllocationControlSession, ResourceAllocationDefinition, Sequence,
};
use aldis_envelope::{BootId, Message, Priority, Stamp};

const RESOURCE: Guid = Guid([0xA; 16]);
const ONE: Guid = Guid([1; 16]);
const OTHER: Guid = Guid([2; 16]);

fn now(seconds: f64) -> Now {
    // A wall clock that is wrong by years.
    Now { monotonic: Monotonic::since_start(Duration::from_secs_f64(seconds)), wall: Wall(-1) }
}

fn envelope(message: Message) -> Envelope {
    let (node, boot, sequence, source_time) = (message.label.source().entity, BootId(1), 1, Wall(0));
    let (lifespan_left_ms, priority, skipped, via) = (None, Priority::Data, 0, Default::default());
    Envelope {
        message,
        stamp: Stamp { node, boot, sequence, source_time, lifespan_left_ms, priority, skipped, via },
    }
}

struct Watch {
    guard: Guard,
    out: Outbox,
}

impl Watch {
    fn new() -> Self {
        let guard = Guard::new(source(400, 100), guids(), GuardSettings::new(RESOURCE));
        let mut watch = Self { guard, out: Outbox::new(source(400, 100)) };
        watch.guard.observe(now(0.0), &Input::HistoryComplete(true), &mut watch.out);
        watch
    }

    fn hear(&mut self, at: f64, arbiter: Source, holder: Option<(Guid, Option<i64>)>) {
        let time_stamp = Wall(1_000_000_000).into();
        let end = |seconds: i64| Wall(1_000_000_000 + seconds * 1_000_000_000).into();
        let session = |(controlling_consumer, ends): (Guid, Option<i64>)| ResourceAllocationControlSession {
            controlling_consumer,
            end_time: ends.map(end),
        };
        let info =
            ResourceAllocationControlInfo { control_session: holder.map(session), resource_id: RESOURCE };
        let control_info = Sequence::new(vec![info]).unwrap();
        let report =
            ResourceAllocationReport { control_info, time_stamp, source: guids().of_service(arbiter) };
        let message = umaa::put(umaa::label::<ResourceAllocationReport>(arbiter).unwrap(), &report);
        self.pass(at);
        self.guard.observe(now(at), &Input::Message(&envelope(message)), &mut self.out);
    }

    /// Time passes, and the guard is given its deadlines.
    fn pass(&mut self, until: f64) {
        while let Some(at) = self.guard.next_deadline().filter(|at| *at <= now(until).monotonic) {
            let at = Now { monotonic: at, ..now(0.0) };
            self.guard.observe(at, &Input::Deadline, &mut self.out);
        }
    }

    fn end(&mut self, at: f64, arbiter: Source, change: Change) {
        let label = umaa::label::<ResourceAllocationReport>(arbiter).unwrap();
        let message = umaa::about_instance(label, change, SourceKey { source: guids().of_service(arbiter) });
        self.guard.observe(now(at), &Input::Message(&envelope(message)), &mut self.out);
    }

    fn admits(&self, at: f64, consumer: Guid) -> bool {
        self.guard.admits(now(at), consumer) == Verdict::Valid
    }
}

fn arbiter() -> Source {
    source(400, 10)
}

#[test]
fn time_left_is_counted_from_the_reports_own_stamp() {
    let mut watch = Watch::new();
    watch.hear(10.0, arbiter(), Some((ONE, Some(3))));
    assert!(watch.admits(12.9, ONE) && !watch.admits(12.9, OTHER));
    assert!(!watch.admits(13.0, ONE));
    // A running command goes on all the same.
    assert_eq!(watch.guard.ends(now(13.0), ONE), None);
    assert_eq!(watch.guard.ends(now(13.0), OTHER), None);
}

#[test]
fn a_copy_that_is_not_repeated_names_nobody() {
    let mut watch = Watch::new();
    watch.hear(10.0, arbiter(), Some((ONE, None)));
    assert!(watch.admits(15.9, ONE));
    assert!(!watch.admits(16.0, ONE));
    watch.hear(17.0, arbiter(), Some((ONE, None)));
    assert!(watch.admits(17.0, ONE));
}

#[test]
fn no_contact_means_no_holder_and_ends_no_command() {
    let lose: [fn(&mut Watch); 4] = [
        |watch| watch.guard.observe(now(1.0), &Input::Token(arbiter(), false), &mut watch.out),
        |watch| watch.guard.observe(now(1.0), &Input::Bus(false), &mut watch.out),
        |watch| watch.end(1.0, source(401, 10), Change::Unregister),
        |watch| watch.end(1.0, source(401, 10), Change::Dispose),
    ];
    for (place, lose) in lose.into_iter().enumerate() {
        let mut watch = Watch::new();
        // The last two are said by the arbiter that reports, and the bus does not matter to one on the own entity.
        let from = if place == 0 { arbiter() } else { source(401, 10) };
        watch.hear(0.5, from, Some((ONE, None)));
        assert!(watch.admits(0.9, ONE) && watch.guard.ends(now(0.9), OTHER).is_some());
        lose(&mut watch);
        assert!(!watch.admits(1.0, ONE), "{place}");
        assert_eq!(watch.guard.ends(now(1.0), OTHER), None);
    }
}

#[test]
fn an_arbiter_on_the_own_entity_is_heard_without_a_bus() {
    let mut watch = Watch::new();
    watch.hear(0.5, arbiter(), Some((ONE, None)));
    watch.guard.observe(now(1.0), &Input::Bus(false), &mut watch.out);
    assert!(watch.admits(1.0, ONE));
}

#[test]
fn what_was_retained_before_is_believed_once_it_is_repeated() {
    let guard = Guard::new(source(400, 100), guids(), GuardSettings::new(RESOURCE));
    let mut watch = Watch { guard, out: Outbox::new(source(400, 100)) };
    watch.hear(0.0, arbiter(), Some((ONE, Some(60))));
    watch.guard.observe(now(0.0), &Input::HistoryComplete(true), &mut watch.out);
    // Its age is not known, so the answer waits for the next repetition, but not for ever.
    assert_eq!(watch.guard.admits(now(1.0), ONE), Verdict::Later);
    // What it executed for another in a former life ends at once: the one who is named may be in control already.
    assert!(watch.guard.ends(now(0.0), OTHER).is_some());
    assert_eq!(watch.guard.ends(now(0.0), ONE), None);
    watch.hear(2.0, arbiter(), Some((ONE, Some(58))));
    assert!(watch.admits(2.0, ONE));
    let guard = Guard::new(source(400, 100), guids(), GuardSettings::new(RESOURCE));
    let mut silent = Watch { guard, out: Outbox::new(source(400, 100)) };
    silent.guard.observe(now(0.0), &Input::HistoryComplete(true), &mut silent.out);
    silent.pass(6.0);
    assert!(matches!(silent.guard.admits(now(6.0), ONE), Verdict::Failed(_)));
}

#[test]
fn what_has_waited_while_the_guard_stood_still_is_no_news() {
    let mut watch = Watch::new();
    watch.hear(1.0, arbiter(), Some((ONE, None)));
    // Nothing until now: what comes now may have been said long ago.
    let late = now(25.0);
    watch.guard.observe(late, &Input::Deadline, &mut watch.out);
    watch.hear(25.0, arbiter(), Some((ONE, None)));
    assert_eq!(watch.guard.admits(late, ONE), Verdict::Later);
    // A repetition later it is news again.
    watch.hear(27.5, arbiter(), Some((OTHER, None)));
    assert!(watch.admits(27.5, OTHER) && !watch.admits(27.5, ONE));
}

#[test]
fn two_arbiters_are_believed_neither() {
    let mut watch = Watch::new();
    watch.hear(1.0, arbiter(), Some((ONE, None)));
    watch.hear(1.0, source(401, 10), None);
    assert!(!watch.admits(1.0, ONE));
    assert_eq!(watch.guard.ends(now(1.0), OTHER), None);
    watch.end(2.0, source(401, 10), Change::Dispose);
    assert!(watch.admits(2.0, ONE));
}

#[test]
fn reports_in_the_name_of_another_are_passed_over() {
    let mut watch = Watch::new();
    watch.hear(1.0, arbiter(), Some((ONE, None)));
    let pirate = source(666, 10);
    let label = umaa::label::<ResourceAllocationReport>(pirate).unwrap();
    let info = ResourceAllocationControlInfo {
        control_session: Some(ResourceAllocationControlSession {
            controlling_consumer: OTHER,
            end_time: None,
        }),
        resource_id: RESOURCE,
    };
    let report = ResourceAllocationReport {
        control_info: Sequence::new(vec![info]).unwrap(),
        time_stamp: Wall(0).into(),
        source: guids().of_service(arbiter()),
    };
    for message in [umaa::put(label.clone(), &report), umaa::dispose(label, &report)] {
        watch.guard.observe(now(1.0), &Input::Message(&envelope(message)), &mut watch.out);
        assert!(watch.admits(1.0, ONE) && !watch.admits(1.0, OTHER));
    }
}

#[test]
fn providers_of_the_resource_need_no_control() {
    let mut watch = Watch::new();
    let definition = ResourceAllocationDefinition {
        related_sources: Sequence::new(vec![OTHER]).unwrap(),
        resource_id: RESOURCE,
    };
    let report = ResourceAllocationConfigReport {
        resources: Sequence::new(vec![definition]).unwrap(),
        time_stamp: Wall(0).into(),
        source: guids().of_service(arbiter()),
    };
    let label = umaa::label::<ResourceAllocationConfigReport>(arbiter()).unwrap();
    let told = envelope(umaa::put(label.clone(), &report));
    watch.guard.observe(now(1.0), &Input::Message(&told), &mut watch.out);
    watch.hear(1.0, arbiter(), Some((ONE, None)));
    assert!(watch.admits(1.0, OTHER) && watch.admits(100.0, OTHER));
    assert_eq!(watch.guard.ends(now(1.0), OTHER), None);
    let gone = envelope(umaa::dispose(label, &report));
    watch.guard.observe(now(2.0), &Input::Message(&gone), &mut watch.out);
    assert!(!watch.admits(2.0, OTHER));
}
