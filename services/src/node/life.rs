//! Services that come and go while the node runs.

use super::Node;
use crate::event::Effect;
use crate::host::Hosted;
use crate::service::{Condition, Input, Level, ServiceSpec};
use aldis_envelope::{Now, ServiceId, Source};

/// How many services a node runs at the most: a loop that creates them must not take all memory.
const SERVICES_MAX: usize = 4_096;
/// The smallest service id that may come and go; those below are built in or bridges.
const SERVICE_MIN: u32 = 100;

impl Node {
    /// Starts a service that another one wants.
    pub(super) fn spawn(&mut self, now: Now, by: Source, spec: ServiceSpec, effects: &mut Vec<Effect>) {
        let wanted = spec.source;
        let taken = self.services.iter().any(|h| h.spec.source == wanted && !h.is_removed());
        let why = if wanted.entity != by.entity {
            Some("it is of another entity".to_owned())
        } else if wanted.service.get() < SERVICE_MIN {
            Some(format!("ids below {SERVICE_MIN} are built in or bridges"))
        } else if taken {
            Some("the id is taken".to_owned())
        } else if self.services.len() >= SERVICES_MAX {
            Some(format!("{SERVICES_MAX} services are there"))
        } else {
            None
        };
        if let Some(why) = why {
            let text = format!("{by} cannot start service {wanted}: {why}");
            self.say(now, Level::Error, "not started", text, effects);
            return;
        }
        let place = self.place_for(wanted);
        let hosted = Hosted::new(spec);
        match self.services.get_mut(place) {
            Some(free) => *free = hosted,
            None => self.services.push(hosted),
        }
        self.start_service(now, place, effects);
    }

    /// A free place: the one that had these ids, so that no ids stand twice, or any.
    fn place_for(&self, wanted: Source) -> usize {
        let same = self.services.iter().position(|h| h.is_removed() && h.spec.source == wanted);
        let any = self.services.iter().position(Hosted::is_removed);
        same.or(any).unwrap_or(self.services.len())
    }

    /// Ends a service that another one wants ended, after its last words.
    pub(super) fn stop(&mut self, now: Now, by: Source, source: Source, effects: &mut Vec<Effect>) {
        let found = self.services.iter().position(|h| h.spec.source == source && !h.is_removed());
        let Some(place) = found.filter(|_| may_stop(by, source)) else {
            let why = if found.is_none() { "there is none" } else { "it may not" };
            let text = format!("{by} cannot end service {source}: {why}");
            self.say(now, Level::Warning, "not ended", text, effects);
            return;
        };
        self.run(now, place, Input::Shutdown, effects);
        self.take_actions(now, place, effects);
        let was_running = self.services[place].is_running();
        self.services[place].remove();
        self.awake.retain(|awake| *awake != place);
        self.waiting_calls.retain(|(caller, _)| *caller != place);
        if was_running && self.bus_is_open {
            effects.push(Effect::Token(source, false));
        }
        self.service_health(now, source, Condition::Gone, "ended");
        self.subscribe(now, effects);
    }
}

/// A service ends others of its own entity that are neither built in nor bridges, and not itself: that is to retire.
fn may_stop(by: Source, other: Source) -> bool {
    by.entity == other.entity
        && other.service.get() >= SERVICE_MIN
        && by != other
        && by.service != ServiceId::NODE
}
