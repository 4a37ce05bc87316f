//! Executes allocation commands: who controls what until when, and the report that tells it.

mod report;

use super::super::command::Writer;
use super::super::command::{
    Commanded, Executor, Failure, FailureKind, Progress, SessionId, Stop, Stopped, Verdict,
};
use super::settings::{Arbitration, repeat_every};
use crate::service::{Input, Outbox};
use aldis_envelope::umaa::{
    CommandState, NoExecutionStatus, ResourceAllocationCommand, ResourceAllocationControlSession,
    ResourceAllocationReport, Topic,
};
use aldis_envelope::{DateTime, Guid, Monotonic, Now, Prefix, Source, Wall};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// Whether the readers of the report know of a holder.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Confirmation {
    /// The report that names it is not sent yet.
    Unsent,
    /// It is sent and waits for its readers under this number.
    Sent(u64),
    /// All have it.
    Given,
    /// Not all had it in time.
    Refused(String),
}

/// A consumer in control, or about to be.
#[derive(Debug, Clone)]
struct Hold {
    session: SessionId,
    /// When control ends, on the own clock and as the report says it.
    ends: Option<(Monotonic, DateTime)>,
    confirmation: Confirmation,
}

/// A resource with its list and its holder.
struct Managed {
    name: String,
    priorities: Vec<Guid>,
    hold: Option<Hold>,
}

impl Managed {
    /// A consumer's place in the list; a higher one goes before.
    fn rank(&self, consumer: Guid) -> Option<usize> {
        self.priorities.iter().position(|known| *known == consumer)
    }
}

/// How a session ends that another one took the place of.
#[derive(Debug, Clone)]
enum Ending {
    /// A consumer of higher priority took over.
    Interrupted(Guid),
    /// The same consumer has begun another.
    Replaced,
    /// Likewise, before its readers have confirmed the report.
    ReplacedUnconfirmed,
}

/// All control of all resources.
pub(super) struct Control {
    guid: Guid,
    resources: BTreeMap<Guid, Managed>,
    reports: Writer<ResourceAllocationReport>,
    acknowledge_within: Duration,
    repeat_every: Duration,
    ending: BTreeMap<SessionId, Ending>,
    /// Who controlled what in a former life.
    former: BTreeMap<Guid, ResourceAllocationControlSession>,
    rivals: BTreeSet<Guid>,
    stage: Stage,
    /// Whether the report no longer says what is so.
    changed: bool,
    next_number: u64,
    next_repeat: Option<Monotonic>,
}

/// What the report is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// That of the former life stands.
    Listening,
    /// It is the own.
    Reporting,
    /// The service shuts down.
    Closing,
    /// There is none any more.
    Closed,
}

impl Control {
    pub(super) fn new(source: Source, guid: Guid, arbitration: &Arbitration) -> Self {
        let settings = arbitration.settings();
        let resources = settings.resources.iter().map(|resource| {
            let (name, priorities) = (resource.name.clone(), resource.priorities.clone());
            (resource.id, Managed { name, priorities, hold: None })
        });
        Self {
            guid,
            resources: resources.collect(),
            reports: Writer::new(source),
            acknowledge_within: settings.acknowledge_within,
            repeat_every: repeat_every(settings.reader_lease),
            ending: BTreeMap::new(),
            former: BTreeMap::new(),
            rivals: BTreeSet::new(),
            stage: Stage::Listening,
            changed: false,
            next_number: 1,
            next_repeat: None,
        }
    }

    /// A new list for a resource. It does not move control that is held (ICD 5.1.3).
    pub(super) fn set_priorities(&mut self, resource: Guid, priorities: Vec<Guid>) {
        if let Some(managed) = self.resources.get_mut(&resource) {
            managed.priorities = priorities;
        }
    }

