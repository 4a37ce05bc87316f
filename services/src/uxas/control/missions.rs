//! A `WaypointPlanManager` that serves a mission while it is in control of the vehicle.

use super::{Control, is_lmcp, readable};
use crate::service::{Input, Level, Outbox, Service};
use crate::umaa::command::{Consumer, ConsumerSettings, Outcome, Told};
use crate::uxas::machine::{Hosted, LOST_KEY, Post};
use crate::uxas::waypoint_manager::{WaypointConfig, WaypointManager};
use aldis_envelope::lmcp::cmasi::{AutomationResponse, EntityState, MissionCommand, ServiceStatusType};
use aldis_envelope::lmcp::{self, Struct};
use aldis_envelope::umaa::{CommandState, DurationSeconds, NoExecutionStatus, ResourceAllocationCommand};
use aldis_envelope::{DateTime, Envelope, Guid, Guids, Monotonic, Now, Prefix, Source};

/// What it has of control.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Held {
    /// Nothing, and wants none.
    Nothing,
    /// It asks in this session.
    Asking(Guid),
    /// It is in control by this session, and asks again at this moment.
    InControl(Guid, Option<Monotonic>),
}

/// A mission that waits for control.
struct Waiting {
    envelope: Envelope,
    command: i64,
}

/// The service.
pub struct ControlledMissions {
    manager: Hosted<WaypointManager>,
    vehicle: i64,
    consumer: Consumer<ResourceAllocationCommand>,
    control: Control,
    own: Source,
    guids: Guids,
    arbiter: Guid,
    resource: Guid,
    held: Held,
    waiting: Option<Waiting>,
}

impl ControlledMissions {
    /// The service with these ids.
    pub fn new(own: Source, guids: &Guids, config: WaypointConfig, control: Control) -> Self {
        // Who does not answer a renewal in time is given up when the time is over, not later.
        let answer_within = control.duration / 2;
        let settings = ConsumerSettings { answer_within, ..ConsumerSettings::default() };
        Self {
            manager: Hosted::new(WaypointManager::new(config)),
            vehicle: config.vehicle,
            consumer: Consumer::new(own, guids.clone(), settings),
            own,
            guids: guids.clone(),
            arbiter: guids.of_service(control.arbiter()),
            resource: control.guid(guids),
            control,
            held: Held::Nothing,
            waiting: None,
        }
    }

    /// The number of the mission that a message has for the vehicle.
    fn mission_in(&self, envelope: &Envelope) -> Option<i64> {
        // Another shore's missions are its own to serve, under its own control.
        let is_own = envelope.message.label.source().entity == self.own.entity;
        let is_mission = |name| is_lmcp(envelope, name);
        let is_either =
            is_mission(MissionCommand::TYPE.full_name) || is_mission(AutomationResponse::TYPE.full_name);
        if !is_own || !is_either {
            return None;
        }
        let object = lmcp::decode(&envelope.message.content).ok()?;
        let of_vehicle = |mission: &&MissionCommand| mission.vehicle_id == self.vehicle;
        if let Some(response) = object.get::<AutomationResponse>() {
            let mut missions = response.mission_command_list.iter().filter_map(|mission| mission.get());
            return missions.find(of_vehicle).map(|mission| mission.command_id);
        }
        object.get::<MissionCommand>().filter(of_vehicle).map(|mission| mission.command_id)
    }

    fn message(&mut self, now: Now, envelope: &Envelope, out: &mut Outbox) {
        let is_mission = is_lmcp(envelope, MissionCommand::TYPE.full_name)
            || is_lmcp(envelope, AutomationResponse::TYPE.full_name);
        if !is_mission {
            self.manager.handle(now, Input::Message(envelope), out);
            return self.give_back_at_the_end(now, envelope, out);
        }
        let Some(command) = self.mission_in(envelope) else { return };
        match self.held {
            Held::InControl(..) => self.manager.handle(now, Input::Message(envelope), out),
            held => {
                self.waiting = Some(Waiting { envelope: envelope.clone(), command });
                if held == Held::Nothing {
                    self.ask(now, out);
                }
            }
        }
    }

    fn wish(&self) -> Result<ResourceAllocationCommand, String> {
        Ok(ResourceAllocationCommand {
            duration: Some(DurationSeconds::try_from(self.control.duration).map_err(|why| why.to_string())?),
            resource_id: self.resource,
            time_stamp: DateTime::default(),
            source: Guid::NIL,
            session_id: Guid::NIL,
            destination: self.arbiter,
        })
    }

