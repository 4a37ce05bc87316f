//! Made-up requests from a seed: for tests and measurements.

use super::request::{Objective, Precedence, Request, Task, TaskOption, Travel};
use crate::plan::algebra::Unnamed;
use std::collections::BTreeMap;

/// How a made-up request is related.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Related {
    /// All tasks in any order, each by one of its options.
    Parallel,
    /// Any process algebra.
    General,
}

/// A request of chance: every way takes any time up to 1 000 s, some do not exist, some vehicles are not eligible.
pub fn random_request(
    seed: u64,
    vehicles: i64,
    tasks: i64,
    options: i64,
    related: Related,
    objective: Objective,
) -> Request {
    let mut random = fastrand::Rng::with_seed(seed);
    let ids: Vec<i64> = (1..=vehicles).collect();
    let mut all = BTreeMap::new();
    for task in 1..=tasks {
        let count = random.i64(1..=options);
        let option = |random: &mut fastrand::Rng| {
            let mut eligible = Vec::new();
            if random.u32(..6) == 0 {
                eligible.push(ids[random.usize(..ids.len())]);
            }
            TaskOption { cost_ms: random.i64(0..200_000), eligible }
        };
        let options: BTreeMap<_, _> = (1..=count).map(|id| (id, option(&mut random))).collect();
        let composition = match related {
            Related::General if count >= 3 => format!("+(.(p1 p2) {})", names(3..=count)),
            _ => format!("+({})", names(1..=count)),
        };
        all.insert(task, Task { composition, options });
    }
    let places: Vec<_> =
        all.iter().flat_map(|(&task, it)| it.options.keys().map(move |&option| (task, option))).collect();
    let mut travel = Vec::new();
    for &vehicle in &ids {
        for from in std::iter::once(None).chain(places.iter().copied().map(Some)) {
            for &to in places.iter().filter(|to| from != Some(**to)) {
                if random.u32(..25) != 0 {
                    travel.push(Travel { vehicle, from, to, time_ms: random.i64(0..1_000_000) });
                }
            }
        }
    }
    let relationships = match related {
        Related::Parallel => String::new(),
        Related::General => relate(&mut random, &(1..=tasks).collect::<Vec<_>>()),
    };
    Request {
        relationships,
        vehicles: ids,
        tasks: all,
        travel,
        objective,
        precedence: if random.bool() { Precedence::Choice } else { Precedence::Temporal },
        unnamed: Unnamed::Refuse,
    }
}

fn names(ids: std::ops::RangeInclusive<i64>) -> String {
    ids.map(|id| format!("p{id} ")).collect()
}

/// Any expression over these tasks, each once.
fn relate(random: &mut fastrand::Rng, tasks: &[i64]) -> String {
    if let [task] = tasks {
        return format!("p{task} ");
    }
    let operator = [".", "|", "|", "+"][random.usize(..4)];
    let at = random.usize(1..tasks.len());
    format!("{operator}({}{})", relate(random, &tasks[..at]), relate(random, &tasks[at..]))
}

/// Line searches in a square of `side_m`, each forward and back, for vehicles of 20 m/s in one corner each.
pub fn line_searches(seed: u64, vehicles: i64, lines: i64, side_m: f64, length_m: f64) -> Request {
    let mut random = fastrand::Rng::with_seed(seed);
    let speed = 20.0;
    let time = |metres: f64| (metres / speed * 1000.0).round() as i64;
    let mut ends: Vec<((f64, f64), (f64, f64))> = Vec::new();
    for _ in 0..lines {
        let (x, y) = (random.f64() * side_m, random.f64() * side_m);
        let (east, north) = (random.f64() * std::f64::consts::TAU).sin_cos();
        let length = length_m * (0.5 + random.f64());
        ends.push(((x, y), (x + east * length, y + north * length)));
    }
    let far = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).hypot(a.1 - b.1);
    let task = |&(a, b): &((f64, f64), (f64, f64))| {
        let option = TaskOption { cost_ms: time(far(a, b)), eligible: Vec::new() };
        Task {
            composition: "+(p1 p2 )".to_owned(),
            options: BTreeMap::from([(1, option.clone()), (2, option)]),
        }
    };
    // Each option as where it begins and where it ends.
    let all = ends.iter().zip(1..).flat_map(|(&(a, b), id)| [((id, 1), a, b), ((id, 2), b, a)]);
    let all: Vec<_> = all.collect();
    let mut travel = Vec::new();
    for vehicle in 1..=vehicles {
        let corner = (side_m * (vehicle % 2) as f64, side_m * (vehicle / 2 % 2) as f64);
        for &(to, begin, _) in &all {
            travel.push(Travel { vehicle, from: None, to, time_ms: time(far(corner, begin)) });
            for &(from, _, end) in all.iter().filter(|(from, ..)| from.0 != to.0) {
                travel.push(Travel { vehicle, from: Some(from), to, time_ms: time(far(end, begin)) });
            }
        }
    }
    Request {
        relationships: String::new(),
        vehicles: (1..=vehicles).collect(),
        tasks: ends.iter().zip(1..).map(|(line, id)| (id, task(line))).collect(),
        travel,
        objective: Objective::MinMax,
        precedence: Precedence::Choice,
        unnamed: Unnamed::Refuse,
    }
}
