//! The shore station's service: hears the boats, and calls them each second.

use super::board::{Board, SILENCED};
use super::{control, linked};
use crate::cli::member::Desk;
use aldis_envelope::aldis::{self, NodeStatus};
use aldis_envelope::umaa::{self, ErrorCondition, HealthReport, ResourceAllocationReport, Topic};
use aldis_envelope::{
    Address, CallId, Change, ContentType, Descriptor, EntityId, Envelope, Guid, Guids, Message, Monotonic,
    Now, Refusal, ServiceId, Source, Wall, lmcp,
};
use aldis_services::sim::link::Profile;
use aldis_services::{Input, Outbox, track};
use bytes::Bytes;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc};
use std::time::Duration;

/// How often each boat is called.
const CALL_EVERY: Duration = Duration::from_secs(1);
/// Over bad links boats are called less often, and have more time.
const CALL_EVERY_LINKED: Duration = Duration::from_secs(10);
const CALL_WITHIN_LINKED: Duration = Duration::from_secs(8);
/// How often the desk looks at the time, and whether it is to finish.
const TICK: Duration = Duration::from_millis(100);
/// How long a call may take: several hundred times a round trip here.
const CALL_WITHIN: Duration = Duration::from_millis(900);

enum Purpose {
    /// A ping of a boat, made then, while it was or was not silenced.
    Ping(EntityId, Monotonic, bool),
    /// The status of a node, at the end.
    Status,
}

/// The shore station's service.
pub(super) struct ShoreDesk {
    board: Arc<Mutex<Board>>,
    guids: Guids,
    boats: Vec<EntityId>,
    finish: Arc<AtomicBool>,
    tell: mpsc::Sender<Vec<NodeStatus>>,
    open: BTreeMap<CallId, Purpose>,
    statuses: Vec<NodeStatus>,
    health: BTreeMap<(EntityId, Guid), ErrorCondition>,
    next: Option<Monotonic>,
    next_call: Option<Monotonic>,
    finishing: bool,
    is_linked: bool,
}

impl ShoreDesk {
    pub(super) fn new(
        board: Arc<Mutex<Board>>,
        guids: Guids,
        boats: Vec<EntityId>,
        finish: Arc<AtomicBool>,
        tell: mpsc::Sender<Vec<NodeStatus>>,
    ) -> Self {
        Self {
            board,
            guids,
            boats,
            finish,
            tell,
            open: BTreeMap::new(),
            statuses: Vec::new(),
            health: BTreeMap::new(),
            next: None,
            next_call: None,
            finishing: false,
            is_linked: false,
        }
    }

    /// The boats are behind bad links, or not.
    pub(super) fn over(self, link: Option<&Profile>) -> Self {
        Self { is_linked: link.is_some(), ..self }
    }

    fn call_every(&self) -> Duration {
        if self.is_linked { CALL_EVERY_LINKED } else { CALL_EVERY }
    }

    fn call(&self, entity: EntityId, request: &str, out: &mut Outbox) -> Option<CallId> {
        let to = Address::Service(Source::new(entity, ServiceId::NODE));
        let descriptor = Descriptor::new(request).ok()?;
        let within = match (self.is_linked, self.finishing) {
            (false, _) => CALL_WITHIN,
            (true, false) => CALL_WITHIN_LINKED,
            (true, true) => linked::STATUS_WITHIN,
        };
        Some(out.call(to, ContentType::Aldis, descriptor, Bytes::new(), within))
    }

    fn board(&self) -> MutexGuard<'_, Board> {
        self.board.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn tick(&mut self, now: Now, out: &mut Outbox) {
        self.next = Some(now.monotonic + TICK);
        self.board().now = now.monotonic;
        if self.finish.load(Ordering::Relaxed) {
            self.ask_statuses(out);
        } else if self.next_call.is_none_or(|at| at <= now.monotonic) {
            self.next_call = Some(now.monotonic + self.call_every());
            self.call_boats(now, out);
        }
    }

    /// Calls the boats that have been heard: before its first word a boat is not expected to answer.
    fn call_boats(&mut self, now: Now, out: &mut Outbox) {
        let silenced = self.board().silenced;
        for boat in self.boats.clone() {
            if !self.board().boats.contains_key(&boat) {
                continue;
            }
            if let Some(id) = self.call(boat, aldis::PING, out) {
                let is_silenced = silenced == Some(boat.get());
                self.open.insert(id, Purpose::Ping(boat, now.monotonic, is_silenced));
            }
        }
    }

