//! Entities and their states.

use super::{
    AltitudeType, KeyValuePair, Location3D, LoiterType, NavigationMode, PayloadConfiguration, PayloadState,
    SERIES, TurnType,
};
use crate::lmcp::{Ref, Text};

lmcp_types! {
    SERIES "afrl.cmasi";

    /// What every entity is able to do and carries.
    11 EntityConfiguration in Box {
        id "ID": i64,
        affiliation "Affiliation": Text = Text::const_new("Unknown"),
        entity_type "EntityType": Text,
        label "Label": Text,
        nominal_speed "NominalSpeed" ["m/s"]: f32,
        nominal_altitude "NominalAltitude" ["m"]: f32,
        nominal_altitude_type "NominalAltitudeType": AltitudeType,
        payload_configuration_list "PayloadConfigurationList": Vec<Ref<PayloadConfiguration>>,
        info "Info": Vec<Ref<KeyValuePair>>,
    }

    /// A speed with what it costs to fly it.
    12 FlightProfile {
        name "Name": Text,
        airspeed "Airspeed" ["m/s"]: f32,
        pitch_angle "PitchAngle" ["deg"]: f32,
        vertical_speed "VerticalSpeed" ["m/s"]: f32,
        max_bank_angle "MaxBankAngle" ["deg"]: f32,
        energy_rate "EnergyRate" ["%/s"]: f32,
    }

    /// What an aircraft is able to do.
    13 AirVehicleConfiguration: EntityConfiguration {
        minimum_speed "MinimumSpeed" ["m/s"]: f32,
        maximum_speed "MaximumSpeed" ["m/s"]: f32,
        nominal_flight_profile "NominalFlightProfile": Ref<FlightProfile>,
        alternate_flight_profiles "AlternateFlightProfiles": Vec<Ref<FlightProfile>>,
        available_loiter_types "AvailableLoiterTypes": Vec<LoiterType>,
        available_turn_types "AvailableTurnTypes": Vec<TurnType>,
        minimum_altitude "MinimumAltitude" ["m"]: f32,
        min_altitude_type "MinAltitudeType": AltitudeType,
        maximum_altitude "MaximumAltitude" ["m"]: f32 = 1_000_000.0,
        max_altitude_type "MaxAltitudeType": AltitudeType = AltitudeType::MSL,
    }

    /// Where every entity is, how it moves and what it does.
    14 EntityState {
        id "ID": i64,
        u "u" ["m/s"]: f32,
        v "v" ["m/s"]: f32,
        w "w" ["m/s"]: f32,
        udot "udot" ["m/s²"]: f32,
        vdot "vdot" ["m/s²"]: f32,
        wdot "wdot" ["m/s²"]: f32,
        heading "Heading" ["deg"]: f32,
        pitch "Pitch" ["deg"]: f32,
        roll "Roll" ["deg"]: f32,
        p "p" ["deg/s"]: f32,
        q "q" ["deg/s"]: f32,
        r "r" ["deg/s"]: f32,
        course "Course" ["deg"]: f32,
        groundspeed "Groundspeed" ["m/s"]: f32,
        location "Location": Ref<Location3D>,
        energy_available "EnergyAvailable" ["%"]: f32,
        actual_energy_rate "ActualEnergyRate" ["%/s"]: f32,
        payload_state_list "PayloadStateList": Vec<Ref<PayloadState>>,
        current_waypoint "CurrentWaypoint": i64,
        current_command "CurrentCommand": i64,
        mode "Mode": NavigationMode,
        associated_tasks "AssociatedTasks": Vec<i64>,
        time "Time" ["ms"]: i64,
        info "Info": Vec<Ref<KeyValuePair>>,
    }

    /// The state of an aircraft.
    15 AirVehicleState: EntityState {
        airspeed "Airspeed" ["m/s"]: f32,
        vertical_speed "VerticalSpeed" ["m/s"]: f32,
        wind_speed "WindSpeed" ["m/s"]: f32,
        wind_direction "WindDirection" ["deg"]: f32,
    }

    /// Takes entities back.
    53 RemoveEntities {
        entity_list "EntityList": Vec<i64>,
    }
}
