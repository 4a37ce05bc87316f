//! Where the services of a run are.

use aldis_envelope::{EntityId, Fleet, Guid, GuidForm, Guids, ServiceId, Source};

/// The services of a run by their ids.
#[derive(Debug, Clone)]
pub(super) struct Arrangement {
    pub(super) guids: Guids,
    pub(super) fleet: Fleet,
    pub(super) entities: Vec<EntityId>,
    pub(super) arbiter: Source,
    /// The guarded provider, and the nested one that it commands.
    pub(super) steersman: Source,
    pub(super) rudder: Source,
    /// A provider that everybody may command, and who does.
    pub(super) lamp: Source,
    pub(super) lamplighter: Source,
    /// Consumers that take control and steer.
    pub(super) captains: Vec<Source>,
    /// Consumers that take control alone.
    pub(super) askers: Vec<Source>,
    /// A consumer that sets priorities, and one that steers without control.
    pub(super) chief: Source,
    pub(super) pirate: Source,
    /// From low to high.
    pub(super) priorities: Vec<Source>,
}

/// The one resource of all runs.
pub(super) const AUTOPILOT: Guid = Guid([0x8A; 16]);

impl Arrangement {
    /// Spreads the services over some nodes. None where there is none.
    pub(super) fn draw(nodes: usize, random: &mut fastrand::Rng) -> Option<Self> {
        let entities: Vec<_> = (1..=nodes as u64).filter_map(|number| EntityId::new(number).ok()).collect();
        let vehicle = *entities.first()?;
        let others = if nodes > 1 { &entities[1..] } else { &entities[..] };
        let at = |entity, service: u32| ServiceId::new(service.into()).ok().map(|id| Source::new(entity, id));
        let near = |random: &mut fastrand::Rng| {
            if random.u8(0..5) < 3 { vehicle } else { entities[random.usize(0..entities.len())] }
        };
        let (steersman, rudder) = (at(near(random), 100)?, at(near(random), 101)?);
        let mut far = || others[random.usize(0..others.len())];
        let captains: Vec<_> = (110..113).filter_map(|service| at(far(), service)).collect();
        let askers: Vec<_> = (120..122).filter_map(|service| at(far(), service)).collect();
        let (chief, pirate, lamplighter) = (at(far(), 130)?, at(far(), 131)?, at(far(), 132)?);
        let lamp = at(far(), 102)?;
        let mut priorities = [&captains[..], &askers[..]].concat();
        random.shuffle(&mut priorities);
        let fleet = Fleet::new("sim").ok()?;
        Some(Self {
            guids: Guids::new(&fleet, GuidForm::Readable),
            fleet,
            arbiter: Source::new(vehicle, ServiceId::ALLOCATION),
            steersman,
            rudder,
            lamp,
            lamplighter,
            captains,
            askers,
            chief,
            pirate,
            priorities,
            entities,
        })
    }

    pub(super) fn guid(&self, source: Source) -> Guid {
        self.guids.of_service(source)
    }

    /// The providers of the resource.
    pub(super) fn related(&self) -> [Guid; 2] {
        [self.guid(self.steersman), self.guid(self.rudder)]
    }
}
