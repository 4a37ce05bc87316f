//! A simulated vehicle that follows the missions of who is in control of it.

use super::{Control, is_lmcp, readable};
use crate::service::{Input, Level, Outbox, Service};
use crate::umaa::allocation::Guard;
use crate::umaa::command::{Admission, Failure, Verdict};
use crate::uxas::kinematic::{Kinematic, KinematicConfig};
use crate::uxas::machine::{Hosted, Post};
use aldis_envelope::lmcp::cmasi::{MissionCommand, ServiceStatusType};
use aldis_envelope::lmcp::{self, Struct};
use aldis_envelope::{Envelope, Guids, Monotonic, Now, Prefix, Source};

/// The service.
pub struct GuardedVehicle {
    vehicle: Hosted<Kinematic>,
    number: i64,
    guard: Guard,
    guids: Guids,
    control: Control,
    /// Whose mission it follows.
    follows: Option<Source>,
    /// A mission that came before it was known who is in control.
    waiting: Option<Envelope>,
}

impl GuardedVehicle {
    /// The service with these ids.
    pub fn new(own: Source, guids: &Guids, config: KinematicConfig, control: Control) -> Self {
        Self {
            vehicle: Hosted::new(Kinematic::new(config)),
            number: config.vehicle,
            guard: Guard::new(own, guids.clone(), control.guard(guids)),
            guids: guids.clone(),
            control,
            follows: None,
            waiting: None,
        }
    }

    fn admits(&self, now: Now, sender: Source) -> Verdict {
        self.guard.admits(now, self.guids.of_service(sender))
    }

    fn mission(&mut self, now: Now, envelope: &Envelope, out: &mut Outbox) {
        let decoded = lmcp::decode(&envelope.message.content).ok();
        let mission = decoded.as_ref().and_then(|object| object.get::<MissionCommand>());
        let Some(mission) = mission.filter(|mission| mission.vehicle_id == self.number) else { return };
        let sender = envelope.message.label.source();
        match self.admits(now, sender) {
            Verdict::Valid => {
                self.follows = Some(sender);
                self.vehicle.handle(now, Input::Message(envelope), out);
            }
            Verdict::Later => self.waiting = Some(envelope.clone()),
            // What a task or a planner ashore says is served by the manager beside it, which is in control.
            Verdict::Failed(_) if self.follows.is_some_and(|other| other.entity == sender.entity) => {}
            Verdict::Failed(why) => {
                let what = format!("mission {} of {sender} is refused", mission.command_id);
                self.tell(now, &what, &why, out);
            }
        }
    }

    /// Stops where the sender of its mission is not in control any more.
    fn check(&mut self, now: Now, out: &mut Outbox) {
        let Some(sender) = self.follows else { return };
        let Verdict::Failed(why) = self.admits(now, sender) else { return };
        self.follows = None;
        if let Some(mission) = self.vehicle.machine().halt(&mut Post::new(now, out)) {
            self.tell(now, &format!("stops in mission {mission} of {sender}"), &why, out);
        }
    }

    fn tell(&self, now: Now, what: &str, why: &Failure, out: &mut Outbox) {
        let text =
            format!("vehicle {}: {what}: {}", self.number, readable(&why.text, &self.control, &self.guids));
        out.note(Level::Warning, text.clone());
        Post::new(now, out).status(ServiceStatusType::Error, &[("Vehicle", text.as_str())]);
    }
}

impl Service for GuardedVehicle {
    fn subscriptions(&self) -> Vec<Prefix> {
        self.vehicle.subscriptions().into_iter().chain(self.guard.subscriptions()).collect()
    }

    fn follows_bus(&self) -> bool {
        true
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        self.guard.observe(now, &input, out);
        self.check(now, out);
        if let Some(waiting) = self.waiting.take() {
            self.mission(now, &waiting, out);
        }
        match input {
            Input::Message(envelope) if is_lmcp(envelope, MissionCommand::TYPE.full_name) => {
                self.mission(now, envelope, out);
            }
            other => self.vehicle.handle(now, other, out),
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        [self.vehicle.next_deadline(), self.guard.next_deadline()].into_iter().flatten().min()
    }
}
