//! The table of goals of the lossy link, measured.

use super::emulator::Profile;
use super::load::{mean, percentile};
use super::rows::{self, Setting};
use super::swarm::swarm;
use crate::link::TAG_BYTES;
use crate::sim::custody::crash;
use std::time::Duration;

/// One row of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Its name in the table.
    pub name: &'static str,
    /// What is to be reached, in words.
    pub goal: String,
    /// What was measured, in words.
    pub measured: String,
    /// Whether it was reached.
    pub met: bool,
    /// Where it was not: what stands between, in figures of the same run.
    pub reason: Option<String>,
}

impl Row {
    fn new(name: &'static str, goal: impl Into<String>, measured: String, met: bool) -> Self {
        Self { name, goal: goal.into(), measured, met, reason: None }
    }

    fn because(self, reason: impl FnOnce() -> String) -> Self {
        let reason = (!self.met).then(reason);
        Self { reason, ..self }
    }
}

/// What is to be measured.
#[derive(Debug, Clone)]
pub struct Bench {
    /// The link.
    pub profile: Profile,
    /// With keys; figures may then be 10 % worse.
    pub keyed: bool,
    /// How much of the full measurement, 1 for all of it.
    pub part: f64,
    /// The seed of everything.
    pub seed: u64,
    /// The rows, by name; none for all.
    pub only: Vec<String>,
}

impl Bench {
    fn setting(&self) -> Setting {
        Setting { profile: self.profile.clone(), keyed: self.keyed, seed: self.seed }
    }

    fn count(&self, full: u64) -> u64 {
        ((full as f64 * self.part) as u64).max(1)
    }

    /// A limit with what keys may cost.
    fn limit(&self, limit: f64) -> f64 {
        if self.keyed { limit * 1.1 } else { limit }
    }

    /// The bytes of the tags of so many frames.
    fn tags(&self, frames: f64) -> f64 {
        if self.keyed { frames * TAG_BYTES as f64 } else { 0.0 }
    }

    fn wants(&self, name: &str) -> bool {
        self.only.is_empty() || self.only.iter().any(|only| only.eq_ignore_ascii_case(name))
    }
}

/// How a row is measured.
type Measure = fn(&Bench) -> Row;

/// The rows that have a goal on a link.
fn rows_of(profile: &Profile) -> &'static [(&'static str, Measure)] {
    match profile.name {
        "L1" => &[
            ("G1", g1),
            ("G2", g2),
            ("G2b", g2_backlog),
            ("G3", g3),
            ("G4", g4),
            ("G5", g5),
            ("G5n", g5_nothing),
            ("G6", g6),
            ("G7", g7),
            ("G8", g8),
            ("G9", g9),
            ("G10", g10),
            ("G11", g11),
            ("G12", g12),
            ("G14", g14),
            ("G15", g15),
            ("plan", planned),
        ],
        "L2" => &[("G1", g1), ("G3", g3), ("G8", g8)],
        "L3" => &[("G1", g1), ("G3", g3), ("G12", g12)],
        "L4" => &[("G1", g1), ("G3", g3), ("G4", g4), ("G5", g5)],
        _ => &[("G1", g1), ("G2", g2_wifi), ("G3", g3)],
    }
}

/// The names of the rows that have a goal on a link.
pub fn row_names(profile: &Profile) -> Vec<&'static str> {
    rows_of(profile).iter().map(|(name, _)| *name).collect()
}

/// Measures the rows that have a goal on this link.
pub fn bench(bench: &Bench) -> Vec<Row> {
    let rows = rows_of(&bench.profile).iter();
    let unexplained = || "no reason is known: a fault to be found".to_owned();
    let measured = rows.filter(|(name, _)| bench.wants(name)).map(|(_, row)| row(bench));
    measured
        .map(|row| Row { reason: row.reason.clone().or_else(|| (!row.met).then(unexplained)), ..row })
        .collect()
}

