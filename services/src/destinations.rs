//! Which entity a GUID belongs to, so that a command finds its vehicle (umaa-so, GUIDs).
//!
//! A GUID that this fleet has made tells its service itself. Every other is learned: whoever sends a sample with it as its
//! `source` is where commands to it must go.

use crate::dds::Pattern;
use aldis_envelope::lmcp::cmasi::VehicleActionCommand;
use aldis_envelope::lmcp::{self, Header, Struct};
use aldis_envelope::umaa::{self, CommandKey, Key};
use aldis_envelope::{ContentType, EntityId, Fleet, Guid, GuidForm, Guids, Instance, KeyHash, Message};
use std::collections::BTreeMap;

/// How many GUIDs are remembered: far more than there are services in a fleet, and 4 MB at the most.
const GUIDS_MAX: usize = 65_536;

/// Where a message goes by what its content says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Destination {
    /// It is no command, and for all who listen.
    Everybody,
    /// It is a command to a service of this entity.
    Entity(EntityId),
    /// It is a command to a GUID that nobody has used as a source: it goes everywhere once.
    Unknown(Guid),
}

impl Destination {
    /// The entity, where it is known.
    pub fn entity(self) -> Option<EntityId> {
        match self {
            Self::Entity(entity) => Some(entity),
            Self::Everybody | Self::Unknown(_) => None,
        }
    }
}

/// What has been learned.
#[derive(Debug)]
pub struct Destinations {
    guids: Guids,
    learned: BTreeMap<Guid, EntityId>,
    /// Instances whose source is known already, each with its entity, so that a stream of samples is read once.
    read: BTreeMap<KeyHash, EntityId>,
}

impl Destinations {
    /// Nothing learned yet; readable GUIDs of the own fleet are read.
    pub fn new(fleet: &Fleet) -> Self {
        let guids = Guids::new(fleet, GuidForm::Readable);
        Self { guids, learned: BTreeMap::new(), read: BTreeMap::new() }
    }

    /// Learns that an entity speaks as a GUID. What it spoke as last counts: a service may move.
    pub fn learn(&mut self, guid: Guid, entity: EntityId) {
        if self.learned.len() >= GUIDS_MAX && !self.learned.contains_key(&guid) {
            // No order of use is kept: to forget any one costs one command that goes everywhere.
            self.learned.pop_first();
        }
        self.learned.insert(guid, entity);
    }

    /// Learns from a message whose source has said who it is.
    pub fn hear(&mut self, message: &Message) {
        let entity = message.label.source().entity;
        let (Some(instance), ContentType::Umaa) = (&message.instance, &message.label.attributes.content_type)
        else {
            return;
        };
        if message.content.is_empty() || self.read.get(&instance.hash) == Some(&entity) {
            return;
        }
        let topic = umaa::topic(message.label.descriptor());
        let Some(source) = topic.and_then(|topic| topic.source(&message.content)) else { return };
        if self.read.len() >= GUIDS_MAX {
            self.read.clear();
        }
        self.read.insert(instance.hash, entity);
        self.learn(source, entity);
    }

    /// The entity that a GUID belongs to.
    pub fn of(&self, guid: Guid) -> Option<EntityId> {
        let own = self.guids.service(guid).map(|source| source.entity);
        own.or_else(|| self.learned.get(&guid).copied())
    }

    /// Where a message goes: a command, also the dispose that cancels it, towards its destination.
    pub fn of_message(&self, message: &Message) -> Destination {
        let descriptor = message.label.descriptor();
        if message.label.attributes.content_type == ContentType::Lmcp {
            return vehicle_of(&message.content).map_or(Destination::Everybody, Destination::Entity);
        }
        if Pattern::of(descriptor) != Some(Pattern::Command) {
            return Destination::Everybody;
        }
        let told = || umaa::topic(descriptor)?.destination(&message.content);
        let guid = message.instance.as_deref().and_then(of_key).or_else(told);
        match guid {
            Some(guid) => self.of(guid).map_or(Destination::Unknown(guid), Destination::Entity),
            None => Destination::Everybody,
        }
    }
}

