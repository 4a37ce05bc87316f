//! An arbiter, a guarded provider and consumers that contend, on a bus that is watched.

use super::*;
use crate::umaa::allocation::{Plan, Resource};
use crate::umaa::command::{Consumer, ConsumerSettings, Told};
use crate::umaa::tests::asking::Handle;
use crate::umaa::tests::bus::{guids, source};
use crate::umaa::tests::sea::{
    AUTOPILOT, Ordering, Sea, add, add_arbiter, allocating, arbiter, ask, autopilot, captain, control_told,
    controlling, guid, sea, sea_with, settings, steersman, told,
};
use crate::umaa::tests::vector::{VectorCommand, steer};
use aldis_envelope::umaa::{self, ResourceAllocationPriorityReport, ResourceAllocationReport, Topic};
use aldis_envelope::{DateTime, Wall};

const ALL: &str = "ISSUED COMMANDED EXECUTING";

#[test]
fn control_is_given_reported_and_ends_with_its_duration() {
    let mut sea = sea();
    let one = allocating(&mut sea.bus, captain(1));
    assert_eq!(sea.holder(), None);
    sea.allocate(&one, captain(1), Some(3.0));
    sea.run(1.0);
    assert_eq!((told(one.take()).as_str(), sea.holder()), (ALL, Some(guid(captain(1)))));
    sea.run(3.0);
    assert_eq!((told(one.take()).as_str(), sea.holder()), ("Completed", None));
    sea.is_clean();
}

#[test]
fn a_release_gives_control_back() {
    let mut sea = sea();
    let one = allocating(&mut sea.bus, captain(1));
    let session = sea.allocate(&one, captain(1), None);
    sea.run(1.0);
    sea.wish(&one, captain(1), move |consumer, now, out| consumer.cancel(now, session, out));
    sea.run(1.0);
    assert_eq!((told(one.take()), sea.holder()), (format!("{ALL} Canceled"), None));
    sea.is_clean();
}

#[test]
fn a_renewal_keeps_control_throughout() {
    let mut sea = sea();
    let one = allocating(&mut sea.bus, captain(1));
    let session = sea.allocate(&one, captain(1), Some(3.0));
    for _ in 0..3 {
        sea.run(2.0);
        sea.wish(&one, captain(1), move |consumer, now, out| {
            consumer.update(now, session, ask(Some(3.0)), out).unwrap();
        });
        for _ in 0..20 {
            sea.run(0.001);
            assert_eq!(sea.holder(), Some(guid(captain(1))));
        }
    }
    let renewal = "ISSUED/UPDATED COMMANDED EXECUTING";
    assert_eq!(told(one.take()), format!("{ALL} {renewal} {renewal} {renewal}"));
    sea.run(4.0);
    assert_eq!((told(one.take()).as_str(), sea.holder()), ("Completed", None));
    sea.is_clean();
}

#[test]
fn who_is_not_on_the_list_or_goes_after_the_holder_is_rejected() {
    let mut sea = sea();
    let (one, two) = (allocating(&mut sea.bus, captain(1)), allocating(&mut sea.bus, captain(2)));
    let stranger = allocating(&mut sea.bus, captain(3));
    sea.allocate(&stranger, captain(3), None);
    sea.allocate(&two, captain(2), None);
    sea.run(1.0);
    sea.allocate(&one, captain(1), None);
    sea.run(1.0);
    let rejected = "ISSUED COMMANDED FAILED/RESOURCE_REJECTED";
    assert_eq!((told(stranger.take()).as_str(), told(one.take()).as_str()), (rejected, rejected));
    assert_eq!((told(two.take()).as_str(), sea.holder()), (ALL, Some(guid(captain(2)))));
    sea.is_lawful();
}

