//! A sea with an arbiter, a guarded provider and consumers, whose clocks are minutes apart.

use super::asking::{Asking, Handle, Part, Seen};
use super::bus::{Bus, guids, source};
use super::vector::{VectorCommand, provider};
use crate::service::Outbox;
use crate::umaa::allocation::{
    Arbiter, ArbiterSettings, Arbitration, ControlOutcome, ControlTold, ControlledConsumer, Guard,
    GuardSettings, Plan, Resource, TaskId,
};
use crate::umaa::command::{Consumer, ConsumerSettings, Outcome, ProviderSettings, Told};
use aldis_envelope::umaa::{
    self, CommandStatusReason, DurationSeconds, ResourceAllocationCommand, ResourceAllocationPriorityCommand,
    ResourceAllocationReport, Topic,
};
use aldis_envelope::{DateTime, Guid, Now, Source};
use std::sync::{Arc, Mutex};
use std::time::Duration;

pub(crate) type Allocating = Consumer<ResourceAllocationCommand>;
pub(crate) type Ordering = Consumer<ResourceAllocationPriorityCommand>;
pub(crate) type Controlling = ControlledConsumer<VectorCommand>;

pub(crate) const SECOND: Duration = Duration::from_secs(1);
pub(crate) const AUTOPILOT: Guid = Guid([0xA; 16]);

pub(crate) fn arbiter() -> Source {
    source(400, 10)
}

pub(crate) fn steersman() -> Source {
    source(400, 100)
}

/// Consumers: 1 goes after 2.
pub(crate) fn captain(number: u64) -> Source {
    source(number, 100)
}

pub(crate) fn guid(of: Source) -> Guid {
    guids().of_service(of)
}

pub(crate) fn autopilot() -> Resource {
    Resource {
        id: AUTOPILOT,
        name: "autopilot".into(),
        priorities: vec![guid(captain(1)), guid(captain(2))],
        related_sources: vec![guid(steersman()), guid(source(400, 101))],
    }
}

pub(crate) fn settings(resource: Resource) -> ArbiterSettings {
    let priority_from = vec![captain(2).entity];
    ArbiterSettings { resources: vec![resource], priority_from, ..ArbiterSettings::default() }
}

pub(crate) struct Sea {
    pub(crate) bus: Bus,
    pub(crate) asked: Seen<String>,
}

/// Adds a service that does with a consumer what the test wishes.
pub(crate) fn add<P: Part>(
    bus: &mut Bus,
    at: Source,
    make: impl Fn() -> P + Send + Sync + 'static,
) -> Handle<P> {
    let handle = Handle::default();
    let given: Handle<P> = handle.clone();
    // Clocks of vehicles differ: each is off by its entity, in minutes.
    let offset = at.entity.get() as i64 * 60_000_000_000;
    bus.add(at, offset, Arc::new(move || Box::new(Asking { part: make(), handle: given.clone() })));
    handle
}

pub(crate) fn allocating(bus: &mut Bus, at: Source) -> Handle<Allocating> {
    add(bus, at, move || Allocating::new(at, guids(), ConsumerSettings::default()))
}

pub(crate) fn controlling(bus: &mut Bus, at: Source) -> Handle<Controlling> {
    add(bus, at, move || Controlling::new(at, guids(), ConsumerSettings::default()))
}

pub(crate) fn add_arbiter(bus: &mut Bus, at: Source, settings: ArbiterSettings) {
    let arbitration = Arbitration::new(settings).unwrap();
    bus.add(at, 7_000_000_000, Arc::new(move || Box::new(Arbiter::new(at, &guids(), arbitration.clone()))));
}

pub(crate) fn add_steersman(bus: &mut Bus, at: Source) -> Seen<String> {
    let asked = Seen::default();
    let given = asked.clone();
    bus.add(
        at,
        -90_000_000_000,
        Arc::new(move || {
            let guard = Guard::new(at, guids(), GuardSettings::new(AUTOPILOT));
            let settings =
                ProviderSettings { execute_within: Some(60 * SECOND), ..ProviderSettings::default() };
            provider(at, &guids(), settings, guard, given.clone())
        }),
    );
    asked
}

pub(crate) fn sea_with(settings: ArbiterSettings) -> Sea {
    let mut bus = Bus::new(11, Duration::from_millis(5));
    bus.checker.watch::<ResourceAllocationCommand>();
    bus.checker.watch::<ResourceAllocationPriorityCommand>();
    bus.checker.watch::<VectorCommand>();
    add_arbiter(&mut bus, arbiter(), settings);
    let asked = add_steersman(&mut bus, steersman());
    bus.run_for(SECOND);
    Sea { bus, asked }
}

