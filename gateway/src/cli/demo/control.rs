//! Consumers on shore that ask for the autopilots of boats (UMAA ResourceAllocation); two contend for one.

use super::board::{Board, Control};
use crate::cli::member::Desk;
use aldis_envelope::umaa::{
    CommandState, CommandStatusReason, DurationSeconds, NoExecutionStatus, ResourceAllocationCommand,
};
use aldis_envelope::{DateTime, EntityId, Guid, Guids, Monotonic, Now, Prefix, ServiceId, Source};
use aldis_services::umaa::command::{Consumer, ConsumerSettings, Outcome, Told};
use aldis_services::{Input, Outbox};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// The name of the resource.
pub(super) const RESOURCE: &str = "autopilot";
/// The services of the contenders on shore, from low to high priority.
pub(super) const PLANNER: u64 = 101;
/// The one of higher priority.
pub(super) const OPERATOR: u64 = 102;
/// The one that asks for the boat whose arbiter crashes.
pub(super) const SURVEYOR: u64 = 103;

/// How a contender goes about it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Habit {
    /// For how long it wants control.
    pub(super) span: Duration,
    /// How long it waits after one command has ended until the next.
    pub(super) pause: Duration,
}

impl Control {
    /// What counts how a command ended.
    fn of(&mut self, outcome: &Outcome) -> &mut u64 {
        match outcome {
            Outcome::Completed => &mut self.expired,
            Outcome::Failed { reason: CommandStatusReason::Interrupted, .. } => &mut self.taken_over,
            Outcome::Failed { reason: CommandStatusReason::ResourceRejected, .. } => &mut self.rejected,
            _ => &mut self.otherwise,
        }
    }
}

/// Asks for control again and again.
pub(super) struct Contender {
    board: Arc<Mutex<Board>>,
    consumer: Consumer<ResourceAllocationCommand>,
    arbiter: Guid,
    boat: EntityId,
    resource: Guid,
    habit: Habit,
    next: Option<Monotonic>,
    /// How often an arbiter had crashed when control was given.
    crashes: u64,
}

impl Contender {
    pub(super) fn new(
        board: Arc<Mutex<Board>>,
        guids: &Guids,
        source: Source,
        boat: EntityId,
        habit: Habit,
    ) -> Self {
        let arbiter = guids.of_service(Source::new(boat, ServiceId::ALLOCATION));
        let consumer = Consumer::new(source, guids.clone(), ConsumerSettings::default());
        let resource = guids.of_resource(boat, RESOURCE);
        Self { board, consumer, arbiter, boat, resource, habit, next: None, crashes: 0 }
    }

    /// What its service has to subscribe to.
    pub(super) fn subscriptions(&self) -> Vec<Prefix> {
        self.consumer.subscriptions()
    }

    fn board(&self) -> MutexGuard<'_, Board> {
        self.board.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn ask(&mut self, now: Now, out: &mut Outbox) {
        self.next = None;
        let command = ResourceAllocationCommand {
            duration: DurationSeconds::new(self.habit.span.as_secs_f64()).ok(),
            resource_id: self.resource,
            time_stamp: DateTime::default(),
            source: Guid::default(),
            session_id: Guid::default(),
            destination: Guid::default(),
        };
        if self.consumer.start(now, self.arbiter, command, out).is_err() {
            self.next = Some(now.monotonic + self.habit.pause);
        }
    }

    fn told(&mut self, now: Now, told: Told<NoExecutionStatus>) {
        let boat = self.boat;
        match told {
            Told::State { state: CommandState::Executing, .. } => {
                let mut board = self.board();
                let crashes = board.crashes.load(Ordering::Relaxed);
                board.control_of(boat).into_iter().for_each(|control| control.given += 1);
                drop(board);
                self.crashes = crashes;
            }
            Told::Ended { outcome, .. } => {
                self.next = Some(now.monotonic + self.habit.pause);
                let mut board = self.board();
                let has_crashed = board.crashes.load(Ordering::Relaxed) > self.crashes;
                if let Some(control) = board.control_of(boat) {
                    *control.of(&outcome) += 1;
                    control.recovered += u64::from(has_crashed && outcome == Outcome::Completed);
                }
            }
            _ => {}
        }
    }
}

impl Desk for Contender {
    fn take(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        for told in self.consumer.handle(now, &input, out) {
            self.told(now, told);
        }
        match input {
            Input::Shutdown => self.next = None,
            // The boat must be there: before its first word nobody answers.
            Input::HistoryComplete(_) => self.next = Some(now.monotonic + self.habit.pause),
            Input::Deadline if self.next.is_some_and(|at| at <= now.monotonic) => {
                let is_there = self.board().boats.contains_key(&self.boat);
                if is_there {
                    self.ask(now, out);
                } else {
                    self.next = Some(now.monotonic + self.habit.pause);
                }
            }
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        [self.consumer.next_deadline(), self.next].into_iter().flatten().min()
    }
}