#[test]
fn nobody_controls_before_a_list_is_set() {
    let mut sea = sea_with(settings(Resource { priorities: Vec::new(), ..autopilot() }));
    let one = allocating(&mut sea.bus, captain(1));
    sea.allocate(&one, captain(1), None);
    sea.run(1.0);
    assert_eq!(told(one.take()), "ISSUED COMMANDED FAILED/RESOURCE_REJECTED");
    sea.is_clean();
}

#[test]
fn a_take_over_ends_the_loser_before_the_winner_begins() {
    let mut sea = sea();
    let (one, two) = (controlling(&mut sea.bus, captain(1)), controlling(&mut sea.bus, captain(2)));
    sea.order(&one, captain(1), steer(10.0, 60, ""));
    sea.run(2.0);
    assert_eq!(control_told(one.take()), format!("allocated {ALL} status"));
    sea.order(&two, captain(2), steer(20.0, 5, ""));
    for _ in 0..2000 {
        sea.run(0.0005);
        sea.is_lawful();
    }
    let lost = control_told(one.take());
    assert!(lost.contains("lost:FAILED/INTERRUPTED") && lost.ends_with("FAILED/INTERRUPTED"), "{lost}");
    sea.run(10.0);
    assert_eq!(control_told(two.take()), format!("allocated {ALL} status Completed"));
    assert_eq!(*sea.asked.lock().unwrap(), ["start 10", "stop 10 Broken", "start 20"]);
    assert_eq!(sea.holder(), None);
    sea.is_clean();
}

#[test]
fn a_command_without_control_is_rejected() {
    let mut sea = sea();
    let two = allocating(&mut sea.bus, captain(2));
    sea.allocate(&two, captain(2), None);
    let pirate = add(&mut sea.bus, captain(1), || {
        Consumer::<VectorCommand>::new(captain(1), guids(), ConsumerSettings::default())
    });
    sea.run(1.0);
    sea.wish(&pirate, captain(1), |consumer, now, out| {
        consumer.start(now, guid(steersman()), steer(10.0, 5, ""), out).unwrap();
    });
    sea.run(1.0);
    assert_eq!(told(pirate.take()), "ISSUED COMMANDED FAILED/RESOURCE_REJECTED");
    assert!(sea.asked.lock().unwrap().is_empty());
    sea.is_lawful();
}

#[test]
fn a_nested_provider_takes_the_commands_of_the_providers_of_its_resource() {
    let mut sea = sea();
    // One that commands the steersman in the name of the whole resource, whoever controls it.
    let upper = source(400, 101);
    let commanding = add(&mut sea.bus, upper, move || {
        Consumer::<VectorCommand>::new(upper, guids(), ConsumerSettings::default())
    });
    let two = allocating(&mut sea.bus, captain(2));
    sea.allocate(&two, captain(2), None);
    sea.run(1.0);
    sea.wish(&commanding, upper, |consumer, now, out| {
        consumer.start(now, guid(steersman()), steer(10.0, 3, ""), out).unwrap();
    });
    sea.run(5.0);
    assert_eq!(told(commanding.take()), format!("{ALL} status Completed"));
    assert_eq!(sea.bus.checker.violations, Vec::<String>::new());
}

#[test]
fn a_second_session_of_the_holder_replaces_the_first() {
    let mut sea = sea();
    let one = allocating(&mut sea.bus, captain(1));
    let first = sea.allocate(&one, captain(1), None);
    sea.run(1.0);
    one.take();
    let second = sea.allocate(&one, captain(1), None);
    sea.run(1.0);
    let (of_first, of_second): (Vec<_>, Vec<_>) = one.take().into_iter().partition(|told| match told {
        Told::State { session, .. } | Told::Ended { session, .. } => *session == first,
        _ => false,
    });
    assert_eq!((told(of_first).as_str(), told(of_second).as_str()), ("Completed", ALL));
    assert_eq!(sea.holder(), Some(guid(captain(1))));
    sea.wish(&one, captain(1), move |consumer, now, out| consumer.cancel(now, second, out));
    sea.run(1.0);
    sea.is_clean();
}

