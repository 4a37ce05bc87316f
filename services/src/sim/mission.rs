//! Shores and vehicles, each a node of its own, in virtual time: on one bus, or each vehicle behind a bad link.
//!
//! What crosses a link is what a mission needs: commands of LMCP towards their vehicle, states and statuses back, and the
//! commands and statuses of ResourceAllocation. Each node has a player, as [`super::offline`] has: messages are played on it,
//! and what it hears is kept.

#[cfg(test)]
mod control_ends;
#[cfg(test)]
mod planner_gone;
mod rules;
mod take_over;
#[cfg(test)]
mod tests;

use super::link::Profile;
use super::offline::{FIRST_SERVICE, Overheard, PLAYER, Played, Player, Queue};
use super::world::{NodeHandle, World};
use crate::event::{Event, LinkId};
use crate::link::{CarrierConfig, CarrierId, LinkConfig, LinkSpec};
use crate::node::NodeConfig;
use crate::registry::{self, Kind};
use crate::service::{Service, ServiceSpec};
use crate::umaa::allocation::{ArbiterSettings, Arbitration, Resource};
use aldis_envelope::{BootId, EntityId, Fleet, GuidForm, Guids, Monotonic, Prefix, ServiceId, Source};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;
pub use take_over::TakeOver;

/// How long a sample takes on a bus.
const BUS_DELAY: (Duration, Duration) = (Duration::from_micros(200), Duration::from_millis(2));

/// The only carrier of a link.
const CARRIER: CarrierId = CarrierId(0);

/// The service of who takes over.
const OPERATOR: u64 = 9001;

/// A machine of the fleet.
pub struct Member {
    /// Its entity.
    pub entity: EntityId,
    /// Its services, numbered in their order from 100 on.
    pub services: Vec<(String, Kind)>,
    /// The resource that its arbiter gives control of, with who may have it, from low to high priority.
    pub resource: Option<(String, Vec<Source>)>,
    /// Control of vehicles that it takes at a time.
    pub takes_over: Vec<TakeOver>,
}

impl Member {
    /// A machine with these services, without resources.
    pub fn new(entity: EntityId, services: Vec<(String, Kind)>) -> Self {
        Self { entity, services, resource: None, takes_over: Vec::new() }
    }

    /// The ids of its service in this place.
    pub fn source(&self, place: usize) -> Source {
        let number = ServiceId::new(FIRST_SERVICE + place as u64);
        Source::new(self.entity, number.unwrap_or(ServiceId::NODE))
    }

    /// The ids of who takes over.
    pub fn operator(&self) -> Source {
        Source::new(self.entity, ServiceId::new(OPERATOR).unwrap_or(ServiceId::NODE))
    }
}

/// A member's node, and what it is given and hears.
struct Running {
    node: NodeHandle,
    player: Source,
    queue: Queue,
    heard: Receiver<Overheard>,
}

/// A fleet under way.
pub struct Missions {
    world: World,
    running: Vec<Running>,
    /// How many of the first members are ashore.
    shores: usize,
}

impl Missions {
    /// A fleet: the first `shores` members are ashore on one bus, the others are vehicles. Behind links with a profile every
    /// vehicle has a bus of its own; without one all are on the same.
    ///
    /// # Errors
    /// Why a node cannot be.
    pub fn new(
        seed: u64,
        profile: Option<&Profile>,
        shores: usize,
        members: Vec<Member>,
    ) -> Result<Self, String> {
        let fleet = Fleet::new("missions").map_err(|why| why.to_string())?;
        let guids = Guids::new(&fleet, GuidForm::default());
        let entities: Vec<EntityId> = members.iter().map(|member| member.entity).collect();
        let (ashore, afloat) = entities.split_at(shores.min(entities.len()));
        let mut world = World::new(seed, BUS_DELAY);
        let mut running = Vec::new();
        for (place, member) in members.into_iter().enumerate() {
            let links = match profile {
                // The first shore is the gateway of all.
                Some(profile) if place == 0 => {
                    afloat.iter().map(|&to| link(member.entity, to, &[to], profile)).collect()
                }
                Some(profile) if place >= shores => vec![link(member.entity, entities[0], ashore, profile)],
                _ => Vec::new(),
            };
            running.push(start(&mut world, &fleet, &guids, member, links)?);
        }
        if let Some(profile) = profile {
            let sides: Vec<u32> =
                (0..running.len()).map(|place| place.saturating_sub(shores - 1) as u32).collect();
            world.partition(&sides, Duration::ZERO);
            for (number, vehicle) in running.iter().skip(shores).enumerate() {
                let ends = ((running[0].node, LinkId(number)), (vehicle.node, LinkId(0)));
                world.join(ends.0, ends.1, CARRIER, profile);
            }
        }
        Ok(Self { world, running, shores })
    }

