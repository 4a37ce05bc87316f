//! What a provider and a consumer do on a bus, one clause at a time.

use super::*;
use crate::umaa::command::{Consumer, ConsumerSettings, Outcome, Recovery, Told};
use crate::umaa::tests::asking::{Asking, Handle, Seen};
use crate::umaa::tests::bus::{Bus, Factory, guids, source};
use crate::umaa::tests::vector::{VectorCommand, VectorExecutionStatus, provider, steer};

use crate::service::{Action, Input};
use aldis_envelope::umaa::{CommandState, CommandStatusReason};
use aldis_envelope::{BootId, Priority, Stamp, Wall};
use std::sync::Arc;

type VectorConsumer = Consumer<VectorCommand>;
type VectorHandle = Handle<VectorConsumer>;

const SECOND: Duration = Duration::from_secs(1);

fn steersman() -> Source {
    source(400, 100)
}

fn captain() -> Source {
    source(1, 100)
}

struct Sea {
    bus: Bus,
    client: VectorHandle,
    asked: Seen<String>,
}

fn provider_of(settings: ProviderSettings, asked: Seen<String>) -> Factory {
    Arc::new(move || provider(steersman(), &guids(), settings.clone(), Everybody, asked.clone()))
}

fn client_of(settings: ConsumerSettings, handle: VectorHandle, at: Source) -> Factory {
    Arc::new(move || {
        let part = VectorConsumer::new(at, guids(), settings.clone());
        Box::new(Asking { part, handle: handle.clone() })
    })
}

fn sea_with(settings: ProviderSettings, recovery: Recovery) -> Sea {
    let mut bus = Bus::new(7, Duration::from_millis(5));
    bus.checker.watch::<VectorCommand>();
    let (client, asked) = (VectorHandle::default(), Seen::default());
    bus.add(steersman(), 0, provider_of(settings, asked.clone()));
    let settings = ConsumerSettings { recovery, ..ConsumerSettings::default() };
    bus.add(captain(), 0, client_of(settings, client.clone(), captain()));
    Sea { bus, client, asked }
}

fn sea() -> Sea {
    sea_with(ProviderSettings::default(), Recovery::Resume)
}

impl Sea {
    fn wish(&mut self, wish: impl FnOnce(&mut VectorConsumer, Now, &mut Outbox) + Send + 'static) {
        self.client.wish(wish);
        self.bus.wake(captain());
    }

    fn order(&mut self, command: VectorCommand) -> Guid {
        let session = Arc::new(std::sync::Mutex::new(Guid::NIL));
        let given = session.clone();
        self.wish(move |consumer, now, out| {
            let to = guids().of_service(steersman());
            *given.lock().unwrap() = consumer.start(now, to, command, out).unwrap();
        });
        *session.lock().unwrap()
    }

    fn cancel(&mut self, session: Guid) {
        self.wish(move |consumer, now, out| consumer.cancel(now, session, out));
    }

    fn update(&mut self, session: Guid, command: VectorCommand) {
        self.wish(move |consumer, now, out| {
            let _ = consumer.update(now, session, command, out);
        });
    }

    fn run(&mut self, seconds: u64) {
        self.bus.run_for(SECOND * u32::try_from(seconds).unwrap());
    }

    /// What the consumer was told, in short.
    fn told(&self) -> String {
        let line = |told: &Told<VectorExecutionStatus>| match told {
            Told::Recovered { .. } => "recovered".to_owned(),
            Told::State { state, reason, .. } if *reason == CommandStatusReason::Succeeded => {
                state.to_string()
            }
            Told::State { state, reason, .. } => format!("{state}/{reason}"),
            Told::Execution { status, .. } => format!("left:{}", status.seconds_left),
            Told::Ended { outcome: Outcome::Failed { reason, .. }, .. } => format!("FAILED/{reason}"),
            Told::Ended { outcome, .. } => format!("{outcome:?}"),
        };
        self.client.heard().iter().map(line).collect::<Vec<_>>().join(" ")
    }

    /// Nothing was wrong, and nothing is left on the bus.
    #[track_caller]
    fn is_clean(&self) {
        assert_eq!(self.bus.checker.violations, Vec::<String>::new());
        assert_eq!(self.bus.checker.left(), Vec::<String>::new());
    }

    fn one(command: VectorCommand, seconds: u64) -> Self {
        let mut sea = sea();
        sea.order(command);
        sea.run(seconds);
        sea
    }
}

#[test]
fn a_command_goes_to_its_end_and_all_is_cleaned_up() {
    let sea = Sea::one(steer(90.0, 5, ""), 10);
    assert_eq!(sea.told(), "ISSUED COMMANDED EXECUTING left:5 Completed");
    sea.is_clean();
}

