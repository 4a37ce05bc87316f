//! Points, areas and directions.

use super::{AltitudeType, SERIES};
use crate::lmcp::Ref;

lmcp_types! {
    SERIES "afrl.cmasi";

    /// What every geometry is; one of this very type has no extent.
    1 AbstractGeometry {}

    /// A point on or above the earth.
    3 Location3D {
        latitude "Latitude" ["deg"]: f64,
        longitude "Longitude" ["deg"]: f64,
        altitude "Altitude" ["m"]: f32,
        altitude_type "AltitudeType": AltitudeType = AltitudeType::MSL,
    }

    /// A circle on the ground.
    22 Circle: AbstractGeometry {
        center_point "CenterPoint": Ref<Location3D>,
        radius "Radius" ["m"]: f32,
    }

    /// An area within straight edges.
    42 Polygon: AbstractGeometry {
        boundary_points "BoundaryPoints": Vec<Ref<Location3D>>,
    }

    /// A rectangle on the ground, turned clockwise.
    43 Rectangle: AbstractGeometry {
        center_point "CenterPoint": Ref<Location3D>,
        width "Width" ["m"]: f32,
        height "Height" ["m"]: f32,
        rotation "Rotation" ["deg"]: f32,
    }

    /// A range of directions to look from.
    16 Wedge {
        azimuth_centerline "AzimuthCenterline" ["deg"]: f32,
        vertical_centerline "VerticalCenterline" ["deg"]: f32,
        azimuth_extent "AzimuthExtent" ["deg"]: f32,
        vertical_extent "VerticalExtent" ["deg"]: f32,
    }
}
