//! Zones, regions and the weather in them.

use super::{AbstractGeometry, AltitudeType, SERIES, ZoneAvoidanceType};
use crate::lmcp::{Ref, Text};

lmcp_types! {
    SERIES "afrl.cmasi";

    /// What every zone is: an area between two altitudes, for a time.
    10 AbstractZone {
        zone_id "ZoneID": i64,
        min_altitude "MinAltitude" ["m"]: f32,
        min_altitude_type "MinAltitudeType": AltitudeType,
        max_altitude "MaxAltitude" ["m"]: f32,
        max_altitude_type "MaxAltitudeType": AltitudeType = AltitudeType::MSL,
        affected_aircraft "AffectedAircraft": Vec<i64>,
        start_time "StartTime" ["ms"]: i64,
        end_time "EndTime" ["ms"]: i64,
        padding "Padding" ["m"]: f32,
        label "Label": Text,
        boundary "Boundary": Ref<AbstractGeometry>,
    }

    /// A zone not to be left.
    29 KeepInZone: AbstractZone {}

    /// A zone not to be entered.
    30 KeepOutZone: AbstractZone {
        zone_type "ZoneType": ZoneAvoidanceType,
    }

    /// A set of zones within which to plan.
    39 OperatingRegion {
        id "ID": i64,
        keep_in_areas "KeepInAreas": Vec<i64>,
        keep_out_areas "KeepOutAreas": Vec<i64>,
    }

    /// Takes zones back.
    52 RemoveZones {
        zone_list "ZoneList": Vec<i64>,
    }

    /// The weather in an area, or everywhere.
    55 WeatherReport {
        area "Area": Ref<AbstractZone> = Ref::NULL,
        wind_speed "WindSpeed" ["m/s"]: f32,
        wind_direction "WindDirection" ["deg"]: f32,
        visibility "Visibility" ["m"]: f32,
        cloud_ceiling "CloudCeiling" ["m"]: f32,
        cloud_coverage "CloudCoverage": f32,
    }
}