#[test]
fn every_failure_ends_with_its_reason() {
    for (command, told) in [
        (steer(400.0, 5, ""), "ISSUED FAILED/VALIDATION_FAILED"),
        (steer(90.0, 5, "dead at validation"), "ISSUED FAILED/RESOURCE_FAILED"),
        (steer(90.0, 5, "slow to validate"), "ISSUED FAILED/TIMEOUT"),
        (steer(90.0, 5, "rejected"), "ISSUED COMMANDED FAILED/RESOURCE_REJECTED"),
        (steer(90.0, 5, "slow to start"), "ISSUED COMMANDED FAILED/TIMEOUT"),
        (steer(90.0, 5, "aground"), "ISSUED COMMANDED EXECUTING left:5 FAILED/OBJECTIVE_FAILED"),
        (steer(90.0, 5, "dead"), "ISSUED COMMANDED EXECUTING left:5 FAILED/RESOURCE_FAILED"),
        (steer(90.0, 5, "done at once"), "ISSUED COMMANDED EXECUTING Completed"),
    ] {
        let sea = Sea::one(command.clone(), 100);
        assert_eq!(sea.told(), told, "{command:?}");
        sea.is_clean();
    }
}

#[test]
fn a_command_that_runs_too_long_times_out() {
    let settings = ProviderSettings { execute_within: Some(3 * SECOND), ..ProviderSettings::default() };
    let mut sea = sea_with(settings, Recovery::Resume);
    sea.order(steer(90.0, 5, ""));
    sea.run(20);
    assert_eq!(sea.told(), "ISSUED COMMANDED EXECUTING left:5 FAILED/TIMEOUT");
    assert_eq!(*sea.asked.lock().unwrap(), ["start 90", "stop 90 Broken"]);
    sea.is_clean();
}

#[test]
fn a_cancel_wins_or_is_lost() {
    for (trouble, told) in [("", "Canceled"), ("not to be stopped", "Completed")] {
        let mut sea = Sea::one(steer(90.0, 5, trouble), 1);
        let session = match sea.client.heard().first() {
            Some(Told::State { session, .. }) => *session,
            other => panic!("{other:?}"),
        };
        sea.cancel(session);
        sea.run(10);
        assert_eq!(sea.told(), format!("ISSUED COMMANDED EXECUTING left:5 {told}"));
        sea.is_clean();
    }
}

#[test]
fn an_update_begins_anew_with_new_limits() {
    let settings = ProviderSettings { execute_within: Some(4 * SECOND), ..ProviderSettings::default() };
    let mut sea = sea_with(settings, Recovery::Resume);
    let session = sea.order(steer(90.0, 0, ""));
    sea.run(3);
    sea.update(session, steer(180.0, 2, ""));
    sea.run(10);
    let first = "ISSUED COMMANDED EXECUTING left:1000000";
    assert_eq!(sea.told(), format!("{first} ISSUED/UPDATED COMMANDED EXECUTING left:2 Completed"));
    assert_eq!(*sea.asked.lock().unwrap(), ["start 90", "stop 90 Updated", "start 180"]);
    sea.is_clean();
}

/// A consumer that has seen the end would not update; this one writes past it.
fn late_update(settings: ProviderSettings) -> Sea {
    let mut sea = sea_with(settings, Recovery::Resume);
    let ghost = source(1, 200);
    sea.bus.add(ghost, 0, client_of(ConsumerSettings::default(), VectorHandle::default(), source(1, 201)));
    let label = umaa::label::<VectorCommand>(ghost).unwrap();
    let mut command = steer(90.0, 1, "");
    let (of_ghost, of_steersman) = (guids().of_service(ghost), guids().of_service(steersman()));
    let header = |seconds| CommandHeader {
        time_stamp: DateTime::new(seconds, 0).unwrap(),
        source: of_ghost,
        session_id: Guid([9; 16]),
        destination: of_steersman,
    };
    command.set_header(header(1));
    sea.bus.put(umaa::put(label.clone(), &command));
    sea.run(1);
    // The same again is a duplicate.
    sea.bus.checker.violations.clear();
    sea.bus.put(umaa::put(label.clone(), &command));
    sea.run(4);
    sea.bus.checker.violations.clear();
    command.set_header(header(2));
    sea.bus.put(umaa::put(label.clone(), &command));
    sea.run(1);
    sea.bus.put(umaa::dispose(label, &command));
    sea.run(1);
    sea
}