pub(crate) fn sea() -> Sea {
    sea_with(settings(autopilot()))
}

impl Sea {
    pub(crate) fn allocate(&mut self, handle: &Handle<Allocating>, at: Source, seconds: Option<f64>) -> Guid {
        let session = Arc::new(Mutex::new(Guid::NIL));
        let given = session.clone();
        handle.wish(move |consumer, now, out| {
            *given.lock().unwrap() = consumer.start(now, guid(arbiter()), ask(seconds), out).unwrap();
        });
        self.bus.wake(at);
        *session.lock().unwrap()
    }

    pub(crate) fn order(
        &mut self,
        handle: &Handle<Controlling>,
        at: Source,
        command: VectorCommand,
    ) -> TaskId {
        let task = Arc::new(Mutex::new(None));
        let given = task.clone();
        handle.wish(move |consumer, now, out| {
            let plan = Plan {
                arbiter: guid(arbiter()),
                resource: AUTOPILOT,
                duration: Some(4 * SECOND),
                provider: guid(steersman()),
                command,
            };
            *given.lock().unwrap() = Some(consumer.start(now, plan, out).unwrap());
        });
        self.bus.wake(at);
        task.lock().unwrap().unwrap()
    }

    pub(crate) fn wish<P: Part>(
        &mut self,
        handle: &Handle<P>,
        at: Source,
        wish: impl FnOnce(&mut P, Now, &mut Outbox) + Send + 'static,
    ) {
        handle.wish(wish);
        self.bus.wake(at);
    }

    pub(crate) fn run(&mut self, seconds: f64) {
        self.bus.run_for(Duration::from_secs_f64(seconds));
    }

    /// Who controls the autopilot, as the report on the bus says.
    pub(crate) fn holder(&self) -> Option<Guid> {
        let reports = self.bus.retained(ResourceAllocationReport::NAME);
        assert_eq!(reports.len(), 1);
        let report: ResourceAllocationReport = umaa::decode(&reports[0].message.content).unwrap();
        assert_eq!(report.control_info.len(), 1, "the resource's information stays");
        Some(report.control_info[0].control_session?.controlling_consumer)
    }

    #[track_caller]
    pub(crate) fn is_lawful(&self) {
        assert_eq!(self.bus.checker.violations, Vec::<String>::new());
        assert_eq!(self.bus.checker.strangers(|_, _| true), Vec::<String>::new());
    }

    #[track_caller]
    pub(crate) fn is_clean(&self) {
        self.is_lawful();
        assert_eq!(self.bus.checker.left(), Vec::<String>::new());
    }
}

pub(crate) fn ask(seconds: Option<f64>) -> ResourceAllocationCommand {
    ResourceAllocationCommand {
        duration: seconds.map(|seconds| DurationSeconds::new(seconds).unwrap()),
        resource_id: AUTOPILOT,
        time_stamp: DateTime::default(),
        source: Guid::NIL,
        session_id: Guid::NIL,
        destination: Guid::NIL,
    }
}

pub(crate) fn told<E>(heard: Vec<Told<E>>) -> String {
    let line = |told: &Told<E>| match told {
        Told::Recovered { .. } => "recovered".to_owned(),
        Told::State { state, reason: CommandStatusReason::Succeeded, .. } => state.to_string(),
        Told::State { state, reason, .. } => format!("{state}/{reason}"),
        Told::Execution { .. } => "status".to_owned(),
        Told::Ended { outcome, .. } => outcome_line(outcome),
    };
    heard.iter().map(line).collect::<Vec<_>>().join(" ")
}

pub(crate) fn outcome_line(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Failed { reason, .. } => format!("FAILED/{reason}"),
        outcome => format!("{outcome:?}"),
    }
}

pub(crate) fn control_told<E>(heard: Vec<ControlTold<E>>) -> String {
    let line = |told: ControlTold<E>| match told {
        ControlTold::Allocated(_) => "allocated".to_owned(),
        ControlTold::ControlLost(_, outcome) => format!("lost:{}", outcome_line(&outcome)),
        ControlTold::Command(_, news) => self::told(vec![news]),
        ControlTold::Ended(_, ControlOutcome::Command(outcome)) => outcome_line(&outcome),
        ControlTold::Ended(_, outcome) => format!("{outcome:?}"),
    };
    heard.into_iter().map(line).collect::<Vec<_>>().join(" ")
}