#[test]
fn a_session_that_is_replaced_before_it_has_control_never_says_that_it_had() {
    let mut sea = sea();
    let one = allocating(&mut sea.bus, captain(1));
    sea.run(1.0);
    // A reader does not confirm, so that nobody is in control yet.
    sea.bus.silence(arbiter(), steersman());
    sea.allocate(&one, captain(1), None);
    sea.run(0.1);
    sea.allocate(&one, captain(1), None);
    sea.run(0.1);
    assert_eq!(told(one.take()), "ISSUED COMMANDED ISSUED COMMANDED FAILED/INTERRUPTED");
    sea.bus.heal(arbiter(), steersman());
    sea.run(1.0);
    assert_eq!((told(one.take()).as_str(), sea.holder()), ("EXECUTING", Some(guid(captain(1)))));
    sea.is_lawful();
}

#[test]
fn control_waits_for_every_reader_and_fails_where_one_is_silent() {
    let mut sea = sea();
    let one = allocating(&mut sea.bus, captain(1));
    sea.bus.silence(arbiter(), steersman());
    sea.allocate(&one, captain(1), None);
    sea.run(4.0);
    assert_eq!(told(one.take()), "ISSUED COMMANDED");
    sea.run(2.0);
    assert_eq!((told(one.take()).as_str(), sea.holder()), ("FAILED/TIMEOUT", None));
    sea.bus.heal(arbiter(), steersman());
    sea.run(1.0);
    sea.allocate(&one, captain(1), None);
    sea.run(1.0);
    assert_eq!(told(one.take()), ALL);
    sea.is_lawful();
}

#[test]
fn a_reader_that_is_gone_is_not_waited_for_after_its_lease() {
    let mut sea = sea();
    let one = allocating(&mut sea.bus, captain(1));
    sea.bus.crash(steersman());
    sea.run(6.0);
    sea.allocate(&one, captain(1), None);
    sea.run(3.0);
    assert_eq!(told(one.take()), "ISSUED COMMANDED");
    sea.run(2.0);
    assert_eq!(told(one.take()), "EXECUTING");
    sea.is_lawful();
}

#[test]
fn a_guard_out_of_contact_lets_nobody_through_and_stops_nobody() {
    let mut sea = sea();
    let one = controlling(&mut sea.bus, captain(1));
    sea.order(&one, captain(1), steer(10.0, 30, ""));
    sea.run(2.0);
    one.take();
    sea.bus.silence(arbiter(), steersman());
    sea.run(9.0);
    sea.wish(&one, captain(1), |consumer, now, out| {
        let plan = Plan {
            arbiter: guid(arbiter()),
            resource: AUTOPILOT,
            duration: None,
            provider: guid(steersman()),
            command: steer(20.0, 5, ""),
        };
        consumer.start(now, plan, out).unwrap();
    });
    sea.run(10.0);
    assert!(!sea.asked.lock().unwrap().contains(&"start 20".to_owned()));
    assert!(!sea.asked.lock().unwrap().iter().any(|asked| asked.starts_with("stop")));
    sea.bus.heal(arbiter(), steersman());
    sea.run(30.0);
    assert!(control_told(one.take()).contains("Completed"));
    assert_eq!(sea.bus.checker.violations, Vec::<String>::new());
}

#[test]
fn two_arbiters_of_one_resource_are_told_and_neither_is_believed() {
    let mut sea = sea();
    let one = controlling(&mut sea.bus, captain(1));
    let rival = source(401, 10);
    add_arbiter(&mut sea.bus, rival, settings(autopilot()));
    sea.run(1.0);
    sea.order(&one, captain(1), steer(10.0, 30, ""));
    sea.run(3.0);
    assert_eq!(control_told(one.take()), "allocated ISSUED COMMANDED FAILED/RESOURCE_REJECTED");
    let notes = sea.bus.notes.join("\n");
    assert!(notes.contains("allocates autopilot too"), "{notes}");
    assert!(notes.contains("2 arbiters report"), "{notes}");
    sea.bus.shut_down(rival);
    sea.run(1.0);
    sea.order(&one, captain(1), steer(20.0, 1, ""));
    sea.run(3.0);
    assert!(control_told(one.take()).ends_with("Completed"));
}

