//! Numbers with ranges (ICD 5.4, table 38), and the quaternion (table 28).

use serde::{Deserialize, Serialize};
use std::cmp::Ordering;
use std::time::Duration;

/// A number is outside the range of its type.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{found} as a {type_name}: {min} to {max}{unit} are allowed")]
pub struct OutOfRange {
    found: f64,
    type_name: &'static str,
    min: f64,
    max: f64,
    unit: &'static str,
}

/// A `DurationSeconds`: seconds, 0 to 37 817 280, in steps that matter down to a microsecond.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct DurationSeconds(f64);

impl DurationSeconds {
    /// The longest duration, in seconds: 437.7 days.
    pub const MAX: f64 = 37_817_280.0;

    /// A duration of so many seconds.
    ///
    /// # Errors
    /// [`OutOfRange`] for what is not 0 to [`Self::MAX`], and for what is no number.
    pub fn new(seconds: f64) -> Result<Self, OutOfRange> {
        if (0.0..=Self::MAX).contains(&seconds) {
            // Adding zero takes the sign from a negative zero, so that equal durations have equal bits.
            return Ok(Self(seconds + 0.0));
        }
        let type_name = "DurationSeconds";
        Err(OutOfRange { found: seconds, type_name, min: 0.0, max: Self::MAX, unit: " seconds" })
    }

    /// The seconds.
    pub const fn seconds(self) -> f64 {
        self.0
    }
}

impl PartialEq for DurationSeconds {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for DurationSeconds {}

impl PartialOrd for DurationSeconds {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for DurationSeconds {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl TryFrom<f64> for DurationSeconds {
    type Error = OutOfRange;
    fn try_from(seconds: f64) -> Result<Self, OutOfRange> {
        Self::new(seconds)
    }
}

impl From<DurationSeconds> for f64 {
    fn from(duration: DurationSeconds) -> f64 {
        duration.0
    }
}

impl TryFrom<Duration> for DurationSeconds {
    type Error = OutOfRange;
    fn try_from(duration: Duration) -> Result<Self, OutOfRange> {
        Self::new(duration.as_secs_f64())
    }
}

impl From<DurationSeconds> for Duration {
    fn from(duration: DurationSeconds) -> Duration {
        Duration::from_secs_f64(duration.0)
    }
}

/// A `LargeCollectionSize`: how many elements a large collection has, 0 to 2 147 483 647.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
#[serde(try_from = "i32", into = "i32")]
pub struct LargeCollectionSize(i32);

impl LargeCollectionSize {
    /// No elements.
    pub const ZERO: Self = Self(0);

    /// A size.
    ///
    /// # Errors
    /// [`OutOfRange`] when it is negative or over 2 147 483 647.
    pub fn new(elements: usize) -> Result<Self, OutOfRange> {
        i32::try_from(elements).map(Self).map_err(|_| Self::out_of_range(elements as f64))
    }

    /// How many elements.
    pub const fn get(self) -> usize {
        self.0 as usize
    }

    fn out_of_range(found: f64) -> OutOfRange {
        let max = f64::from(i32::MAX);
        OutOfRange { found, type_name: "LargeCollectionSize", min: 0.0, max, unit: " elements" }
    }
}

impl TryFrom<i32> for LargeCollectionSize {
    type Error = OutOfRange;
    fn try_from(elements: i32) -> Result<Self, OutOfRange> {
        if elements < 0 { Err(Self::out_of_range(elements.into())) } else { Ok(Self(elements)) }
    }
}

impl From<LargeCollectionSize> for i32 {
    fn from(size: LargeCollectionSize) -> i32 {
        size.0
    }
}

/// A `BasicTypes::Quaternion` (table 28): a rotation in three dimensions. No topic of Support Operations holds one.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "the ICD says no more than that they are real numbers")]
pub struct Quaternion {
    pub a: f64,
    pub b: f64,
    pub c: f64,
    pub d: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_duration_stays_in_its_range() {
        for good in [0.0, 1e-6, 30.0, DurationSeconds::MAX] {
            assert_eq!(DurationSeconds::new(good).unwrap().seconds(), good);
        }
        for bad in [-1e-6, DurationSeconds::MAX + 1.0, f64::NAN, f64::INFINITY] {
            assert!(DurationSeconds::new(bad).is_err(), "{bad}");
            assert!(postcard::from_bytes::<DurationSeconds>(&bad.to_le_bytes()).is_err(), "{bad}");
        }
        assert_eq!(DurationSeconds::new(-0.0), DurationSeconds::new(0.0));
        let why = DurationSeconds::new(-1.0).unwrap_err().to_string();
        assert_eq!(why, "-1 as a DurationSeconds: 0 to 37817280 seconds are allowed");
        let half = DurationSeconds::try_from(Duration::from_millis(500)).unwrap();
        assert_eq!(Duration::from(half), Duration::from_millis(500));
    }

    #[test]
    fn a_size_stays_in_its_range() {
        assert_eq!(LargeCollectionSize::new(7).unwrap().get(), 7);
        assert!(LargeCollectionSize::new(i32::MAX as usize + 1).is_err());
        assert!(serde_json::from_str::<LargeCollectionSize>("-1").is_err());
        assert_eq!(postcard::to_allocvec(&LargeCollectionSize::new(1).unwrap()).unwrap(), [2]);
    }
}