    /// Why a consumer does not get control of a resource, if it does not.
    fn objection(managed: &Managed, session: SessionId) -> Option<String> {
        let name = &managed.name;
        if managed.priorities.is_empty() {
            return Some(format!("no priorities are set for {name}: nobody can control it"));
        }
        let Some(rank) = managed.rank(session.source) else {
            return Some(format!("{} is not on the priority list of {name}", session.source));
        };
        let holder = managed.hold.as_ref().map(|hold| hold.session.source)?;
        // A holder that is on the list no more goes after everybody who is.
        let outranked = holder != session.source && managed.rank(holder).is_some_and(|held| held > rank);
        outranked.then(|| format!("{holder}, which goes before, controls {name}"))
    }

    /// Gives control; whoever had it loses it.
    fn give(&mut self, now: Now, session: SessionId, command: &ResourceAllocationCommand) {
        let duration = command.duration.map(Duration::from);
        let ends = duration.map(|duration| {
            let nanoseconds = i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX);
            (now.monotonic + duration, DateTime::from(Wall(now.wall.0.saturating_add(nanoseconds))))
        });
        let Some(managed) = self.resources.get_mut(&command.resource_id) else { return };
        let hold = Hold { session, ends, confirmation: Confirmation::Unsent };
        if let Some(before) = managed.hold.replace(hold).filter(|before| before.session != session) {
            let is_given = before.confirmation == Confirmation::Given;
            let ending = match (before.session.source == session.source, is_given) {
                (true, true) => Ending::Replaced,
                (true, false) => Ending::ReplacedUnconfirmed,
                (false, _) => Ending::Interrupted(session.source),
            };
            self.ending.insert(before.session, ending);
        }
        self.changed = true;
    }

    /// Takes control back from a session, everywhere but at one resource.
    fn take_back(&mut self, session: SessionId, except: Option<Guid>) {
        for (resource, managed) in &mut self.resources {
            if Some(*resource) != except && managed.hold.as_ref().is_some_and(|hold| hold.session == session)
            {
                managed.hold = None;
                self.changed = true;
            }
        }
    }

    fn hold(&self, session: SessionId) -> Option<&Hold> {
        self.resources
            .values()
            .filter_map(|managed| managed.hold.as_ref())
            .find(|hold| hold.session == session)
    }

    /// The readers have answered, or not in time.
    fn confirmed(&mut self, number: u64, confirmation: Confirmation) {
        let holds = self.resources.values_mut().filter_map(|managed| managed.hold.as_mut());
        for hold in holds.filter(|hold| hold.confirmation == Confirmation::Sent(number)) {
            hold.confirmation = confirmation.clone();
        }
    }
}

impl Executor<ResourceAllocationCommand> for Control {
    fn validate(
        &mut self,
        _: Now,
        commanded: Commanded<'_, ResourceAllocationCommand>,
        _: &mut Outbox,
    ) -> Verdict {
        let resource = commanded.command.resource_id;
        if self.resources.contains_key(&resource) {
            return Verdict::Valid;
        }
        // An update may ask for another resource than its session controls.
        self.take_back(commanded.id, None);
        Verdict::Failed(Failure::new(
            FailureKind::Invalid,
            format!("{resource} is no resource of this arbiter"),
        ))
    }

    fn start(
        &mut self,
        now: Now,
        commanded: Commanded<'_, ResourceAllocationCommand>,
        _: &mut Outbox,
    ) -> Progress<NoExecutionStatus> {
        let (id, command) = (commanded.id, commanded.command);
        self.take_back(id, Some(command.resource_id));
        let objection =
            self.resources.get(&command.resource_id).and_then(|managed| Self::objection(managed, id));
        match objection {
            Some(text) => {
                self.take_back(id, None);
                Progress::Failed(Failure::new(FailureKind::Rejected, text))
            }
            None => {
                self.give(now, id, command);
                Progress::Waiting
            }
        }
    }

    fn progress(
        &mut self,
        now: Now,
        commanded: Commanded<'_, ResourceAllocationCommand>,
        _: &mut Outbox,
    ) -> Progress<NoExecutionStatus> {
        let id = commanded.id;
        if let Some(ending) = self.ending.remove(&id) {
            return ending.progress();
        }
        let Some(hold) = self.hold(id) else {
            return Progress::Failed(Failure::new(FailureKind::Service, "control is lost"));
        };
        match &hold.confirmation {
            Confirmation::Unsent | Confirmation::Sent(_) => Progress::Waiting,
            Confirmation::Refused(why) => {
                let failure = Failure::new(FailureKind::TimedOut, format!("the report is {why}"));
                self.take_back(id, None);
                Progress::Failed(failure)
            }
            Confirmation::Given if hold.ends.is_some_and(|(at, _)| at <= now.monotonic) => {
                self.take_back(id, None);
                Progress::Completed
            }
            Confirmation::Given => Progress::Running(None),
        }
    }

