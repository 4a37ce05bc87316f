//! Consumers that do something at random moments, until all faults have ended: then they end what they have begun, and show
//! once more that everything works.

use super::commands::{VectorCommand, steer};
use super::scripted::TROUBLES;
use crate::service::{Input, Outbox, Service};
use crate::sim::observe::{Fact, Facts};
use crate::umaa::allocation::{ControlOutcome, ControlTold, ControlledConsumer, Plan, TaskId};
use crate::umaa::command::{Consumer, ConsumerSettings, Outcome, Recovery, Told};
use aldis_envelope::umaa::Command;
use aldis_envelope::{Guid, Guids, Monotonic, Now, Prefix, Source};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// How long after all faults have ended everything works again: leases, repetitions and waits of the machines have run out.
const SETTLING: Duration = Duration::from_secs(40);
/// The longest time between two acts, so that all see in good time that all faults have ended.
const PAUSE_MAX: Duration = Duration::from_secs(8);
/// How many commands a consumer has open at a time.
const OPEN_MAX: usize = 3;

/// The last command of a consumer, when all faults have long ended, has ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct LastWord {
    pub(super) by: Source,
    pub(super) outcome: Result<(), String>,
}

impl Fact for LastWord {}

/// What all consumers of a run share.
#[derive(Clone)]
pub(super) struct Stage {
    pub(super) facts: Facts,
    /// Set when all faults have ended.
    pub(super) is_calm: Arc<AtomicBool>,
    /// The mean time between two acts.
    pub(super) pace: Duration,
}

/// When a consumer acts.
struct Clock {
    stage: Stage,
    random: fastrand::Rng,
    next: Option<Monotonic>,
    /// When it acts for the last time.
    last_act: Option<Monotonic>,
    has_acted_last: bool,
    waits: Duration,
}

/// What a consumer is to do now.
enum Act {
    Anything,
    End,
    Last,
}

impl Clock {
    fn new(stage: Stage, seed: u64, waits: Duration) -> Self {
        let random = fastrand::Rng::with_seed(seed);
        Self { stage, random, next: None, last_act: None, has_acted_last: false, waits }
    }

    fn is_due(&mut self, now: Now, input: &Input<'_>) -> Option<Act> {
        if matches!(input, Input::HistoryComplete(_)) {
            self.next = Some(now.monotonic + self.pause());
            return None;
        }
        self.next.take_if(|at| *at <= now.monotonic)?;
        if !self.stage.is_calm.load(Ordering::Relaxed) {
            self.next = Some(now.monotonic + self.pause());
            return Some(Act::Anything);
        }
        match self.last_act {
            None => {
                self.last_act = Some(now.monotonic + SETTLING + self.waits);
                self.next = self.last_act;
                Some(Act::End)
            }
            Some(_) if self.has_acted_last => None,
            Some(_) => {
                self.has_acted_last = true;
                Some(Act::Last)
            }
        }
    }

    fn pause(&mut self) -> Duration {
        self.stage.pace.mul_f64(-(1.0 - self.random.f64()).ln()).min(PAUSE_MAX)
    }
}

/// Makes the commands of a [`User`]: the usual ones, and the last one.
pub(super) trait Maker<C>: Send {
    /// Any command.
    fn any(&mut self, random: &mut fastrand::Rng) -> C;
    /// One that is done soon, where the consumer may expect that.
    fn last(&mut self) -> Option<C>;
}

/// Starts, updates and cancels commands of one kind at one provider.
pub(super) struct User<C: Command, M> {
    source: Source,
    provider: Guid,
    consumer: Consumer<C>,
    maker: M,
    clock: Clock,
    open: BTreeSet<Guid>,
    last: Option<Guid>,
}

impl<C: Command, M: Maker<C>> User<C, M> {
    pub(super) fn new(
        source: Source,
        guids: &Guids,
        provider: Source,
        maker: M,
        (stage, seed): (Stage, u64),
    ) -> Self {
        let mut clock = Clock::new(stage, seed, Duration::ZERO);
        let recovery = if clock.random.bool() { Recovery::Resume } else { Recovery::Cancel };
        let settings = ConsumerSettings { recovery, ..ConsumerSettings::default() };
        Self {
            source,
            provider: guids.of_service(provider),
            consumer: Consumer::new(source, guids.clone(), settings),
            maker,
            clock,
            open: BTreeSet::new(),
            last: None,
        }
    }

    fn act(&mut self, now: Now, act: &Act, out: &mut Outbox) {
        let random = &mut self.clock.random;
        let chosen = random.choice(self.open.iter()).copied();
        match (act, chosen, random.u8(0..10)) {
            (Act::End, ..) => {
                self.open.iter().for_each(|session| self.consumer.cancel(now, *session, out));
            }
            (Act::Last, ..) => {
                if let Some(command) = self.maker.last() {
                    self.last = self.consumer.start(now, self.provider, command, out).ok();
                }
            }
            (Act::Anything, Some(session), 0..3) => self.consumer.cancel(now, session, out),
            (Act::Anything, Some(session), 3..6) => {
                let command = self.maker.any(random);
                // It may have ended, or be on its way to be cancelled.
                let _ = self.consumer.update(now, session, command, out);
            }
            (Act::Anything, ..) if self.open.len() < OPEN_MAX => {
                let command = self.maker.any(random);
                self.open.extend(self.consumer.start(now, self.provider, command, out));
            }
            (Act::Anything, ..) => {}
        }
    }

