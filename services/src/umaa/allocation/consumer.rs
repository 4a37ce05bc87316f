//! A consumer that asks for control of a resource first and commands its provider then (ICD 5.1.3, figure 26).

use super::super::command::{Consumer, ConsumerError, ConsumerSettings, Outcome, Recovery, Told};
use crate::service::{Input, Outbox};
use aldis_envelope::umaa::{Command, CommandState, DurationSeconds, OutOfRange, ResourceAllocationCommand};
use aldis_envelope::{DateTime, Guid, Guids, Monotonic, Now, Prefix, Source};
use std::collections::BTreeMap;
use std::time::Duration;

/// A task of a [`ControlledConsumer`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct TaskId(u64);

/// What is to be done, and with which resource.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan<C> {
    /// Who gives control.
    pub arbiter: Guid,
    /// The resource.
    pub resource: Guid,
    /// For how long control is asked for at a time; it is renewed at half of it while the command runs. None: until the end.
    pub duration: Option<Duration>,
    /// The provider of the command.
    pub provider: Guid,
    /// The command.
    pub command: C,
}

/// What a [`ControlledConsumer`] tells.
#[derive(Debug, Clone, PartialEq)]
pub enum ControlTold<E> {
    /// Control is given; the command goes out.
    Allocated(TaskId),
    /// Control has ended while the command runs. The provider ends the command where another consumer has control now.
    ControlLost(TaskId, Outcome),
    /// Something of the command, its end excepted.
    Command(TaskId, Told<E>),
    /// The task has ended.
    Ended(TaskId, ControlOutcome),
}

/// How a task ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ControlOutcome {
    /// The command went out and ended so. Control is given back.
    Command(Outcome),
    /// Control was not given, and nothing was commanded.
    NotAllocated(Outcome),
    /// Control was given, and the command did not go out.
    NotCommanded(ConsumerError),
}