fn set(bus: &mut Sea, handle: &Handle<Ordering>, at: Source, priorities: Vec<Guid>, resource: Guid) {
    bus.wish(handle, at, move |consumer, now, out| {
        let command = ResourceAllocationPriorityCommand {
            priorities: Sequence::new(priorities).unwrap(),
            resource_id: resource,
            time_stamp: DateTime::default(),
            source: Guid::NIL,
            session_id: Guid::NIL,
            destination: Guid::NIL,
        };
        consumer.start(now, guid(arbiter()), command, out).unwrap();
    });
    bus.run(1.0);
}

fn reported(sea: &Sea) -> Vec<Guid> {
    let reports = sea.bus.retained(ResourceAllocationPriorityReport::NAME);
    let report: ResourceAllocationPriorityReport = umaa::decode(&reports[0].message.content).unwrap();
    report.priorities[0].priorities.to_vec()
}

#[test]
fn a_list_is_set_by_command_reported_and_kept_by_the_next_life() {
    let mut sea = sea();
    let at = source(2, 101);
    let ordering = add(&mut sea.bus, at, move || Ordering::new(at, guids(), ConsumerSettings::default()));
    let (one, two) = (allocating(&mut sea.bus, captain(1)), allocating(&mut sea.bus, captain(2)));
    sea.allocate(&two, captain(2), None);
    sea.run(1.0);
    let turned = vec![guid(captain(2)), guid(captain(1))];
    set(&mut sea, &ordering, at, turned.clone(), AUTOPILOT);
    assert_eq!(told(ordering.take()), format!("{ALL} Completed"));
    assert_eq!((reported(&sea), sea.holder()), (turned.clone(), Some(guid(captain(2)))));
    sea.bus.crash(arbiter());
    sea.bus.start(arbiter());
    sea.run(1.0);
    assert_eq!((reported(&sea), sea.holder()), (turned, Some(guid(captain(2)))));
    assert!(sea.bus.notes.iter().any(|note| note.contains("recover_priorities")), "{:?}", sea.bus.notes);
    sea.allocate(&one, captain(1), None);
    sea.run(1.0);
    assert_eq!(told(one.take()), ALL);
    assert_eq!(told(two.take()), format!("{ALL} FAILED/INTERRUPTED"));
    sea.is_lawful();
}

#[test]
fn a_list_that_cannot_be_or_from_whom_it_may_not_is_refused() {
    let mut sea = sea();
    let (may, may_not) = (source(2, 101), source(3, 101));
    let make = |at: Source| move || Ordering::new(at, guids(), ConsumerSettings::default());
    let (allowed, forbidden) = (add(&mut sea.bus, may, make(may)), add(&mut sea.bus, may_not, make(may_not)));
    let before = reported(&sea);
    let twice = vec![guid(captain(1)), guid(captain(1))];
    set(&mut sea, &allowed, may, twice, AUTOPILOT);
    set(&mut sea, &allowed, may, Vec::new(), Guid([0xB; 16]));
    set(&mut sea, &forbidden, may_not, Vec::new(), AUTOPILOT);
    let invalid = "ISSUED FAILED/VALIDATION_FAILED";
    assert_eq!(told(allowed.take()), format!("{invalid} {invalid}"));
    assert_eq!(told(forbidden.take()), "ISSUED COMMANDED FAILED/RESOURCE_REJECTED");
    assert_eq!(reported(&sea), before);
    sea.is_clean();
}