/// The vehicle that a command of LMCP is for.
fn vehicle_of(content: &[u8]) -> Option<EntityId> {
    let info = Header::peek(content).ok()?.type_info().ok()?;
    if !info.is_a(VehicleActionCommand::TYPE) {
        return None;
    }
    let object = lmcp::decode(content).ok()?;
    let number = object.get::<VehicleActionCommand>()?.vehicle_id;
    u64::try_from(number).ok().and_then(|number| EntityId::new(number).ok())
}

/// The destination in a command's key: GUIDs in 5.2.1; in 6.0 source and destination have their parents behind them.
fn of_key(instance: &Instance) -> Option<Guid> {
    if let Some(key) = CommandKey::of_instance(instance) {
        return Some(key.destination);
    }
    let key: &[u8; 80] = instance.key.as_deref()?.try_into().ok()?;
    key[48..].first_chunk().copied().map(Guid)
}

#[cfg(test)]
mod tests {
    use super::*;
    use aldis_envelope::umaa::{
        CommandHeader, LogLevel, LogReport, LongDescription, ResourceAllocationCommand,
    };
    use aldis_envelope::{DateTime, ServiceId, Source};

    fn entity(number: u64) -> EntityId {
        EntityId::new(number).unwrap()
    }

    fn service(of: u64) -> Source {
        Source::new(entity(of), ServiceId::new(100).unwrap())
    }

    fn log(source: Guid, of: u64) -> Message {
        let entry = LongDescription::new("here").unwrap();
        let report = LogReport { entry, level: LogLevel::Warning, time_stamp: DateTime::default(), source };
        umaa::put(umaa::label::<LogReport>(service(of)).unwrap(), &report)
    }

    fn command(destination: Guid) -> [Message; 2] {
        let CommandHeader { time_stamp, source, session_id, .. } = CommandHeader {
            time_stamp: DateTime::default(),
            source: Guid([1; 16]),
            session_id: Guid([2; 16]),
            destination,
        };
        let resource_id = Guid([3; 16]);
        let command = ResourceAllocationCommand {
            duration: None,
            resource_id,
            time_stamp,
            source,
            session_id,
            destination,
        };
        let label = umaa::label::<ResourceAllocationCommand>(service(9)).unwrap();
        [umaa::put(label.clone(), &command), umaa::dispose(label, &command)]
    }

    #[test]
    fn a_command_goes_where_its_destination_has_spoken_from() {
        let mut known = Destinations::new(&Fleet::new("blue").unwrap());
        let guid = Guid([7; 16]);
        let where_to = |known: &Destinations| command(guid).map(|message| known.of_message(&message));
        assert_eq!(where_to(&known), [Destination::Unknown(guid); 2]);
        known.hear(&log(guid, 400));
        assert_eq!(where_to(&known), [Destination::Entity(entity(400)); 2]);
        known.hear(&log(guid, 500));
        assert_eq!(where_to(&known)[0].entity(), Some(entity(500)), "a service that moved is found");
        assert_eq!(known.of_message(&log(guid, 1)), Destination::Everybody);
        // A command of 6.0, which is carried as it came: source with parent, session, destination with parent.
        let [mut newer, _] = command(guid);
        let key = [[1; 16], [9; 16], [2; 16], guid.0, [9; 16]].concat();
        newer.instance =
            Some(std::sync::Arc::new(Instance::of_key(key.into(), aldis_envelope::KeyWidth::Wider)));
        assert_eq!(known.of_message(&newer), Destination::Entity(entity(500)));
    }

    #[test]
    fn guids_of_the_own_fleet_need_not_be_learned() {
        let guids = Guids::new(&Fleet::new("blue").unwrap(), GuidForm::Readable);
        let known = Destinations::new(&Fleet::new("blue").unwrap());
        assert_eq!(known.of(guids.of_service(service(400))), Some(entity(400)));
        assert_eq!(known.of(Guid([7; 16])), None);
    }

    #[test]
    fn memory_is_bounded() {
        let mut known = Destinations::new(&Fleet::new("blue").unwrap());
        for number in 0..=GUIDS_MAX as u128 {
            known.learn(Guid(number.to_be_bytes()), entity(1));
        }
        assert_eq!(known.learned.len(), GUIDS_MAX);
        assert_eq!(known.of(Guid((GUIDS_MAX as u128).to_be_bytes())), Some(entity(1)));
    }
}
