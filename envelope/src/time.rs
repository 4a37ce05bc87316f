//! Time as the pure crates see it: handed in, never read. And UMAA's `DateTime`.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::{Add, Sub};
use std::time::Duration;

/// A moment on a clock that never steps: time since an arbitrary start, the same for one process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Monotonic(Duration);

impl Monotonic {
    /// The start of the clock.
    pub const START: Self = Self(Duration::ZERO);

    /// A moment from the time since the start.
    pub const fn since_start(elapsed: Duration) -> Self {
        Self(elapsed)
    }

    /// The time since the start.
    pub const fn elapsed(self) -> Duration {
        self.0
    }
}

impl Add<Duration> for Monotonic {
    type Output = Self;
    fn add(self, later: Duration) -> Self {
        Self(self.0.saturating_add(later))
    }
}

impl Sub for Monotonic {
    type Output = Duration;
    /// The time from `earlier` to `self`; zero when it is not earlier.
    fn sub(self, earlier: Self) -> Duration {
        self.0.saturating_sub(earlier.0)
    }
}

/// A moment on the wall clock: nanoseconds since the POSIX epoch. It may step and differ between vehicles by minutes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
pub struct Wall(pub i64);

/// The two clocks at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Now {
    /// For waiting and for ages.
    pub monotonic: Monotonic,
    /// For stamps that others read.
    pub wall: Wall,
}

/// A UMAA `DateTime`: seconds and nanoseconds since the POSIX epoch (umaa-so, Type rules).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
#[serde(try_from = "DateTimeMembers")]
pub struct DateTime {
    seconds: i64,
    nanoseconds: i32,
}

/// What a sender says, before its range is known.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DateTimeMembers {
    seconds: i64,
    nanoseconds: i32,
}

/// The nanoseconds of a `DateTime` are outside 0 to 999 999 999.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{0} nanoseconds in a DateTime: 0 to 999999999 are allowed")]
pub struct DateTimeError(pub i32);

impl DateTime {
    /// A date from whole seconds since the epoch and the nanoseconds after them.
    ///
    /// # Errors
    /// [`DateTimeError`] when the nanoseconds are not 0 to 999 999 999.
    pub const fn new(seconds: i64, nanoseconds: i32) -> Result<Self, DateTimeError> {
        if nanoseconds < 0 || nanoseconds > 999_999_999 {
            return Err(DateTimeError(nanoseconds));
        }
        Ok(Self { seconds, nanoseconds })
    }

    /// Whole seconds since the POSIX epoch.
    pub const fn seconds(self) -> i64 {
        self.seconds
    }

    /// Nanoseconds after the whole second, 0 to 999 999 999.
    pub const fn nanoseconds(self) -> i32 {
        self.nanoseconds
    }
}

impl TryFrom<DateTimeMembers> for DateTime {
    type Error = DateTimeError;
    fn try_from(members: DateTimeMembers) -> Result<Self, DateTimeError> {
        Self::new(members.seconds, members.nanoseconds)
    }
}

impl From<Wall> for DateTime {
    fn from(wall: Wall) -> Self {
        let nanoseconds = wall.0.rem_euclid(1_000_000_000) as i32;
        Self { seconds: wall.0.div_euclid(1_000_000_000), nanoseconds }
    }
}

/// Saturates outside the years 1677 to 2262, which nanoseconds in 64 bits can tell.
impl From<DateTime> for Wall {
    fn from(date: DateTime) -> Self {
        Self(date.seconds.saturating_mul(1_000_000_000).saturating_add(i64::from(date.nanoseconds)))
    }
}

/// RFC 3339 in UTC with milliseconds, `2026-11-22T01:11:08.120Z`.
impl fmt::Display for Wall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let milliseconds = self.0.div_euclid(1_000_000);
        let (days, of_day) = (milliseconds.div_euclid(86_400_000), milliseconds.rem_euclid(86_400_000));
        let (year, month, day) = civil_from_days(days);
        let (hour, minute, second) = (of_day / 3_600_000, of_day / 60_000 % 60, of_day / 1000 % 60);
        write!(f, "{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{:03}Z", of_day % 1000)
    }
}

/// Year, month and day of the proleptic Gregorian calendar. Years are counted from March, so that the leap day is the
/// last of its year, in eras of 400 years (146 097 days).
fn civil_from_days(days: i64) -> (i64, i64, i64) {
    let from_march = days + 719_468;
    let era = from_march.div_euclid(146_097);
    let day_of_era = from_march.rem_euclid(146_097);
    let year_of_era = (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    (year_of_era + era * 400 + i64::from(month <= 2), month, day)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_read_as_people_write_them() {
        for (seconds, text) in [
            (0, "1970-01-01T00:00:00.000Z"),
            (951_782_400, "2000-02-29T00:00:00.000Z"),
            (1_795_309_868, "2026-11-22T01:11:08.000Z"),
            (-1, "1969-12-31T23:59:59.000Z"),
        ] {
            assert_eq!(Wall(seconds * 1_000_000_000).to_string(), text);
        }
    }

    #[test]
    fn a_date_before_the_epoch_keeps_positive_nanoseconds() {
        let date = DateTime::from(Wall(-1));
        assert_eq!((date.seconds(), date.nanoseconds()), (-1, 999_999_999));
        assert_eq!(Wall::from(date), Wall(-1));
        assert!(DateTime::new(0, 1_000_000_000).is_err());
    }

    #[test]
    fn a_date_is_its_two_members_in_every_form() {
        let date = DateTime::new(-1, 2).unwrap();
        assert_eq!(postcard::to_allocvec(&date).unwrap(), [1, 4]);
        assert_eq!(serde_json::to_string(&date).unwrap(), r#"{"seconds":-1,"nanoseconds":2}"#);
        let why =
            serde_json::from_str::<DateTime>(r#"{"seconds":0,"nanoseconds":-1}"#).unwrap_err().to_string();
        assert!(why.contains("0 to 999999999"), "{why}");
    }
}
