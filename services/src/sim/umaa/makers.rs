//! The commands that consumers send, at random.

use super::actors::{Maker, any_course, any_trouble};
use super::commands::{RudderCommand, VectorCommand, turn};
use aldis_envelope::umaa::{
    DurationSeconds, ResourceAllocationCommand, ResourceAllocationPriorityCommand, Sequence,
};
use aldis_envelope::{DateTime, Guid};

/// Asks for control, for some time or without end.
pub(super) struct Allocations(pub(super) Guid);

impl Maker<ResourceAllocationCommand> for Allocations {
    fn any(&mut self, random: &mut fastrand::Rng) -> ResourceAllocationCommand {
        let seconds = (random.u8(0..5) > 0).then(|| random.f64() * 8.0);
        // One in twenty asks for what is not there.
        let resource_id = if random.u8(0..20) == 0 { Guid([0x80; 16]) } else { self.0 };
        ResourceAllocationCommand {
            duration: seconds.and_then(|seconds| DurationSeconds::new(seconds).ok()),
            resource_id,
            time_stamp: DateTime::default(),
            source: Guid::NIL,
            session_id: Guid::NIL,
            destination: Guid::NIL,
        }
    }

    fn last(&mut self) -> Option<ResourceAllocationCommand> {
        None
    }
}

/// Sets priorities in another order.
pub(super) struct Lists {
    pub(super) resource: Guid,
    pub(super) consumers: Vec<Guid>,
}

impl Maker<ResourceAllocationPriorityCommand> for Lists {
    fn any(&mut self, random: &mut fastrand::Rng) -> ResourceAllocationPriorityCommand {
        random.shuffle(&mut self.consumers);
        let mut list = self.consumers.clone();
        if random.u8(0..10) == 0 {
            // A consumer twice: it is refused.
            list.extend(list.first().copied());
        }
        ResourceAllocationPriorityCommand {
            priorities: Sequence::new(list).unwrap_or_default(),
            resource_id: self.resource,
            time_stamp: DateTime::default(),
            source: Guid::NIL,
            session_id: Guid::NIL,
            destination: Guid::NIL,
        }
    }

    fn last(&mut self) -> Option<ResourceAllocationPriorityCommand> {
        None
    }
}

/// Steers without asking for control.
pub(super) struct Courses;

impl Maker<VectorCommand> for Courses {
    fn any(&mut self, random: &mut fastrand::Rng) -> VectorCommand {
        any_course(random)
    }

    fn last(&mut self) -> Option<VectorCommand> {
        None
    }
}

/// Sets a rudder that belongs to no resource.
pub(super) struct Rudders;

impl Maker<RudderCommand> for Rudders {
    fn any(&mut self, random: &mut fastrand::Rng) -> RudderCommand {
        let (seconds, trouble) = any_trouble(random, 6);
        turn(random.f64() * 72.0 - 36.0, seconds, trouble)
    }

    fn last(&mut self) -> Option<RudderCommand> {
        Some(turn(1.0, 1, ""))
    }
}