#[test]
fn an_update_of_a_finished_command_is_refused_in_the_log_alone() {
    let sea = late_update(ProviderSettings::default());
    assert!(sea.bus.notes.iter().any(|note| note.contains("is refused: it is over")), "{:?}", sea.bus.notes);
    assert_eq!(*sea.asked.lock().unwrap(), ["start 90"]);
    sea.is_clean();
}

#[test]
fn an_update_of_a_finished_command_is_answered_where_peers_want_it() {
    let settings = ProviderSettings { answer_finished_update: true, ..ProviderSettings::default() };
    let sea = late_update(settings);
    // The one status outside figure 5.
    assert_eq!(sea.bus.checker.violations.len(), 1, "{:?}", sea.bus.checker.violations);
    assert!(sea.bus.checker.violations[0].contains("Completed"), "{:?}", sea.bus.checker.violations);
    assert_eq!(sea.bus.checker.left(), Vec::<String>::new());
}

#[test]
fn a_provider_that_lost_its_process_goes_on_where_it_was() {
    let mut sea = Sea::one(steer(90.0, 5, ""), 1);
    sea.bus.crash(steersman());
    sea.run(3);
    sea.bus.start(steersman());
    sea.run(10);
    assert_eq!(sea.told(), "ISSUED COMMANDED EXECUTING left:5 Completed");
    sea.is_clean();
}

#[test]
fn a_provider_that_cannot_go_on_fails_the_command() {
    let mut sea = Sea::one(steer(90.0, 5, "not to be recovered"), 1);
    sea.bus.crash(steersman());
    sea.bus.start(steersman());
    sea.run(10);
    assert_eq!(sea.told(), "ISSUED COMMANDED EXECUTING left:5 FAILED/SERVICE_FAILED");
    sea.is_clean();
}

#[test]
fn a_command_that_waited_for_its_provider_begins_with_issued() {
    let mut sea = sea();
    sea.bus.crash(steersman());
    sea.order(steer(90.0, 5, ""));
    sea.run(5);
    sea.bus.start(steersman());
    sea.run(10);
    assert_eq!(sea.told(), "ISSUED COMMANDED EXECUTING left:5 Completed");
    sea.is_clean();
}

#[test]
fn a_command_that_ended_while_its_consumer_was_away_awaits_its_dispose() {
    let mut sea = Sea::one(steer(90.0, 5, ""), 1);
    sea.bus.crash(captain());
    sea.run(10);
    let statuses = sea.bus.retained(<VectorCommand as Command>::STATUS_NAME).len();
    sea.bus.crash(steersman());
    sea.bus.start(steersman());
    sea.run(1);
    assert_eq!(statuses, 1);
    assert_eq!(sea.bus.retained(<VectorCommand as Command>::STATUS_NAME).len(), 1);
    sea.bus.start(captain());
    sea.run(5);
    assert!(sea.told().ends_with("Completed"), "{}", sea.told());
    sea.is_clean();
}

#[test]
fn what_is_left_of_a_command_that_nobody_knows_is_disposed() {
    let mut sea = Sea::one(steer(90.0, 50, ""), 1);
    sea.bus.crash(steersman());
    sea.bus.crash_with_its_disk(captain());
    sea.bus.start(captain());
    sea.bus.start(steersman());
    sea.run(1);
    for name in [<VectorCommand as Command>::STATUS_NAME, <VectorCommand as Command>::ACK_REPORT_NAME] {
        assert_eq!(sea.bus.retained(name).len(), 0, "{name}");
    }
    assert_eq!(sea.bus.retained(<VectorExecutionStatus as umaa::Topic>::NAME).len(), 0);
}

#[test]
fn a_consumer_resumes_or_cancels_what_it_left() {
    for (recovery, told) in [(Recovery::Resume, "recovered Completed"), (Recovery::Cancel, "Canceled")] {
        let mut sea = sea_with(ProviderSettings::default(), recovery);
        sea.order(steer(90.0, 5, ""));
        sea.run(1);
        sea.bus.crash(captain());
        sea.client.take();
        sea.bus.start(captain());
        sea.run(10);
        let heard =
            sea.told().replace("EXECUTING left:5 ", "").replace("EXECUTING ", "").replace("left:5 ", "");
        assert_eq!(heard, told);
        sea.is_clean();
    }
}

#[test]
fn shutdowns_leave_the_bus_clean_in_any_order() {
    for provider_first in [true, false] {
        let mut sea = Sea::one(steer(90.0, 50, ""), 1);
        let (first, second) =
            if provider_first { (steersman(), captain()) } else { (captain(), steersman()) };
        sea.bus.shut_down(first);
        sea.run(1);
        let ended = if provider_first { "FAILED/SERVICE_FAILED" } else { "" };
        assert!(sea.told().ends_with(ended), "{}", sea.told());
        sea.bus.shut_down(second);
        sea.run(1);
        sea.is_clean();
    }
}