    fn stop(
        &mut self,
        _: Now,
        commanded: Commanded<'_, ResourceAllocationCommand>,
        why: Stop,
        _: &mut Outbox,
    ) -> Stopped {
        // A renewal keeps control while it is looked at: the report shows the holder throughout.
        if why != Stop::Updated {
            self.take_back(commanded.id, None);
            self.ending.remove(&commanded.id);
        }
        Stopped::Now
    }

    /// Control goes on where the former life's report says that it was given, and is free.
    fn recover(
        &mut self,
        now: Now,
        commanded: Commanded<'_, ResourceAllocationCommand>,
        state: CommandState,
    ) -> bool {
        if state != CommandState::Executing {
            return true;
        }
        let resource = commanded.command.resource_id;
        let former = self.former.get(&resource);
        let Some(former) = former.filter(|former| former.controlling_consumer == commanded.id.source) else {
            return false;
        };
        let Some(managed) = self.resources.get_mut(&resource).filter(|managed| managed.hold.is_none()) else {
            return false;
        };
        // The wall clock may have stepped back meanwhile: control does not last longer than it was asked for.
        let most = commanded.command.duration.map_or(Duration::MAX, Duration::from);
        let ends = former.end_time.map(|end| {
            let left = Wall::from(end).0.saturating_sub(now.wall.0);
            let left = Duration::from_nanos(u64::try_from(left).unwrap_or(0)).min(most);
            (now.monotonic + left, end)
        });
        managed.hold = Some(Hold { session: commanded.id, ends, confirmation: Confirmation::Given });
        true
    }

    /// The report of this life does not name whose command is not there, and another may be given control.
    fn awaits_lost_commands(&self) -> bool {
        false
    }

    /// The reports of other arbiters.
    fn subscriptions(&self) -> Vec<Prefix> {
        Prefix::new(ResourceAllocationReport::NAME).into_iter().collect()
    }

    fn observe(&mut self, _: Now, input: &Input<'_>, out: &mut Outbox) {
        match input {
            Input::Recovered(envelope) => self.recovered(envelope, out),
            Input::Message(envelope) => self.rival(envelope, out),
            Input::HistoryComplete(_) if self.stage == Stage::Listening => {
                (self.stage, self.changed) = (Stage::Reporting, true);
            }
            Input::Confirmed(number, Ok(())) => self.confirmed(*number, Confirmation::Given),
            Input::Confirmed(number, Err(why)) => {
                self.confirmed(*number, Confirmation::Refused(why.to_string()));
            }
            Input::Shutdown => self.stage = Stage::Closing,
            _ => {}
        }
    }

    fn settled(&mut self, now: Now, out: &mut Outbox) {
        self.tell(now, out);
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        let holds = self.resources.values().filter_map(|managed| managed.hold.as_ref());
        let given = holds.filter(|hold| hold.confirmation == Confirmation::Given);
        given.filter_map(|hold| hold.ends).map(|(at, _)| at).chain(self.next_repeat).min()
    }
}

impl Ending {
    fn progress(self) -> Progress<NoExecutionStatus> {
        match self {
            Self::Interrupted(by) => {
                let text = format!("{by}, which goes before, took over");
                Progress::Failed(super::super::command::decisions::failure_at_preemption(text))
            }
            Self::Replaced => Progress::Completed,
            // It was never in control, and must not say that it was: EXECUTING comes before COMPLETED.
            Self::ReplacedUnconfirmed => {
                let text = "a newer session of the same consumer took its place before control was given";
                Progress::Failed(super::super::command::decisions::failure_at_preemption(text))
            }
        }
    }
}
