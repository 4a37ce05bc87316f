//! Where a boat is and how it moves, from reports of UMAA to a state of UxAS.
//!
//! UMAA has radians, metres up from the ellipsoid or down, nanoseconds, and quaternions from the north-east-down frame to the
//! body (forward, right, down); UxAS has degrees, metres up from the sea, milliseconds, and angles of heading, pitch and roll.
//! Values are taken as SI numbers, so that any version of the reports, and any bridge that reads them, can give them.

use aldis_envelope::lmcp::Ref;
use aldis_envelope::lmcp::cmasi::{AltitudeType, EntityState, Location3D};
use aldis_envelope::lmcp::vehicles::SurfaceVehicleState;
use aldis_envelope::{EntityId, Wall};

/// How long a state stands: what is older says where the boat was, and not where it is.
pub const STALE_AFTER_MS: i64 = 5_000;

/// Where a boat is and how it lies in the water: a pose report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Geodetic latitude, WGS-84, radians, north positive.
    pub latitude_rad: f64,
    /// Longitude, WGS-84, radians, east positive.
    pub longitude_rad: f64,
    /// Height above the sea in metres; below it negative.
    pub height_m: f64,
    /// The attitude: rotation about the down axis from north, radians, clockwise from above.
    pub yaw_rad: f64,
    /// Bow up, radians.
    pub pitch_rad: f64,
    /// Starboard down, radians.
    pub roll_rad: f64,
    /// When it was so.
    pub time: Wall,
}

/// How a boat moves: a speed report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Speed over ground in metres a second.
    pub speed_over_ground_m_per_s: f64,
    /// Course over ground: radians from north, clockwise; none where it is not known, as at rest.
    pub course_rad: Option<f64>,
    /// Speed through the water in metres a second, ahead positive; none where it is not measured.
    pub speed_through_water_m_per_s: Option<f64>,
    /// Rate of turn, radians a second, clockwise from above.
    pub yaw_rate_rad_per_s: f64,
    /// When it was so.
    pub time: Wall,
}

/// What is wrong with a report.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ReportError {
    /// A value is no number, or lies outside what it can be.
    #[error("{what} of {value} cannot be")]
    Value {
        /// Which value.
        what: &'static str,
        /// What it is.
        value: f64,
    },
    /// The two reports are of different times.
    #[error("pose and speed are {0} ms apart, at most {STALE_AFTER_MS} are bridged")]
    Apart(i64),
}

/// The state of a boat from its latest pose and speed.
///
/// The time is that of the pose. Without a course the heading stands for it. The body's velocity is that over ground, turned
/// from the course into the heading, so that leeway and current show as `v`.
///
/// # Errors
/// [`ReportError`]: a value that cannot be, or reports that do not belong together.
pub fn surface_vehicle_state(
    entity: EntityId,
    pose: &Pose,
    motion: &Motion,
) -> Result<SurfaceVehicleState, ReportError> {
    check(pose, motion)?;
    let apart = milliseconds(pose.time).saturating_sub(milliseconds(motion.time)).saturating_abs();
    if apart > STALE_AFTER_MS {
        return Err(ReportError::Apart(apart));
    }
    let course_rad = motion.course_rad.unwrap_or(pose.yaw_rad);
    let (sine, cosine) = (course_rad - pose.yaw_rad).sin_cos();
    let speed = motion.speed_over_ground_m_per_s;
    let base = EntityState {
        id: i64::try_from(entity.get()).unwrap_or(i64::MAX),
        u: (speed * cosine) as f32,
        v: (speed * sine) as f32,
        heading: bearing(pose.yaw_rad),
        pitch: degrees(pose.pitch_rad),
        roll: degrees(pose.roll_rad),
        r: degrees(motion.yaw_rate_rad_per_s),
        course: bearing(course_rad),
        groundspeed: speed as f32,
        location: Ref::new(Location3D {
            latitude: pose.latitude_rad.to_degrees(),
            longitude: wrapped(pose.longitude_rad.to_degrees()),
            altitude: pose.height_m as f32,
            altitude_type: AltitudeType::MSL,
        }),
        time: milliseconds(pose.time),
        ..Default::default()
    };
    let speed = motion.speed_through_water_m_per_s.unwrap_or(speed) as f32;
    Ok(SurfaceVehicleState { base, bank_angle: degrees(pose.roll_rad), speed })
}

