//! What services, simulations and operators tell.

use super::{SERIES, ServiceStatusType, SimulationStatusType};
use crate::lmcp::{Ref, Text};

lmcp_types! {
    SERIES "afrl.cmasi";

    /// A named text, for what the model has no field for.
    2 KeyValuePair {
        key "Key": Text,
        value "Value": Text,
    }

    /// Something that an operator says.
    38 OperatorSignal {
        signals "Signals": Vec<Ref<KeyValuePair>>,
    }

    /// How far a service has come, or what failed.
    45 ServiceStatus {
        percent_complete "PercentComplete": f32,
        info "Info": Vec<Ref<KeyValuePair>>,
        status_type "StatusType": ServiceStatusType,
    }

    /// The state of a simulation or of a live session.
    46 SessionStatus {
        state "State": SimulationStatusType,
        start_time "StartTime" ["ms"]: i64,
        scenario_time "ScenarioTime" ["ms"]: i64,
        real_time_multiple "RealTimeMultiple": f32,
        parameters "Parameters": Vec<Ref<KeyValuePair>>,
    }
}