#[test]
fn an_arbiter_that_lost_its_process_keeps_who_is_in_control_until_the_same_end() {
    let mut sea = sea();
    let one = allocating(&mut sea.bus, captain(1));
    sea.allocate(&one, captain(1), Some(10.0));
    sea.run(2.0);
    sea.bus.crash(arbiter());
    sea.run(3.0);
    assert_eq!(sea.holder(), Some(guid(captain(1))));
    sea.bus.start(arbiter());
    sea.run(4.5);
    assert_eq!((told(one.take()).as_str(), sea.holder()), (ALL, Some(guid(captain(1)))));
    sea.run(1.0);
    assert_eq!((told(one.take()).as_str(), sea.holder()), ("Completed", None));
    sea.is_clean();
}

/// What a consumer was told of one of its sessions, and of the others.
fn of_session(all: Vec<Told<umaa::NoExecutionStatus>>, of: Guid) -> (String, String) {
    let (own, others) = all.into_iter().partition(|told| match told {
        Told::State { session, .. } | Told::Ended { session, .. } => *session == of,
        _ => false,
    });
    (told(own), told(others))
}

#[test]
fn a_session_that_is_replaced_before_it_had_control_never_executes() {
    let mut sea = sea();
    let one = allocating(&mut sea.bus, captain(1));
    sea.bus.silence(arbiter(), steersman());
    let first = sea.allocate(&one, captain(1), None);
    sea.run(1.0);
    sea.allocate(&one, captain(1), None);
    sea.run(1.0);
    sea.bus.heal(arbiter(), steersman());
    sea.run(1.0);
    let (of_first, of_second) = of_session(one.take(), first);
    assert_eq!(of_first, "ISSUED COMMANDED FAILED/INTERRUPTED");
    assert_eq!((of_second.as_str(), sea.holder()), (ALL, Some(guid(captain(1)))));
    sea.is_lawful();
}

#[test]
fn of_two_sessions_that_wait_when_the_arbiter_starts_again_one_executes_once_it_is_reported() {
    let mut sea = sea();
    let one = allocating(&mut sea.bus, captain(1));
    sea.bus.crash(arbiter());
    let first = sea.allocate(&one, captain(1), None);
    sea.run(0.5);
    sea.allocate(&one, captain(1), None);
    sea.run(0.5);
    sea.bus.start(arbiter());
    for _ in 0..1000 {
        sea.run(0.001);
        let executing = sea.bus.retained(<ResourceAllocationCommand as umaa::Command>::STATUS_NAME);
        let states = executing.iter().filter_map(|envelope| {
            let status =
                umaa::decode::<umaa::CommandStatus<ResourceAllocationCommand>>(&envelope.message.content);
            status.ok().map(|status| status.command_status)
        });
        if states.into_iter().any(|state| state == umaa::CommandState::Executing) {
            assert_eq!(sea.holder(), Some(guid(captain(1))), "nobody executes what is not reported");
        }
    }
    let (of_first, of_second) = of_session(one.take(), first);
    assert_eq!((of_first.as_str(), of_second.as_str()), ("ISSUED COMMANDED FAILED/INTERRUPTED", ALL));
    sea.is_lawful();
}

#[test]
fn who_was_in_control_before_a_restart_goes_before_who_came_meanwhile() {
    let mut sea = sea();
    let (one, two) = (allocating(&mut sea.bus, captain(1)), allocating(&mut sea.bus, captain(2)));
    sea.allocate(&two, captain(2), None);
    sea.run(1.0);
    sea.bus.crash(arbiter());
    sea.allocate(&one, captain(1), None);
    sea.run(0.5);
    sea.bus.start(arbiter());
    sea.run(1.0);
    assert_eq!((told(two.take()).as_str(), sea.holder()), (ALL, Some(guid(captain(2)))));
    assert_eq!(told(one.take()), "ISSUED COMMANDED FAILED/RESOURCE_REJECTED");
    sea.is_lawful();
}