#[test]
fn lost_contact_is_never_a_cancel() {
    let mut sea = Sea::one(steer(90.0, 30, ""), 1);
    sea.bus.silence(captain(), steersman());
    sea.run(20);
    sea.bus.heal(captain(), steersman());
    sea.run(20);
    assert_eq!(sea.told(), "ISSUED COMMANDED EXECUTING left:30 Completed");
    sea.is_clean();
}

#[test]
fn a_provider_that_does_not_answer_is_given_up_and_executes_nothing_later() {
    let mut sea = sea();
    sea.bus.crash(steersman());
    sea.order(steer(90.0, 5, ""));
    sea.run(60);
    assert_eq!(sea.told(), "Unanswered");
    sea.bus.start(steersman());
    sea.run(5);
    assert!(sea.asked.lock().unwrap().is_empty());
    sea.is_clean();
}

#[test]
fn commands_of_other_providers_are_passed_over_silently() {
    let mut sea = sea();
    sea.wish(|consumer, now, out| {
        let elsewhere = guids().of_service(source(401, 100));
        consumer.start(now, elsewhere, steer(90.0, 5, ""), out).unwrap();
    });
    sea.run(5);
    assert_eq!((sea.told().as_str(), sea.bus.notes.len()), ("", 0));
}

#[test]
fn more_commands_than_fit_are_rejected_and_told_so() {
    let mut sea =
        sea_with(ProviderSettings { sessions_max: 2, ..ProviderSettings::default() }, Recovery::Resume);
    for course in [10.0, 20.0, 30.0] {
        sea.order(steer(course, 5, ""));
    }
    sea.run(10);
    let told = sea.told();
    assert_eq!(told.matches("Completed").count(), 2, "{told}");
    assert_eq!(told.matches("FAILED/RESOURCE_REJECTED").count(), 1, "{told}");
    assert!(!sea.asked.lock().unwrap().contains(&"start 30".to_owned()));
    sea.is_clean();
}

#[test]
fn nobody_commands_or_cancels_in_the_name_of_another() {
    let mut sea = Sea::one(steer(90.0, 5, ""), 1);
    let pirate = source(666, 100);
    sea.bus.add(pirate, 0, client_of(ConsumerSettings::default(), VectorHandle::default(), pirate));
    let label = umaa::label::<VectorCommand>(pirate).unwrap();
    let (of_captain, of_steersman) = (guids().of_service(captain()), guids().of_service(steersman()));
    let mut command = steer(0.0, 5, "");
    let (time_stamp, session_id) = (DateTime::default(), Guid([8; 16]));
    command.set_header(CommandHeader {
        time_stamp,
        source: of_captain,
        session_id,
        destination: of_steersman,
    });
    sea.bus.put(umaa::put(label.clone(), &command));
    sea.bus.put(umaa::dispose(label.clone(), &command));
    let known: VectorCommand = {
        let known = sea.bus.retained(<VectorCommand as umaa::Topic>::NAME)[0];
        umaa::decode(&known.message.content).unwrap()
    };
    sea.bus.put(umaa::dispose(label, &known));
    sea.run(10);
    assert_eq!(*sea.asked.lock().unwrap(), ["start 90"]);
    assert!(sea.told().ends_with("Completed"), "{}", sea.told());
    assert!(sea.bus.notes.iter().any(|note| note.contains("names eid1sid100 as its source")));
    assert!(sea.bus.notes.iter().any(|note| note.contains("not its own")));
}

#[test]
fn a_command_that_cannot_be_read_is_told_and_harms_nothing() {
    let mut sea = sea();
    let label = umaa::label::<VectorCommand>(captain()).unwrap();
    let message = umaa::put(label, &steer(90.0, 5, ""));
    let cut = aldis_envelope::Message { content: message.content.slice(..3), ..message };
    sea.bus.checker = Default::default();
    sea.bus.put(cut);
    sea.run(1);
    assert!(sea.bus.notes.iter().any(|note| note.contains("is not read")), "{:?}", sea.bus.notes);
}