/// Why a task cannot begin.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The consumer cannot start a command.
    #[error(transparent)]
    Consumer(#[from] ConsumerError),
    /// The duration is outside its range.
    #[error(transparent)]
    Duration(#[from] OutOfRange),
}

struct Task<C> {
    plan: Plan<C>,
    allocation: Guid,
    /// The command's session, once it is out.
    command: Option<Guid>,
    /// Whether its end has been told; control is being given back.
    ended: bool,
    has_control: bool,
    renew_at: Option<Monotonic>,
}

/// Consumes one kind of commands of providers that are guarded.
pub struct ControlledConsumer<C: Command> {
    allocations: Consumer<ResourceAllocationCommand>,
    commands: Consumer<C>,
    tasks: BTreeMap<TaskId, Task<C>>,
    tasks_begun: u64,
}

impl<C: Command> ControlledConsumer<C> {
    /// A consumer in the name of the service with these ids. What a former life left is cancelled: its tasks are not known
    /// any more.
    pub fn new(source: Source, guids: Guids, settings: ConsumerSettings) -> Self {
        let settings = ConsumerSettings { recovery: Recovery::Cancel, ..settings };
        Self {
            allocations: Consumer::new(source, guids.clone(), settings.clone()),
            commands: Consumer::new(source, guids, settings),
            tasks: BTreeMap::new(),
            tasks_begun: 0,
        }
    }

    /// What the service has to subscribe to for it.
    pub fn subscriptions(&self) -> Vec<Prefix> {
        self.allocations.subscriptions().into_iter().chain(self.commands.subscriptions()).collect()
    }

    /// Begins a task: asks for control.
    ///
    /// # Errors
    /// [`PlanError`] when too many commands are on the bus, or the duration is outside its range.
    pub fn start(&mut self, now: Now, plan: Plan<C>, out: &mut Outbox) -> Result<TaskId, PlanError> {
        let allocation = self.allocations.start(now, plan.arbiter, ask(&plan)?, out)?;
        self.tasks_begun += 1;
        let task = TaskId(self.tasks_begun);
        let (command, renew_at) = (None, None);
        let (ended, has_control) = (false, false);
        self.tasks.insert(task, Task { plan, allocation, command, ended, has_control, renew_at });
        Ok(task)
    }

    /// Cancels a task: its command, or what it asked for where it has no command yet.
    pub fn cancel(&mut self, now: Now, task: TaskId, out: &mut Outbox) {
        match self.tasks.get(&task) {
            Some(Task { command: Some(command), .. }) => self.commands.cancel(now, *command, out),
            Some(Task { allocation, .. }) => self.allocations.cancel(now, *allocation, out),
            None => {}
        }
    }

    /// Replaces the command of a task by a newer one of the same session (ICD 4.1.4.2).
    ///
    /// # Errors
    /// [`ConsumerError`] when the command is not on the bus, or not open any more.
    pub fn update(
        &mut self,
        now: Now,
        task: TaskId,
        command: C,
        out: &mut Outbox,
    ) -> Result<(), ConsumerError> {
        let session = self.tasks.get(&task).and_then(|task| task.command);
        self.commands.update(now, session.unwrap_or(Guid::NIL), command, out)
    }

    /// The tasks whose ends have not been told.
    pub fn tasks(&self) -> Vec<TaskId> {
        self.tasks.iter().filter(|(_, task)| !task.ended).map(|(&id, _)| id).collect()
    }

    /// Takes one input of the service, and says what came of it.
    pub fn handle(
        &mut self,
        now: Now,
        input: &Input<'_>,
        out: &mut Outbox,
    ) -> Vec<ControlTold<C::ExecutionStatus>> {
        let mut told = Vec::new();
        // At the end a command is disposed before the control that it needs.
        let commands = self.commands.handle(now, input, out);
        let allocations = self.allocations.handle(now, input, out);
        for news in allocations {
            self.allocation_told(now, news, &mut told, out);
        }
        for news in commands {
            self.command_told(now, news, &mut told, out);
        }
        self.renew(now, out);
        told
    }

    /// When it wants [`Input::Deadline`].
    pub fn next_deadline(&self) -> Option<Monotonic> {
        let consumers = [self.allocations.next_deadline(), self.commands.next_deadline()];
        let renewals = self.tasks.values().filter_map(|task| task.renew_at);
        consumers.into_iter().flatten().chain(renewals).min()
    }

    fn allocation_told(
        &mut self,
        now: Now,
        news: Told<aldis_envelope::umaa::NoExecutionStatus>,
        told: &mut Vec<ControlTold<C::ExecutionStatus>>,
        out: &mut Outbox,
    ) {
        let of = |session: Guid| move |(_, task): &(&TaskId, &mut Task<C>)| task.allocation == session;
        match news {
            Told::State { session, state: CommandState::Executing, .. } => {
                let Some((&id, task)) = self.tasks.iter_mut().find(of(session)) else { return };
                task.renew_at = task.plan.duration.map(|duration| now.monotonic + duration / 2);
                if std::mem::replace(&mut task.has_control, true) || task.ended {
                    return;
                }
                told.push(ControlTold::Allocated(id));
                match self.commands.start(now, task.plan.provider, task.plan.command.clone(), out) {
                    Ok(command) => task.command = Some(command),
                    Err(why) => {
                        (task.ended, task.renew_at) = (true, None);
                        told.push(ControlTold::Ended(id, ControlOutcome::NotCommanded(why)));
                        self.allocations.cancel(now, session, out);
                    }
                }
            }
            Told::Ended { session, outcome } => {
                let Some((&id, task)) = self.tasks.iter_mut().find(of(session)) else { return };
                task.renew_at = None;
                if task.ended || task.command.is_none() {
                    let ended = task.ended;
                    self.tasks.remove(&id);
                    if !ended {
                        told.push(ControlTold::Ended(id, ControlOutcome::NotAllocated(outcome)));
                    }
                } else {
                    task.has_control = false;
                    told.push(ControlTold::ControlLost(id, outcome));
                }
            }
            _ => {}
        }
    }

    fn command_told(
        &mut self,
        now: Now,
        news: Told<C::ExecutionStatus>,
        told: &mut Vec<ControlTold<C::ExecutionStatus>>,
        out: &mut Outbox,
    ) {
        let (Told::Recovered { session }
        | Told::State { session, .. }
        | Told::Execution { session, .. }
        | Told::Ended { session, .. }) = &news;
        let found = self.tasks.iter_mut().find(|(_, task)| task.command == Some(*session));
        let Some((&id, task)) = found else { return };
        let Told::Ended { outcome, .. } = news else {
            told.push(ControlTold::Command(id, news));
            return;
        };
        told.push(ControlTold::Ended(id, ControlOutcome::Command(outcome)));
        (task.ended, task.renew_at) = (true, None);
        let (allocation, has_control) = (task.allocation, task.has_control);
        if has_control {
            self.allocations.cancel(now, allocation, out);
        } else {
            self.tasks.remove(&id);
        }
    }

    /// Asks again in time, so that control is not lost (ICD 5.1.3).
    fn renew(&mut self, now: Now, out: &mut Outbox) {
        for task in self.tasks.values_mut().filter(|task| task.renew_at.is_some_and(|at| at <= now.monotonic))
        {
            task.renew_at = None;
            if let Ok(command) = ask(&task.plan) {
                // Where the session is not open any more, its end is about to be told.
                let _ = self.allocations.update(now, task.allocation, command, out);
            }
        }
    }
}

/// The command that asks for control; the members that all commands have are set when it goes out.
fn ask<C>(plan: &Plan<C>) -> Result<ResourceAllocationCommand, OutOfRange> {
    Ok(ResourceAllocationCommand {
        duration: plan.duration.map(DurationSeconds::try_from).transpose()?,
        resource_id: plan.resource,
        time_stamp: DateTime::default(),
        source: Guid::NIL,
        session_id: Guid::NIL,
        destination: plan.arbiter,
    })
}