#[test]
fn control_whose_consumer_has_gone_is_cleared_at_the_start_of_the_arbiter() {
    let mut sea = sea();
    let one = allocating(&mut sea.bus, captain(1));
    sea.allocate(&one, captain(1), None);
    sea.run(1.0);
    sea.bus.crash(arbiter());
    sea.bus.crash_with_its_disk(captain(1));
    sea.bus.start(captain(1));
    sea.bus.start(arbiter());
    sea.run(1.0);
    assert_eq!(sea.holder(), None);
    let statuses = sea.bus.retained(<ResourceAllocationCommand as umaa::Command>::STATUS_NAME);
    assert_eq!(statuses.len(), 0);
}

#[test]
fn a_holder_whose_command_is_not_there_when_the_arbiter_starts_again_is_none_beside_the_next() {
    let mut sea = sea();
    let (one, two) = (allocating(&mut sea.bus, captain(1)), allocating(&mut sea.bus, captain(2)));
    sea.allocate(&one, captain(1), None);
    sea.run(1.0);
    sea.bus.crash(arbiter());
    sea.bus.silence(arbiter(), captain(1));
    sea.bus.start(arbiter());
    sea.allocate(&two, captain(2), None);
    sea.run(10.0);
    assert_eq!((told(two.take()).as_str(), sea.holder()), (ALL, Some(guid(captain(2)))));
    sea.is_lawful();
    sea.bus.heal(arbiter(), captain(1));
    sea.run(1.0);
    assert_eq!(told(one.take()), format!("{ALL} FAILED/SERVICE_FAILED"));
    sea.is_lawful();
}

#[test]
fn a_shutdown_fails_what_is_open_and_ends_the_reports() {
    let mut sea = sea();
    let one = allocating(&mut sea.bus, captain(1));
    sea.allocate(&one, captain(1), None);
    sea.run(1.0);
    sea.bus.shut_down(arbiter());
    sea.run(1.0);
    assert_eq!(told(one.take()), format!("{ALL} FAILED/SERVICE_FAILED"));
    for name in [
        ResourceAllocationReport::NAME,
        ResourceAllocationPriorityReport::NAME,
        ResourceAllocationConfigReport::NAME,
    ] {
        assert_eq!(sea.bus.retained(name).len(), 0, "{name}");
    }
    sea.is_clean();
}

#[test]
fn a_holder_that_a_new_list_leaves_out_cannot_renew() {
    let mut sea = sea();
    let at = source(2, 101);
    let ordering = add(&mut sea.bus, at, move || Ordering::new(at, guids(), ConsumerSettings::default()));
    let one = allocating(&mut sea.bus, captain(1));
    let session = sea.allocate(&one, captain(1), None);
    sea.run(1.0);
    set(&mut sea, &ordering, at, vec![guid(captain(2))], AUTOPILOT);
    assert_eq!(sea.holder(), Some(guid(captain(1))));
    sea.wish(&one, captain(1), move |consumer, now, out| {
        consumer.update(now, session, ask(None), out).unwrap();
    });
    sea.run(1.0);
    assert_eq!(told(one.take()), format!("{ALL} ISSUED/UPDATED COMMANDED FAILED/RESOURCE_REJECTED"));
    assert_eq!(sea.holder(), None);
    sea.is_clean();
}

#[test]
fn end_times_are_those_of_the_arbiters_clock() {
    let mut sea = sea();
    let one = allocating(&mut sea.bus, captain(1));
    sea.allocate(&one, captain(1), Some(60.0));
    sea.run(1.0);
    let reports = sea.bus.retained(ResourceAllocationReport::NAME);
    let report: ResourceAllocationReport = umaa::decode(&reports[0].message.content).unwrap();
    let ends = report.control_info[0].control_session.unwrap().end_time.unwrap();
    let left = Wall::from(ends).0 - Wall::from(report.time_stamp).0;
    assert!((58_000_000_000..=60_000_000_000).contains(&left), "{left}");
    // The provider's clock is 97 s behind the arbiter's, the consumer's 53 s before: neither matters.
    sea.run(55.0);
    assert_eq!(told(one.take()), ALL);
    sea.is_lawful();
}