    fn ask(&mut self, now: Now, out: &mut Outbox) {
        let begun = self.wish().and_then(|wish| {
            self.consumer.start(now, self.arbiter, wish, out).map_err(|why| why.to_string())
        });
        match begun {
            Ok(session) => self.held = Held::Asking(session),
            Err(why) => self.lost(now, &why, out),
        }
    }

    fn renew(&mut self, now: Now, out: &mut Outbox) {
        let Held::InControl(session, Some(at)) = self.held else { return };
        if at > now.monotonic {
            return;
        }
        self.held = Held::InControl(session, None);
        if let Ok(wish) = self.wish() {
            // Where the session is not open any more, its end is about to be told.
            let _ = self.consumer.update(now, session, wish, out);
        }
    }

    fn told(&mut self, now: Now, news: Told<NoExecutionStatus>, out: &mut Outbox) {
        let (Held::Asking(own) | Held::InControl(own, _)) = self.held else { return };
        match news {
            Told::State { session, state: CommandState::Executing, .. } if session == own => {
                self.held = Held::InControl(own, Some(now.monotonic + self.control.duration / 2));
                if let Some(waiting) = self.waiting.take() {
                    self.manager.handle(now, Input::Message(&waiting.envelope), out);
                }
            }
            Told::Ended { session, outcome } if session == own => {
                let why = self.why(outcome);
                self.lost(now, &why, out);
            }
            _ => {}
        }
    }

    fn why(&self, outcome: Outcome) -> String {
        match outcome {
            Outcome::Completed => "its time is over".to_owned(),
            Outcome::Canceled => "it was given back".to_owned(),
            Outcome::Failed { reason, text } => {
                format!("{} ({reason})", readable(&text, &self.control, &self.guids))
            }
            Outcome::Unanswered => format!("the arbiter {} does not answer", self.control.arbiter()),
            Outcome::Abandoned => format!("the arbiter {} gave it up", self.control.arbiter()),
        }
    }

    /// There is no control: the mission ends here, and everybody learns why.
    fn lost(&mut self, now: Now, why: &str, out: &mut Outbox) {
        let (vehicle, resource) = (self.vehicle, &self.control.resource);
        let had = matches!(self.held, Held::InControl(..));
        let what = if had { "control is lost" } else { "control is not given" };
        let served = self.manager.machine().drop_mission();
        let waited = self.waiting.take().map(|waiting| waiting.command);
        self.held = Held::Nothing;
        let Some(command) = waited.or(served) else { return };
        let text = format!("mission {command} of vehicle {vehicle} ends: {what} of `{resource}`: {why}");
        out.note(Level::Warning, text.clone());
        let pairs = [("WaypointPlanManager", text.as_str()), (LOST_KEY, &vehicle.to_string())];
        Post::new(now, out).status(ServiceStatusType::Error, &pairs);
    }

    /// A vehicle that stays at the end of its mission is free for others.
    fn give_back_at_the_end(&mut self, now: Now, envelope: &Envelope, out: &mut Outbox) {
        let Held::InControl(session, _) = self.held else { return };
        let object = match envelope.message.label.attributes.content_type {
            aldis_envelope::ContentType::Lmcp => lmcp::decode(&envelope.message.content).ok(),
            _ => None,
        };
        let state = object.as_ref().and_then(|object| object.get::<EntityState>());
        if state.is_some_and(|state| self.manager.machine().is_done(state)) {
            self.manager.machine().drop_mission();
            self.held = Held::Nothing;
            self.consumer.cancel(now, session, out);
        }
    }
}

impl Service for ControlledMissions {
    fn subscriptions(&self) -> Vec<Prefix> {
        self.manager.subscriptions().into_iter().chain(self.consumer.subscriptions()).collect()
    }

    fn follows_bus(&self) -> bool {
        true
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        for news in self.consumer.handle(now, &input, out) {
            self.told(now, news, out);
        }
        match input {
            Input::Message(envelope) => self.message(now, envelope, out),
            other => self.manager.handle(now, other, out),
        }
        self.renew(now, out);
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        let renewal = match self.held {
            Held::InControl(_, at) => at,
            _ => None,
        };
        [self.manager.next_deadline(), self.consumer.next_deadline(), renewal].into_iter().flatten().min()
    }
}
