//! The nine states of a task within a request, and what leads from one to the next.

/// Where a task stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum State {
    /// It gets ready.
    Init,
    /// It is ready, and nobody asks for it.
    Idle,
    /// It waits for what sensors see.
    SensorRequest,
    /// It waits for the ways within its options.
    OptionRoutes,
    /// Its options are told.
    OptionsPublished,
    /// It waits for the way of the option that was chosen.
    FinalRoutes,
    /// Its waypoints are told.
    OptionSelected,
    /// A vehicle is at it.
    Active,
    /// It is done.
    Completed,
}

/// What happens to a task.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Trigger {
    /// It is ready (`TaskInitialized` is told).
    Ready,
    /// A `UniqueAutomationRequest` names it.
    Requested,
    /// What sensors see is known, or nothing of it is needed.
    Sensed,
    /// The ways within its options are known.
    Routed,
    /// A `TaskImplementationRequest` names one of its options.
    Chosen,
    /// The waypoints are complete.
    Implemented,
    /// A vehicle's state names it.
    Taken,
    /// No vehicle's state names it any more.
    Left,
    /// The request has failed, or is over without it.
    Dropped,
    /// `TaskComplete` is told.
    Told,
}

/// From where, by what, to where.
pub const TRANSITIONS: [(State, Trigger, State); 18] = [
    (State::Init, Trigger::Ready, State::Idle),
    (State::Idle, Trigger::Requested, State::SensorRequest),
    (State::OptionSelected, Trigger::Requested, State::SensorRequest),
    (State::SensorRequest, Trigger::Sensed, State::OptionRoutes),
    (State::OptionRoutes, Trigger::Routed, State::OptionsPublished),
    (State::OptionsPublished, Trigger::Chosen, State::FinalRoutes),
    // Several vehicles may do it, each by an option of its own, one after the other.
    (State::OptionSelected, Trigger::Chosen, State::FinalRoutes),
    (State::FinalRoutes, Trigger::Implemented, State::OptionSelected),
    (State::OptionSelected, Trigger::Taken, State::Active),
    (State::Active, Trigger::Left, State::Completed),
    (State::Active, Trigger::Requested, State::Completed),
    (State::Completed, Trigger::Told, State::Idle),
    (State::SensorRequest, Trigger::Dropped, State::Idle),
    (State::OptionRoutes, Trigger::Dropped, State::Idle),
    (State::OptionsPublished, Trigger::Dropped, State::Idle),
    (State::FinalRoutes, Trigger::Dropped, State::Idle),
    (State::OptionSelected, Trigger::Dropped, State::Idle),
    (State::Active, Trigger::Dropped, State::Idle),
];

impl State {
    /// Where a trigger leads; none where it means nothing now.
    pub fn after(self, trigger: Trigger) -> Option<Self> {
        let row = TRANSITIONS.iter().find(|(from, by, _)| *from == self && *by == trigger);
        row.map(|(_, _, to)| *to)
    }

    /// Takes a trigger; whether it means something now.
    pub fn step(&mut self, trigger: Trigger) -> bool {
        let next = self.after(trigger);
        *self = next.unwrap_or(*self);
        next.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn each_state_is_reached_and_left_and_no_trigger_leads_two_ways() {
        let rows: BTreeSet<_> = TRANSITIONS.iter().map(|(from, by, _)| (from, by)).collect();
        assert_eq!(rows.len(), TRANSITIONS.len());
        let (from, to): (BTreeSet<_>, BTreeSet<_>) =
            TRANSITIONS.iter().map(|(from, _, to)| (*from, *to)).unzip();
        assert_eq!(from.len(), 9);
        assert!(from.iter().all(|state| *state == State::Init || to.contains(state)));
    }

    #[test]
    fn the_whole_way_of_a_task() {
        let mut state = State::Init;
        for trigger in [
            Trigger::Ready,
            Trigger::Requested,
            Trigger::Sensed,
            Trigger::Routed,
            Trigger::Chosen,
            Trigger::Implemented,
            Trigger::Taken,
            Trigger::Left,
            Trigger::Told,
        ] {
            assert!(state.step(trigger), "{state:?} {trigger:?}");
        }
        assert_eq!(state, State::Idle);
        assert!(!state.step(Trigger::Taken) && state == State::Idle, "who is not planned is not active");
    }
}