fn g1(bench: &Bench) -> Row {
    let (count, seeds) = (bench.count(10_000), bench.count(20));
    let slow = bench.profile.name == "L3";
    let runs = [(bench.profile.loss, if slow { 300 } else { 60 }), (0.5, if slow { 300 } else { 120 })];
    let (mut words, mut met) = (Vec::new(), true);
    // Only L1 has the second run.
    for (loss, lifespan) in runs.into_iter().take(if bench.profile.name == "L1" { 2 } else { 1 }) {
        let mut setting = bench.setting();
        setting.profile.loss = loss;
        let (mut fewest, mut twice, mut out_of_order) = (count, 0, 0);
        for seed in 0..seeds {
            let once = rows::exactly_once(&setting.seeded(seed), count, Duration::from_secs(lifespan));
            fewest = fewest.min(once.delivered);
            twice += once.twice;
            out_of_order += once.out_of_order;
        }
        met &= fewest == count && twice == 0 && out_of_order == 0;
        let percent = loss * 100.0;
        words.push(format!("{percent:.0} %: at least {fewest} of {count} in each of {seeds}, {twice} twice, {out_of_order} out of order"));
    }
    Row::new("G1", format!("{count} of {count}, 0 twice, 0 out of order"), words.join("; "), met)
}

fn g2(bench: &Bench) -> Row {
    let mut latency = rows::latency(&bench.setting(), bench.count(10_000), Duration::from_secs(2), false);
    let [p50, p99, p999] = latency.percentiles();
    let copies = latency.copies;
    let limits = [0.45, 1.4, 2.3, 2.6].map(|limit| bench.limit(limit));
    let met = p50 <= limits[0] && p99 <= limits[1] && p999 <= limits[2] && copies <= limits[3];
    let measured = format!("{p50:.2} / {p99:.2} / {p999:.2} s at {copies:.2} copies");
    Row::new("G2", "0.45 / 1.4 / 2.3 s at no more than 2.6 copies", measured, met)
}

fn g2_backlog(bench: &Bench) -> Row {
    let mut latency = rows::latency(&bench.setting(), bench.count(10_000), Duration::from_secs(2), true);
    let [p50, p99, p999] = latency.percentiles();
    let limits = [0.55, 1.9, 2.9].map(|limit| bench.limit(limit));
    let met = p50 <= limits[0] && p99 <= limits[1] && p999 <= limits[2];
    let measured = format!("{p50:.2} / {p99:.2} / {p999:.2} s at {:.2} copies", latency.copies);
    Row::new("G2b", "beside 10 x backlog 0.55 / 1.9 / 2.9 s", measured, met)
}

fn g2_wifi(bench: &Bench) -> Row {
    let mut latency = rows::latency(&bench.setting(), bench.count(10_000), Duration::from_millis(200), false);
    let [p50, p99, _] = latency.percentiles();
    let measured = format!("p50 {:.1} ms, p99 {:.1} ms", p50 * 1_000.0, p99 * 1_000.0);
    Row::new("G2", "p99 at most 25 ms", measured, p99 <= bench.limit(0.025))
}

fn g3(bench: &Bench) -> Row {
    let lifespan = Duration::from_secs(if bench.profile.name == "L3" { 300 } else { 15 });
    let told = rows::refused(&bench.setting(), bench.count(5_000), lifespan);
    let measured = format!(
        "{} offered, {} delivered, {} told, {} untold or late, {} told wrongly",
        told.offered, told.delivered, told.told, told.untold, told.lies
    );
    let met = told.untold == 0 && told.lies == 0;
    Row::new("G3", "all undelivered told within lifespan + 1 RTT", measured, met)
}

fn g4(bench: &Bench) -> Row {
    let mut seconds = rows::after_outage(&bench.setting(), bench.count(400));
    let (p50, p95) = (percentile(&mut seconds, 0.5), percentile(&mut seconds, 0.95));
    let measured = format!("p50 {p50:.2} s, p95 {p95:.2} s of {}", seconds.len());
    Row::new("G4", "p95 1.5 s after a 10 min outage", measured, p95 <= bench.limit(1.5))
}

