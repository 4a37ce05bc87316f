//! What crosses the links of a fleet.

use crate::link::Class;
use crate::link::export::{Export, Rule};
use aldis_envelope::EntityId;
use aldis_envelope::lmcp::cmasi::{EntityState, ServiceStatus, VehicleActionCommand};
use aldis_envelope::lmcp::{self, Struct};
use aldis_envelope::umaa::{ResourceAllocationCommand, Topic};
use std::time::Duration;

/// How old a command may become on its way.
const LIFESPAN: Duration = Duration::from_secs(600);

/// The rules towards these entities, the same both ways.
pub(super) fn export(behind: &[EntityId]) -> Export {
    let command = |name: &str| Rule { lifespan: Some(LIFESPAN), ..Rule::new(name, Class::Command) };
    let missions = lmcp::descendants(VehicleActionCommand::TYPE);
    let states = lmcp::descendants(EntityState::TYPE);
    let mut rules: Vec<Rule> = missions.map(|info| command(info.full_name)).collect();
    // Its statuses too: their names begin so.
    rules.push(command(ResourceAllocationCommand::NAME));
    rules.push(command(ServiceStatus::TYPE.full_name));
    rules.extend(states.map(|info| Rule::new(info.full_name, Class::State)));
    Export { behind: behind.iter().copied().collect(), rules }
}