#[test]
fn only_what_this_provider_said_itself_counts_as_its_past() {
    let mut sea = sea();
    sea.bus.crash(steersman());
    let session = sea.order(steer(90.0, 2, ""));
    // Somebody else says that the command is done.
    let pirate = source(666, 100);
    sea.bus.add(pirate, 0, client_of(ConsumerSettings::default(), VectorHandle::default(), pirate));
    let key = SessionKey { source: guids().of_service(steersman()), session_id: session };
    let (state, reason) = (CommandState::Completed, CommandStatusReason::Succeeded);
    let status =
        CommandStatus::<VectorCommand>::new(DateTime::default(), key, state, reason, Default::default());
    let label = umaa::label::<CommandStatus<VectorCommand>>(pirate).unwrap();
    sea.bus.checker = Default::default();
    sea.bus.put(umaa::put(label, &status));
    sea.run(1);
    assert_eq!(sea.told(), "");
    sea.bus.start(steersman());
    sea.run(5);
    assert_eq!(*sea.asked.lock().unwrap(), ["start 90"]);
    assert_eq!(sea.told(), "ISSUED COMMANDED EXECUTING left:2 Completed");
}

#[test]
fn the_last_word_of_a_former_life_counts_whatever_its_clock_said() {
    let writer = steersman();
    let key = SessionKey { source: guids().of_service(writer), session_id: Guid([3; 16]) };
    let stamp = |sequence| Stamp {
        node: writer.entity,
        boot: BootId(1),
        sequence,
        source_time: Wall(0),
        lifespan_left_ms: None,
        priority: Priority::Data,
        skipped: 0,
        via: Default::default(),
    };
    let said = |sequence, seconds, state, reason| {
        let time = DateTime::new(seconds, 0).unwrap();
        let status = CommandStatus::<VectorCommand>::new(time, key, state, reason, Default::default());
        let message = umaa::put(umaa::label::<CommandStatus<VectorCommand>>(writer).unwrap(), &status);
        Envelope { message, stamp: stamp(sequence) }
    };
    // The clock has been set back in between.
    let commanded = said(1, 60, CommandState::Commanded, CommandStatusReason::Succeeded);
    let failed = said(2, 10, CommandState::Failed, CommandStatusReason::Interrupted);
    let mut provider = provider_of(ProviderSettings::default(), Seen::default())();
    let mut out = Outbox::new(writer);
    let now = Now { monotonic: Monotonic::START, wall: Wall(0) };
    for input in [Input::Recovered(&commanded), Input::Recovered(&failed), Input::HistoryComplete(true)] {
        provider.handle(now, input, &mut out);
    }
    let says = |action: &Action| matches!(action, Action::Send(message) if message.change == Change::Put);
    assert_eq!(out.drain().filter(says).count(), 0, "it has failed, and does not fail again");
}

/// A door that a test shuts.
struct Door(Arc<std::sync::atomic::AtomicBool>);

impl Admission for Door {
    fn admits(&self, _: Now, _: Guid) -> crate::umaa::command::Verdict {
        match self.0.load(std::sync::atomic::Ordering::Relaxed) {
            true => crate::umaa::command::Verdict::Valid,
            false => crate::umaa::command::Verdict::Failed(Failure::new(FailureKind::Rejected, "shut")),
        }
    }

    fn ends(&self, _: Now, _: Guid) -> Option<Failure> {
        None
    }
}

/// What a consumer hears of a command that waits in COMMANDED while its consumer is shut out, with or without a new life of
/// the provider in between.
fn shut_out(crashes: bool) -> String {
    let mut sea = sea();
    let door = Arc::new(std::sync::atomic::AtomicBool::new(true));
    let (given, asked) = (door.clone(), sea.asked.clone());
    let at = source(400, 101);
    let settings = ProviderSettings { start_within: Some(20 * SECOND), ..ProviderSettings::default() };
    let factory: Factory =
        Arc::new(move || provider(at, &guids(), settings.clone(), Door(given.clone()), asked.clone()));
    sea.bus.add(at, 0, factory);
    sea.wish(move |consumer, now, out| {
        consumer.start(now, guids().of_service(at), steer(90.0, 5, "slow to start"), out).unwrap();
    });
    sea.run(2);
    if crashes {
        sea.bus.crash(at);
    }
    door.store(false, std::sync::atomic::Ordering::Relaxed);
    if crashes {
        sea.bus.start(at);
    } else {
        sea.bus.wake(at);
    }
    sea.run(2);
    sea.is_clean();
    sea.told()
}

#[test]
fn a_command_that_waits_to_start_is_rejected_where_its_consumer_is_no_longer_let_through() {
    assert_eq!(shut_out(false), "ISSUED COMMANDED FAILED/RESOURCE_REJECTED");
    assert_eq!(shut_out(true), "ISSUED COMMANDED FAILED/RESOURCE_REJECTED");
}