fn g5(bench: &Bench) -> Row {
    let runs: Vec<_> =
        (0..bench.count(100)).map(|seed| rows::resync(&bench.setting().seeded(seed), 1.0)).collect();
    let mut seconds: Vec<_> = runs.iter().map(|run| run.seconds).collect();
    let base = 9_600.0 / (1.0 - bench.profile.loss);
    let forward = mean(&runs.iter().map(|run| run.forward / base).collect::<Vec<_>>());
    let both = mean(&runs.iter().map(|run| run.both / base).collect::<Vec<_>>());
    let (p50, p95) = (percentile(&mut seconds, 0.5), percentile(&mut seconds, 0.95));
    let limits = [14.5, 17.0, 1.2, 1.25].map(|limit| bench.limit(limit));
    let met = p50 <= limits[0] && p95 <= limits[1] && forward <= limits[2] && both <= limits[3];
    let measured =
        format!("{p50:.2} s median, {p95:.2} s p95; {forward:.3} x forward, {both:.3} x with acks");
    Row::new("G5", "14.5 s median, 17 s p95; 1.20 x, 1.25 x", measured, met).because(|| {
        let (rate, loss) = (bench.profile.rate as f64, bench.profile.loss);
        let bytes = mean(&runs.iter().map(|run| run.until_last).collect::<Vec<_>>());
        let heard = mean(&runs.iter().map(|run| run.heard).collect::<Vec<_>>());
        let all = mean(&runs.iter().map(|run| run.seconds).collect::<Vec<_>>());
        let (flight, airtime) = (bench.profile.delay.as_secs_f64(), bytes / rate);
        let least = base / rate + flight;
        format!(
            "{least:.1} s if no byte but the content went out; on average {heard:.2} s until the peer is heard, {airtime:.2} s for \
             {bytes:.0} B until the last sample, {flight:.2} s of flight, {:.2} s of waiting for word of the last frames, of which \
             {:.0} % are lost",
            (all - heard - airtime - flight).max(0.0),
            loss * 100.0
        )
    })
}

fn g5_nothing(bench: &Bench) -> Row {
    let runs = (0..bench.count(100)).map(|seed| rows::resync(&bench.setting().seeded(seed), 0.0));
    let mut both: Vec<_> = runs.map(|run| run.both).collect();
    let most = percentile(&mut both, 1.0);
    let measured = format!("{most:.0} B at most");
    Row::new("G5n", "300 B when nothing changed", measured, most <= bench.limit(300.0))
}

fn g6(bench: &Bench) -> Row {
    let seconds = bench.count(3_600);
    let (alone, p99, queued) = rows::overload(&bench.setting(), seconds, false);
    let (beside, ..) = rows::overload(&bench.setting(), seconds, true);
    let limits = [0.95, 3.0, 1.05].map(|limit| bench.limit(limit));
    let met = alone <= limits[0] && p99 <= limits[1] && beside <= limits[2] && queued <= 10;
    let measured = format!(
        "{alone:.2} / {p99:.2} s alone, {beside:.2} s beside commands; {queued} queued of 10 instances"
    );
    Row::new("G6", "age 0.95 / 3 s alone, 1.05 s beside commands; one queued an instance", measured, met)
}

fn g7(bench: &Bench) -> Row {
    let count = bench.count(3_000);
    let at = |mtu| rows::queueing(&bench.setting(), count, mtu);
    let (large, small) = (at(256), at(128));
    let met = large <= bench.limit(0.22) && small <= bench.limit(0.13);
    let measured = format!("p99.9 {large:.3} s with 256 B, {small:.3} s with 128 B");
    Row::new("G7", "p99.9 0.22 s with 256 B frames, 0.13 s with 128 B", measured, met)
}

fn g8(bench: &Bench) -> Row {
    let runs = bench.count(40);
    let mut rates: Vec<_> = (0..runs).map(|seed| rows::bulk(&bench.setting().seeded(seed), 60_000)).collect();
    let median = percentile(&mut rates, 0.5);
    let goal = if bench.profile.name == "L2" { 0.75 * 6.72 } else { 5.7 };
    let met = median >= if bench.keyed { goal / 1.1 } else { goal };
    Row::new("G8", format!("{goal:.2} kbit/s median"), format!("{median:.2} kbit/s"), met)
}

fn g9(bench: &Bench) -> Row {
    let latency = rows::latency(&bench.setting(), bench.count(10_000), Duration::from_secs(2), false);
    let met = latency.bytes <= bench.limit(230.0);
    Row::new("G9", "230 B a command", format!("{:.0} B", latency.bytes), met).because(|| {
        let tags = bench.tags(latency.frames);
        format!(
            "{:.2} frames a command with copies and acknowledgements, and {tags:.0} B of them are tags; {:.0} B are all else",
            latency.frames,
            latency.bytes - tags
        )
    })
}

