//! Delivery, latency and bytes of commands against the loss of a link and against how many are sent.

use super::emulator::Profile;
use super::load::percentile;
use super::rows::{self, Setting};
use std::time::Duration;

/// A chart: lines over one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// What it shows: the name of its file.
    pub name: &'static str,
    /// What the horizontal axis means, with its unit.
    pub across: &'static str,
    /// What the vertical axis means, with its unit.
    pub up: &'static str,
    /// The lines, by name.
    pub lines: Vec<(&'static str, Vec<(f64, f64)>)>,
}

/// The percentages lost that are measured.
const LOSSES: [f64; 8] = [0.0, 5.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0];
/// The commands a second that are measured.
const RATES: [f64; 8] = [0.1, 0.25, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0];

/// What one load came to.
struct Point {
    across: f64,
    delivered: f64,
    p50: f64,
    p99: f64,
    bytes: f64,
}

fn point(profile: &Profile, seed: u64, count: u64, loss: f64, rate: f64, across: f64) -> Point {
    let profile = Profile { loss: loss / 100.0, ..profile.clone() };
    let setting = Setting { profile, keyed: false, seed };
    let mut latency = rows::latency(&setting, count, Duration::from_secs_f64(1.0 / rate), false);
    Point {
        across,
        delivered: 100.0 * latency.seconds.len() as f64 / count as f64,
        p50: percentile(&mut latency.seconds, 0.5),
        p99: percentile(&mut latency.seconds, 0.99),
        bytes: latency.bytes,
    }
}

/// The charts of a link, `count` commands of 64 bytes with a lifespan of a minute at each point.
pub fn curves(profile: &Profile, count: u64, seed: u64) -> Vec<Chart> {
    let losses = LOSSES.map(|loss| point(profile, seed, count, loss, 0.5, loss));
    let rates = RATES.map(|rate| point(profile, seed, count, profile.loss * 100.0, rate, rate));
    let line = |points: &[Point], of: fn(&Point) -> f64| {
        points.iter().map(|point| (point.across, of(point))).collect::<Vec<_>>()
    };
    let charts = |names: [&'static str; 3], across: &'static str, points: &[Point]| {
        let delivered = vec![("delivered", line(points, |point| point.delivered))];
        let latency = vec![
            ("half of them", line(points, |point| point.p50)),
            ("99 of 100", line(points, |point| point.p99)),
        ];
        let bytes = vec![("both ways", line(points, |point| point.bytes))];
        [
            Chart { name: names[0], across, up: "delivered within a minute, %", lines: delivered },
            Chart { name: names[1], across, up: "latency, s", lines: latency },
            Chart { name: names[2], across, up: "bytes on the link for a command of 64", lines: bytes },
        ]
    };
    let by_loss =
        charts(["delivery-by-loss", "latency-by-loss", "bytes-by-loss"], "lost each way, %", &losses);
    let by_rate =
        charts(["delivery-by-rate", "latency-by-rate", "bytes-by-rate"], "commands a second", &rates);
    by_loss.into_iter().chain(by_rate).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loss_costs_time_and_bytes_and_no_commands() {
        let charts = curves(&Profile::L1, 20, 1);
        assert_eq!(charts.len(), 6);
        let ends = |name: &str, line: usize| {
            let chart = charts.iter().find(|chart| chart.name == name).unwrap();
            let points = &chart.lines[line].1;
            (points[0].1, points[5].1)
        };
        assert_eq!(ends("delivery-by-loss", 0), (100.0, 100.0));
        let (clean, lossy) = ends("latency-by-loss", 1);
        assert!(clean < 0.6 && lossy > clean, "{clean} {lossy}");
        let (clean, lossy) = ends("bytes-by-loss", 0);
        assert!(clean < lossy, "{clean} {lossy}");
    }
}