    /// Has messages played on a member's node; those whose time is over at once.
    pub fn play(&mut self, member: usize, mut messages: Vec<Played>) {
        let Some(running) = self.running.get(member) else { return };
        if let Ok(mut queue) = running.queue.lock() {
            queue.append(&mut messages);
            queue.sort_by_key(|played| played.at);
        }
        // A job that it never asked for: the player looks at its queue.
        let (node, wake) = (running.node, Event::Job(running.player, 0, Ok(Box::new(()))));
        self.world.give(node, wake);
    }

    /// The true time of the world.
    pub fn now(&self) -> Monotonic {
        self.world.now().monotonic
    }

    /// Lets time pass.
    pub fn run_for(&mut self, time: Duration) {
        self.world.run_for(time);
    }

    /// What a member's node heard since it was asked last.
    pub fn heard(&mut self, member: usize) -> Vec<Overheard> {
        self.running.get(member).map(|running| running.heard.try_iter().collect()).unwrap_or_default()
    }

    /// Bytes on all links, both ways.
    pub fn link_bytes(&self) -> u64 {
        let out = |number| self.world.link_bytes(self.running[0].node, LinkId(number));
        let back = |running: &Running| self.world.link_bytes(running.node, LinkId(0));
        let vehicles = self.running.iter().skip(self.shores);
        vehicles.enumerate().map(|(number, running)| out(number) + back(running)).sum()
    }
}

/// One end of a link.
fn link(own: EntityId, peer: EntityId, behind: &[EntityId], profile: &Profile) -> LinkSpec {
    let (rate, mtu) = (profile.rate, profile.mtu);
    let carrier =
        CarrierConfig { id: CARRIER, rate, mtu, round_trip: profile.round_trip(), loss: profile.loss };
    LinkSpec {
        name: format!("link-{peer}"),
        link: LinkConfig::new(own, peer, vec![carrier]),
        export: rules::export(behind),
    }
}

fn start(
    world: &mut World,
    fleet: &Fleet,
    guids: &Guids,
    member: Member,
    links: Vec<LinkSpec>,
) -> Result<Running, String> {
    let mut services = registry::built_in(member.entity, guids, Duration::from_secs(5));
    for (place, (name, kind)) in member.services.iter().enumerate() {
        services.push(registry::service(member.source(place), name, kind.clone(), guids));
    }
    if let Some((name, priorities)) = &member.resource {
        let resource = Resource {
            id: guids.of_resource(member.entity, name),
            name: name.clone(),
            priorities: priorities.iter().map(|&source| guids.of_service(source)).collect(),
            related_sources: Vec::new(),
        };
        let settings = ArbiterSettings { resources: vec![resource], ..ArbiterSettings::default() };
        let arbitration = Arbitration::new(settings).map_err(|why| why.to_string())?;
        services.push(registry::arbiter(member.entity, guids, arbitration));
    }
    if !member.takes_over.is_empty() {
        services.push(take_over::operator(member.operator(), guids, member.takes_over.clone()));
    }
    let number = ServiceId::new(PLAYER).map_err(|why| why.to_string())?;
    let (queue, (sender, heard)) = (Queue::default(), channel());
    let player = Source::new(member.entity, number);
    services.push(player_spec(player, &queue, sender));
    let node = world.add(NodeConfig {
        fleet: fleet.clone(),
        entities: vec![member.entity],
        boot: BootId(1),
        operators: Vec::new(),
        allow: Vec::new(),
        import: vec![Prefix::all()],
        export: vec![Prefix::all()],
        topics: Vec::new(),
        reliable: true,
        services,
        bridges: Vec::new(),
        links,
    })?;
    Ok(Running { node, player, queue, heard })
}

fn player_spec(player: Source, queue: &Queue, sender: Sender<Overheard>) -> ServiceSpec {
    let queue = queue.clone();
    let factory = Arc::new(move || -> Box<dyn Service> {
        Box::new(Player { queue: queue.clone(), heard: sender.clone() })
    });
    ServiceSpec { source: player, name: "player".to_owned(), factory }
}
