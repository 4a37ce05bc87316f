//! How tight the vehicle of a file turns.

use super::{RouteFile, RouteFileError};
use crate::plan::turning::{radius_of_bank, radius_of_yaw_rate};

impl RouteFile {
    /// The radius of the tightest turn, in metres, as it is given or by speed and bank angle or yaw rate; none where the vehicle
    /// turns on the spot.
    ///
    /// # Errors
    /// A turn that is given in two ways, or none.
    pub fn turn_radius_m(&self) -> Result<Option<f64>, RouteFileError> {
        let wrong = |what: String| Err(RouteFileError::Turn(what));
        let speed = match (self.speed_m_per_s, self.bank_angle_deg.or(self.yaw_rate_deg_per_s)) {
            (Some(speed), _) if !(speed > 0.0 && speed.is_finite()) => {
                return wrong(format!("`speed_m_per_s` of {speed} is none: it must be above 0"));
            }
            (Some(speed), _) => speed,
            (None, Some(_)) => {
                return wrong("`bank_angle_deg` and `yaw_rate_deg_per_s` need `speed_m_per_s`".to_owned());
            }
            (None, None) => return Ok(self.turn_radius_m),
        };
        match (self.turn_radius_m, self.bank_angle_deg, self.yaw_rate_deg_per_s) {
            (None, Some(bank), None) if bank > 0.0 && bank < 90.0 => {
                Ok(Some(radius_of_bank(speed, bank.to_radians())))
            }
            (None, Some(bank), None) => {
                wrong(format!("`bank_angle_deg` of {bank} turns nowhere: it must be above 0 and below 90"))
            }
            (None, None, Some(rate)) if rate > 0.0 && rate.is_finite() => {
                Ok(Some(radius_of_yaw_rate(speed, rate.to_radians())))
            }
            (None, None, Some(rate)) => {
                wrong(format!("`yaw_rate_deg_per_s` of {rate} turns nowhere: it must be above 0"))
            }
            (radius, None, None) => Ok(radius),
            _ => wrong(
                "the turn is given twice: one of `turn_radius_m`, `bank_angle_deg` and `yaw_rate_deg_per_s` is enough"
                    .to_owned(),
            ),
        }
    }
}
