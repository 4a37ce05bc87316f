//! Bridges and their peers, as events of the node.

use super::{Node, Origin, Work};
use crate::bridge::Incoming;
use crate::event::{BadInput, BridgeEvent, BridgeId, Effect, PeerEvent, PeerId};
use crate::map::{self, uxas::Refused};
use crate::service::{Component, ComponentHealth, Condition, Level};
use aldis_envelope::Now;
use aldis_envelope::codec::stream::StreamError;

impl Node {
    pub(super) fn bridge(&mut self, now: Now, id: BridgeId, event: BridgeEvent, effects: &mut Vec<Effect>) {
        let Some(bridge) = self.bridges.get_mut(id.0) else { return };
        let name = bridge.spec.name.clone();
        let component = Component::Service(bridge.spec.source);
        match event {
            BridgeEvent::Working(status) => {
                bridge.state.clone_from(&status);
                self.component(now, &ComponentHealth { component, condition: Condition::Well, status });
            }
            BridgeEvent::Failing(status) => {
                bridge.state.clone_from(&status);
                let text = format!("{name}: {status}");
                self.component(now, &ComponentHealth { component, condition: Condition::Failed, status });
                self.say(now, Level::Warning, &text.clone(), text, effects);
            }
        }
    }

    pub(super) fn peer(
        &mut self,
        now: Now,
        id: BridgeId,
        peer: PeerId,
        event: PeerEvent,
        effects: &mut Vec<Effect>,
    ) {
        let Some(bridge) = self.bridges.get_mut(id.0) else { return };
        match event {
            PeerEvent::Message(message) => {
                self.import(now, id, peer, Incoming::Delimited(message), effects);
            }
            PeerEvent::Parts(frames) => self.import(now, id, peer, Incoming::Parts(frames), effects),
            PeerEvent::Unwanted(count) => bridge.unwanted(count),
            PeerEvent::Ready(bytes) => {
                let ready = bridge.ready(now.monotonic, peer, bytes);
                effects
                    .extend(ready.into_iter().map(|(label, content)| Effect::Send(id, peer, label, content)));
            }
            PeerEvent::Bad(error) => self.bad_input(now, id, peer, &error, effects),
            PeerEvent::Gives(name) => {
                let text = format!("{}: {name} is there", bridge.spec.name);
                bridge.giver_up(peer, name);
                self.say(now, Level::Information, &text.clone(), text, effects);
            }
            PeerEvent::Up(name, credit) => {
                let text = format!("{}: {name} is there", bridge.spec.name);
                bridge.peer_up(peer, name, credit);
                self.say(now, Level::Information, &text.clone(), text, effects);
            }
            PeerEvent::Down(why) => {
                if let Some(name) = bridge.peer_down(peer) {
                    let text = format!("{}: {name} is gone: {why}", bridge.spec.name);
                    self.say(now, Level::Information, &text.clone(), text, effects);
                }
            }
        }
    }

    fn import(&mut self, now: Now, id: BridgeId, peer: PeerId, message: Incoming, effects: &mut Vec<Effect>) {
        match self.bridges[id.0].import(message) {
            Ok(imported) => {
                if let Some(health) = map::health::told(&imported.message) {
                    self.component(now, &health);
                }
                self.route(now, Work::new(Origin::Peer(id, peer), imported.message), effects);
            }
            Err(Refused::Filtered) => {}
            Err(why) => {
                let from = self.bridges[id.0].peer_name(peer).to_owned();
                let text = format!("{}: message of {from} refused: {why}", self.bridges[id.0].spec.name);
                let kind = format!("{} refused {}", self.bridges[id.0].spec.name, why_kind(&why));
                self.say(now, Level::Warning, &kind, text, effects);
            }
        }
    }

    fn bad_input(
        &mut self,
        now: Now,
        id: BridgeId,
        peer: PeerId,
        error: &BadInput,
        effects: &mut Vec<Effect>,
    ) {
        let bridge = &mut self.bridges[id.0];
        match error {
            BadInput::Stream(StreamError::Skipped(bytes)) => bridge.counters.bytes_skipped += *bytes as u64,
            BadInput::OneFrame | BadInput::SeveralFrames(_) => bridge.counters.framing_wrong += 1,
            BadInput::TooLarge { .. } => bridge.counters.too_large += 1,
            _ => bridge.counters.frames_bad += 1,
        }
        let from = bridge.peer_name(peer).to_owned();
        let name = bridge.spec.name.clone();
        self.say(
            now,
            Level::Warning,
            &format!("{name} bad input"),
            format!("{name}: {from}: {error}"),
            effects,
        );
    }

    pub(super) fn give_up_stalled_peers(&mut self, now: Now, effects: &mut Vec<Effect>) {
        for i in 0..self.bridges.len() {
            for (peer, shed) in self.bridges[i].give_up_stalled(now.monotonic) {
                let BridgeIdentity { name, limit } = self.identity(i);
                let text =
                    format!("{name}: {peer} takes nothing for {limit:?}: {shed} waiting messages dropped");
                self.say(now, Level::Warning, &format!("{name} stalled"), text, effects);
            }
        }
    }

    fn identity(&self, bridge: usize) -> BridgeIdentity {
        let spec = &self.bridges[bridge].spec;
        BridgeIdentity { name: spec.name.clone(), limit: spec.stall_timeout }
    }
}

struct BridgeIdentity {
    name: String,
    limit: std::time::Duration,
}

fn why_kind(why: &Refused) -> &'static str {
    match why {
        Refused::Malformed(_) | Refused::Parts(_) => "malformed",
        Refused::ForeignEntity(_) => "foreign entity",
        Refused::Filtered => "filtered",
    }
}
