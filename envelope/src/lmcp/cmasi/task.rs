//! Tasks, and requests to plan them.

use super::{
    AbstractGeometry, KeyValuePair, Location3D, LoiterAction, MissionCommand, SERIES, VehicleActionCommand,
    WavelengthBand, Wedge,
};
use crate::lmcp::{Ref, Text};

lmcp_types! {
    SERIES "afrl.cmasi";

    /// What every task is: something to be done by one or more of the eligible entities.
    8 Task in Box {
        task_id "TaskID": i64,
        label "Label": Text,
        eligible_entities "EligibleEntities": Vec<i64>,
        revisit_rate "RevisitRate" ["s"]: f32,
        parameters "Parameters": Vec<Ref<KeyValuePair>>,
        priority "Priority": u8,
        required "Required": bool = true,
    }

    /// What every task that looks at something is.
    9 SearchTask: Task {
        desired_wavelength_bands "DesiredWavelengthBands": Vec<WavelengthBand>,
        dwell_time "DwellTime" ["ms"]: i64,
        ground_sample_distance "GroundSampleDistance" ["m/pixel"]: f32,
    }

    /// A task to search an area.
    17 AreaSearchTask: SearchTask {
        search_area "SearchArea": Ref<AbstractGeometry>,
        view_angle_list "ViewAngleList": Vec<Ref<Wedge>>,
    }

    /// A task to search along a line.
    31 LineSearchTask: SearchTask {
        point_list "PointList": Vec<Ref<Location3D>>,
        view_angle_list "ViewAngleList": Vec<Ref<Wedge>>,
        use_inertial_view_angles "UseInertialViewAngles": bool,
    }

    /// A task to look at a point.
    41 PointSearchTask: SearchTask {
        search_location "SearchLocation": Ref<Location3D>,
        standoff_distance "StandoffDistance" ["m"]: f32,
        view_angle_list "ViewAngleList": Vec<Ref<Wedge>>,
    }

    /// A task to loiter.
    34 LoiterTask: Task {
        desired_action "DesiredAction": Ref<LoiterAction>,
    }

    /// A task to pass a point.
    37 MustFlyTask: Task {
        position "Position": Ref<Location3D>,
        use_altitude "UseAltitude": bool = true,
    }

    /// Takes tasks back.
    44 RemoveTasks {
        task_list "TaskList": Vec<i64>,
    }

    /// Asks for a plan that does the tasks with the entities.
    40 AutomationRequest {
        entity_list "EntityList": Vec<i64>,
        task_list "TaskList": Vec<i64>,
        task_relationships "TaskRelationships": Text,
        operating_region "OperatingRegion": i64,
        redo_all_tasks "RedoAllTasks": bool,
    }

    /// A plan: missions and commands for vehicles.
    51 AutomationResponse {
        mission_command_list "MissionCommandList": Vec<Ref<MissionCommand>>,
        vehicle_command_list "VehicleCommandList": Vec<Ref<VehicleActionCommand>>,
        info "Info": Vec<Ref<KeyValuePair>>,
    }
}
