//! Whom a message is for, as far as its content says it: such a message crosses towards that entity alone.

use super::Links;
use aldis_envelope::lmcp::cmasi::VehicleActionCommand;
use aldis_envelope::lmcp::{self, Header, Struct};
use aldis_envelope::umaa::{CommandKey, Key};
use aldis_envelope::{ContentType, EntityId, Message};

impl Links {
    /// The entity that a message's content is for, where it can be told: a UMAA command names its provider in its key, an
    /// LMCP command its vehicle.
    pub(super) fn destination(&self, message: &Message) -> Option<EntityId> {
        if message.label.attributes.content_type == ContentType::Lmcp {
            return vehicle_of(message);
        }
        let topic = message.label.descriptor().strip_prefix("UMAA::")?;
        if !topic.trim_end_matches("Type").ends_with("Command") {
            return None;
        }
        let CommandKey { destination, .. } = CommandKey::of_instance(message.instance.as_deref()?)?;
        self.guids.iter().find_map(|guids| guids.service(destination)).map(|source| source.entity)
    }
}

/// The vehicle that a command of LMCP is for.
fn vehicle_of(message: &Message) -> Option<EntityId> {
    let info = Header::peek(&message.content).ok()?.type_info().ok()?;
    if !info.is_a(VehicleActionCommand::TYPE) {
        return None;
    }
    let object = lmcp::decode(&message.content).ok()?;
    let number = object.get::<VehicleActionCommand>()?.vehicle_id;
    u64::try_from(number).ok().and_then(|number| EntityId::new(number).ok())
}