    fn ask_statuses(&mut self, out: &mut Outbox) {
        if std::mem::replace(&mut self.finishing, true) {
            return;
        }
        let own = out.source().entity;
        for entity in self.boats.clone().into_iter().chain([own]) {
            if let Some(id) = self.call(entity, aldis::NODE_QUERY, out) {
                self.open.insert(id, Purpose::Status);
            }
        }
    }

    fn heard(&mut self, now: Now, envelope: &Envelope) {
        let message = &envelope.message;
        let entity = message.label.source().entity;
        if message.label.descriptor() == track::DESCRIPTOR {
            let position = lmcp::position(&message.content);
            let mut board = self.board();
            if self.is_linked {
                board.linked.heard(entity, now.wall.0 - envelope.stamp.source_time.0);
            }
            let boat = board.boats.entry(entity).or_default();
            boat.heard = Some(now.monotonic);
            boat.states += 1;
            if let Some(position) = position {
                (boat.latitude, boat.longitude) = (position.latitude, position.longitude);
            }
        } else if message.label.descriptor() == ResourceAllocationReport::NAME {
            self.reported(entity, message);
        } else if message.change == Change::Put
            && let Ok(report) = umaa::decode::<HealthReport>(&message.content)
        {
            self.health.insert((entity, report.resource_id), report.severity);
            let worst =
                worst(self.health.range((entity, Guid::default())..).take_while(|((e, _), _)| *e == entity));
            if let Some(boat) = self.board().boats.get_mut(&entity) {
                boat.reports += 1;
                boat.worst = worst;
            }
        }
    }

    /// Who controls a boat's autopilot, as its arbiter says.
    fn reported(&self, boat: EntityId, message: &Message) {
        let report = umaa::decode::<ResourceAllocationReport>(&message.content).ok();
        let autopilot = self.guids.of_resource(boat, control::RESOURCE);
        let info = report.and_then(|report| {
            report.control_info.iter().find(|info| info.resource_id == autopilot).cloned()
        });
        let session = info.and_then(|info| info.control_session);
        let named = |guid: Guid| self.guids.service(guid).map_or_else(|| guid.to_string(), |s| s.to_string());
        let holder = session.map(|session| {
            let end = session.end_time.map(|end| Wall::from(end).to_string());
            (named(session.controlling_consumer), end)
        });
        self.board().control_of(boat).into_iter().for_each(|control| control.holder.clone_from(&holder));
    }

    fn ended(&mut self, now: Now, id: CallId, outcome: Result<(), Refusal>) {
        match self.open.remove(&id) {
            Some(Purpose::Ping(boat, since, was_silenced)) => {
                let mut board = self.board();
                let excused = was_silenced || board.silenced == Some(boat.get()) || boat.get() == SILENCED;
                board.failed_elsewhere += u64::from(outcome.is_err() && !excused);
                let boat = board.boats.entry(boat).or_default();
                match outcome {
                    Ok(()) => {
                        boat.calls_ok += 1;
                        boat.round_trip = Some(now.monotonic - since);
                    }
                    Err(why) => {
                        boat.calls_failed += 1;
                        boat.last_failure = why.to_string();
                    }
                }
            }
            Some(Purpose::Status) | None => {}
        }
        if self.finishing && !self.open.values().any(|purpose| matches!(purpose, Purpose::Status)) {
            // The demo no longer listens where it has been cut off.
            let _ = self.tell.send(std::mem::take(&mut self.statuses));
        }
    }
}

/// The worst of some conditions. Their numbers on the wire are alphabetical, not by badness.
fn worst<'a>(
    reports: impl Iterator<Item = (&'a (EntityId, Guid), &'a ErrorCondition)>,
) -> Option<ErrorCondition> {
    let badness = |condition: &ErrorCondition| match condition {
        ErrorCondition::None => 0,
        ErrorCondition::Info => 1,
        ErrorCondition::Warn => 2,
        ErrorCondition::Error => 3,
        ErrorCondition::Fail => 4,
    };
    reports.map(|(_, condition)| *condition).max_by_key(badness)
}

impl Desk for ShoreDesk {
    fn take(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            Input::Started | Input::Deadline => self.tick(now, out),
            Input::Message(envelope) if envelope.message.call.is_some() => {
                self.statuses.extend(aldis::decode::<NodeStatus>(&envelope.message.content));
            }
            Input::Message(envelope) => self.heard(now, envelope),
            Input::CallEnded(id, outcome) => self.ended(now, id, outcome),
            Input::Shutdown => self.next = None,
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.next
    }
}
