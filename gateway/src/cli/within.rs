//! Spans of time on the command line.

use std::str::FromStr;
use std::time::Duration;

/// A span of time: `2s`, `500ms`, `1.5m`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Within(pub(crate) Duration);

impl FromStr for Within {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is not a span of time: write 500ms, 2s or 1.5m");
        let split = text.find(|c: char| c.is_ascii_alphabetic()).ok_or_else(wrong)?;
        let unit = match &text[split..] {
            "ms" => 1e-3,
            "s" => 1.0,
            "m" => 60.0,
            _ => return Err(wrong()),
        };
        let number: f64 = text[..split].parse().map_err(|_| wrong())?;
        Duration::try_from_secs_f64(number * unit).map(Self).map_err(|_| wrong())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_span_needs_its_unit() {
        let parsed = |text: &str| text.parse::<Within>().map(|within| within.0.as_millis());
        assert_eq!((parsed("500ms"), parsed("2s"), parsed("1.5m")), (Ok(500), Ok(2000), Ok(90_000)));
        for text in ["2", "s", "-1s", "2h", "", "1e400s"] {
            assert!(parsed(text).is_err(), "{text}");
        }
    }
}