fn g10(bench: &Bench) -> Row {
    let (measured, met) = match crash(bench.count(1_000), bench.seed) {
        Ok(report) => (
            format!(
                "{} lost and {} twice of {} accepted, {} crashes, {} during a write",
                report.lost, report.twice, report.accepted, report.points, report.during_a_write
            ),
            report.lost == 0 && report.twice == 0,
        ),
        Err(why) => (why, false),
    };
    Row::new("G10", "0 lost, 0 twice at 1000 crashes", measured, met)
}

fn g11(bench: &Bench) -> Row {
    let hours = bench.count(100);
    let at = |loss| {
        let mut setting = bench.setting();
        setting.profile.loss = loss;
        rows::idle(&setting, hours)
    };
    let (lossy, clean) = (at(0.3), at(0.0));
    let alarms = lossy.false_alarms_per_hour;
    let met = lossy.bytes_per_second <= bench.limit(11.0)
        && clean.bytes_per_second <= bench.limit(4.0)
        && alarms <= bench.limit(0.15)
        && lossy.detection.max(clean.detection) <= 10.5
        && lossy.silent_bytes + clean.silent_bytes == 0;
    let measured = format!(
        "{:.1} B/s at 30 % loss, {:.1} without, {} silent; {alarms:.2} false alarms an hour, cut told after {:.1} s",
        lossy.bytes_per_second,
        clean.bytes_per_second,
        lossy.silent_bytes + clean.silent_bytes,
        lossy.detection.max(clean.detection)
    );
    let goal = "11 B/s at 30 % loss, 4 without, 0 silent; 0.15 false alarms an hour";
    Row::new("G11", goal, measured, met).because(|| {
        let words = |loss: &str, idle: &rows::Idle| {
            let tags = bench.tags(idle.frames_per_second);
            let (frames, rest) = (idle.frames_per_second, idle.bytes_per_second - tags);
            format!("{loss} {frames:.2} frames a second, {tags:.1} B/s of tags and {rest:.1} of all else")
        };
        format!(
            "so many frames make silence of 10 s the rare chance that it is to be: {}, {}",
            words("at 30 % loss", &lossy),
            words("without", &clean)
        )
    })
}

fn g12(bench: &Bench) -> Row {
    let (over, used) = rows::budget(&bench.setting(), bench.count(3_600).max(60));
    let met = over <= bench.profile.mtu as i64 && used >= 0.97;
    let measured = format!("{over} B over the rate in the worst 10 s, {:.1} % used", used * 100.0);
    Row::new("G12", format!("at most {} B over, at least 97 % used", bench.profile.mtu), measured, met)
}

fn g14(bench: &Bench) -> Row {
    let count = bench.count(1_000);
    let (once, seconds) = rows::through_shore(&bench.setting(), count);
    let met = once.delivered == count && once.twice == 0 && once.out_of_order == 0;
    let measured = format!(
        "{} of {count}, {} twice, {} out of order; the hour's backlog through in {seconds:.0} s",
        once.delivered, once.twice, once.out_of_order
    );
    Row::new("G14", "G1 holds by way of shore through an hour's partition", measured, met)
}

/// `link plan` against a run.
fn planned(bench: &Bench) -> Row {
    let forecasts = rows::forecasts(&bench.setting(), bench.count(3_600).max(300), true);
    let worst = forecasts.iter().map(rows::Forecast::error).fold(0.0, f64::max);
    let words = forecasts.iter().map(|f| format!("{}: {:.1} for {:.1} B/s", f.load, f.planned, f.measured));
    let measured = format!("{:.1} % off at most; {}", worst * 100.0, words.collect::<Vec<_>>().join(", "));
    Row::new("plan", "bytes within 10 % of those that `link plan` says", measured, worst <= 0.1)
}

fn g15(bench: &Bench) -> Row {
    let report = swarm(bench.part * 500.0, bench.seed);
    let measured = format!(
        "{} broken in {:.0} link-hours of {} links with {} crashes{}",
        report.violations.len(),
        report.hours,
        report.links,
        report.crashes,
        report.violations.first().map_or(String::new(), |first| format!(": {first}"))
    );
    Row::new("G15", "0 broken", measured, report.violations.is_empty())
}