    fn hear(&mut self, told: &Told<C::ExecutionStatus>) {
        match told {
            Told::Recovered { session } => drop(self.open.insert(*session)),
            Told::Ended { session, outcome } => {
                self.open.remove(session);
                if self.last == Some(*session) {
                    let outcome = is_completed(outcome);
                    self.clock.stage.facts.tell(LastWord { by: self.source, outcome });
                }
            }
            _ => {}
        }
    }
}

fn is_completed(outcome: &Outcome) -> Result<(), String> {
    if *outcome == Outcome::Completed { Ok(()) } else { Err(format!("{outcome:?}")) }
}

impl<C: Command, M: Maker<C>> Service for User<C, M> {
    fn subscriptions(&self) -> Vec<Prefix> {
        self.consumer.subscriptions()
    }

    fn goes_by_what_is_kept(&self) -> bool {
        true
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        let told = self.consumer.handle(now, &input, out);
        told.iter().for_each(|told| self.hear(told));
        if let Some(act) = self.clock.is_due(now, &input) {
            self.act(now, &act, out);
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        [self.consumer.next_deadline(), self.clock.next].into_iter().flatten().min()
    }
}

/// Takes control and steers.
pub(super) struct Captain {
    source: Source,
    plan: Plan<VectorCommand>,
    consumer: ControlledConsumer<VectorCommand>,
    clock: Clock,
    last: Option<TaskId>,
}

impl Captain {
    /// A captain that goes by this plan, with other commands each time; `waits` is when it is its turn at the end.
    pub(super) fn new(
        source: Source,
        guids: &Guids,
        plan: Plan<VectorCommand>,
        (stage, seed): (Stage, u64),
        waits: Duration,
    ) -> Self {
        Self {
            source,
            plan,
            consumer: ControlledConsumer::new(source, guids.clone(), ConsumerSettings::default()),
            clock: Clock::new(stage, seed, waits),
            last: None,
        }
    }

    fn plan(&mut self, command: VectorCommand) -> Plan<VectorCommand> {
        Plan { command, ..self.plan.clone() }
    }

    fn act(&mut self, now: Now, act: &Act, out: &mut Outbox) {
        let tasks = self.consumer.tasks();
        let random = &mut self.clock.random;
        let chosen = random.choice(&tasks).copied();
        match (act, chosen, random.u8(0..10)) {
            (Act::End, ..) => tasks.into_iter().for_each(|task| self.consumer.cancel(now, task, out)),
            (Act::Last, ..) => {
                let plan = self.plan(steer(90.0, 2, ""));
                self.last = self.consumer.start(now, plan, out).ok();
            }
            (Act::Anything, Some(task), 0..3) => self.consumer.cancel(now, task, out),
            (Act::Anything, Some(task), 3..5) => {
                let command = any_course(random);
                // It may not be out yet, or have ended.
                let _ = self.consumer.update(now, task, command, out);
            }
            (Act::Anything, ..) if tasks.len() < OPEN_MAX => {
                let command = any_course(random);
                let plan = self.plan(command);
                // As many commands as allowed may be on the bus already.
                let _ = self.consumer.start(now, plan, out);
            }
            (Act::Anything, ..) => {}
        }
    }
}

/// How long a command lasts at the most, and what goes wrong with it. What is not to be stopped does not last long: the monitor
/// waits for the end of what is cancelled.
pub(super) fn any_trouble(random: &mut fastrand::Rng, seconds_max: u32) -> (u32, &'static str) {
    let trouble = TROUBLES[random.usize(0..TROUBLES.len())];
    let seconds = if trouble == "not to be stopped" { 1..=3 } else { 0..=seconds_max };
    (random.u32(seconds), trouble)
}

/// A course that one may steer, most of the time.
pub(super) fn any_course(random: &mut fastrand::Rng) -> VectorCommand {
    let (seconds, trouble) = any_trouble(random, 12);
    steer(random.f64() * 370.0, seconds, trouble)
}

impl Service for Captain {
    fn subscriptions(&self) -> Vec<Prefix> {
        self.consumer.subscriptions()
    }

    fn goes_by_what_is_kept(&self) -> bool {
        true
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        for told in self.consumer.handle(now, &input, out) {
            if let ControlTold::Ended(task, outcome) = told
                && self.last == Some(task)
            {
                let outcome = match &outcome {
                    ControlOutcome::Command(outcome) => is_completed(outcome),
                    other => Err(format!("{other:?}")),
                };
                self.clock.stage.facts.tell(LastWord { by: self.source, outcome });
            }
        }
        if let Some(act) = self.clock.is_due(now, &input) {
            self.act(now, &act, out);
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        [self.consumer.next_deadline(), self.clock.next].into_iter().flatten().min()
    }
}