fn check(pose: &Pose, motion: &Motion) -> Result<(), ReportError> {
    use std::f64::consts::{FRAC_PI_2, TAU};
    let within = |what, value: f64, limit: f64| match value.abs() <= limit {
        true => Ok(()),
        false => Err(ReportError::Value { what, value }),
    };
    within("a latitude", pose.latitude_rad, FRAC_PI_2)?;
    within("a longitude", pose.longitude_rad, TAU)?;
    within("a height", pose.height_m, 1e5)?;
    within("a yaw", pose.yaw_rad, TAU)?;
    within("a pitch", pose.pitch_rad, FRAC_PI_2)?;
    within("a roll", pose.roll_rad, TAU)?;
    within("a course", motion.course_rad.unwrap_or(0.0), TAU)?;
    within("a speed through the water", motion.speed_through_water_m_per_s.unwrap_or(0.0), 1e4)?;
    within("a rate of turn", motion.yaw_rate_rad_per_s, 1e3)?;
    if motion.speed_over_ground_m_per_s < 0.0 {
        let value = motion.speed_over_ground_m_per_s;
        return Err(ReportError::Value { what: "a speed over ground", value });
    }
    within("a speed over ground", motion.speed_over_ground_m_per_s, 1e4)
}

/// Whole milliseconds since the epoch, downwards.
fn milliseconds(time: Wall) -> i64 {
    time.0.div_euclid(1_000_000)
}

fn degrees(radians: f64) -> f32 {
    radians.to_degrees() as f32
}

/// Degrees from north, 0 to below 360.
fn bearing(radians: f64) -> f32 {
    // What rounds up to a whole turn is north.
    (radians.to_degrees().rem_euclid(360.0) as f32) % 360.0
}

/// Degrees of longitude, -180 to below 180.
fn wrapped(degrees: f64) -> f64 {
    (degrees + 180.0).rem_euclid(360.0) - 180.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn entity() -> EntityId {
        EntityId::new(400).unwrap()
    }

    fn pose() -> Pose {
        Pose {
            latitude_rad: PI / 3.0,
            longitude_rad: -PI / 2.0,
            height_m: -1.5,
            yaw_rad: -FRAC_PI_2,
            pitch_rad: PI / 18.0,
            roll_rad: -PI / 36.0,
            time: Wall(1_700_000_000_123_999_999),
        }
    }

    fn motion() -> Motion {
        Motion {
            speed_over_ground_m_per_s: 4.0,
            course_rad: Some(PI),
            speed_through_water_m_per_s: Some(3.5),
            yaw_rate_rad_per_s: PI / 180.0,
            time: Wall(1_700_000_001_000_000_000),
        }
    }

    #[track_caller]
    fn close(found: impl Into<f64>, expected: f64) {
        let found = found.into();
        assert!((found - expected).abs() < 1e-4, "{found} in place of {expected}");
    }

    #[test]
    fn radians_become_degrees_and_nanoseconds_milliseconds() {
        let state = surface_vehicle_state(entity(), &pose(), &motion()).unwrap();
        let location = state.base.location.get().unwrap();
        close(location.latitude, 60.0);
        close(location.longitude, -90.0);
        close(location.altitude, -1.5);
        assert_eq!((state.base.id, state.base.time), (400, 1_700_000_000_123));
        close(state.base.heading, 270.0);
        close(state.base.course, 180.0);
        close(state.base.pitch, 10.0);
        close(state.base.roll, -5.0);
        close(state.bank_angle, -5.0);
        close(state.base.r, 1.0);
        close(state.base.groundspeed, 4.0);
        close(state.speed, 3.5);
    }

    #[test]
    fn what_drifts_to_port_has_a_negative_v() {
        // Heading west, going south: the whole speed is to port.
        let state = surface_vehicle_state(entity(), &pose(), &motion()).unwrap();
        close(state.base.u, 0.0);
        close(state.base.v, -4.0);
        let straight = Motion { course_rad: None, speed_through_water_m_per_s: None, ..motion() };
        let state = surface_vehicle_state(entity(), &pose(), &straight).unwrap();
        close(state.base.u, 4.0);
        close(state.base.course, 270.0);
        close(state.speed, 4.0);
    }

    #[test]
    fn angles_are_wrapped_at_their_seams() {
        let seam = Pose { yaw_rad: -1e-12, longitude_rad: PI, ..pose() };
        let state = surface_vehicle_state(entity(), &seam, &motion()).unwrap();
        assert_eq!(state.base.heading, 0.0);
        close(state.base.location.get().unwrap().longitude, -180.0);
    }

    #[test]
    fn what_cannot_be_is_refused_by_name() {
        let refused =
            |pose: Pose, motion: Motion| surface_vehicle_state(entity(), &pose, &motion).unwrap_err();
        let north = refused(Pose { latitude_rad: 60.0, ..pose() }, motion());
        assert_eq!(north.to_string(), "a latitude of 60 cannot be");
        assert!(matches!(
            refused(Pose { yaw_rad: f64::NAN, ..pose() }, motion()),
            ReportError::Value { what: "a yaw", .. }
        ));
        let astern = Motion { speed_over_ground_m_per_s: -1.0, ..motion() };
        assert!(matches!(refused(pose(), astern), ReportError::Value { .. }));
        let late = Motion { time: Wall(1_700_000_010_000_000_000), ..motion() };
        assert_eq!(refused(pose(), late), ReportError::Apart(9_877));
        assert!(matches!(
            refused(pose(), Motion { time: Wall(i64::MIN), ..motion() }),
            ReportError::Apart(_)
        ));
    }
}
