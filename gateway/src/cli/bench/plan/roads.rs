//! Ways along roads: how fast.

use super::super::statistics::{percentile, rounded};
use super::{failed, millis};
use crate::cli::exit::Failure;
use aldis_services::plan::geodesy::Place;
use aldis_services::plan::roads::{OneWay, Roads};
use serde_json::{Value, json};
use std::fmt::Write;
use std::time::Instant;

/// How many nodes the made-up roads have along a side.
const SIDE: usize = 300;

/// A town of 90 000 crossings: how long it takes to read, and to find ways in.
pub(super) fn roads() -> Result<Value, Failure> {
    let mut random = fastrand::Rng::with_seed(2);
    let text = town(&mut random).map_err(failed)?;
    let begin = Instant::now();
    let roads = Roads::read(text.as_bytes()).map_err(failed)?;
    let read = begin.elapsed();
    let (mut nearest, mut ways) = (Vec::new(), Vec::new());
    let mut apart = 0;
    for _ in 0..300 {
        let mut place =
            || Place { latitude_deg: 60.0 + random.f64() * 0.3, longitude_deg: 10.0 + random.f64() * 0.6 };
        let (start, goal) = (place(), place());
        let begin = Instant::now();
        std::hint::black_box(roads.nearest(start));
        nearest.push(begin.elapsed());
        let begin = Instant::now();
        apart += u32::from(roads.route(start, goal, OneWay::Respect).is_err());
        ways.push(begin.elapsed());
    }
    Ok(json!({
        "nodes": roads.nodes(), "segments": roads.segments(), "megabytes": rounded(text.len() as f64 / 1e6), "read_ms": millis(read),
        "nearest_p99_ms": millis(percentile(&mut nearest, 0.99)), "route_p50_ms": millis(percentile(&mut ways, 0.5)),
        "route_p99_ms": millis(percentile(&mut ways, 0.99)), "no_way": apart,
    }))
}

/// Roads in rows and columns, one in eight left out, some one way.
fn town(random: &mut fastrand::Rng) -> Result<String, std::fmt::Error> {
    let mut text = "<osm>".to_owned();
    for at in 0..SIDE * SIDE {
        let (row, column) = (at / SIDE, at % SIDE);
        let latitude = 60.0 + row as f64 * 0.001 + random.f64() * 3e-4;
        let longitude = 10.0 + column as f64 * 0.002 + random.f64() * 6e-4;
        write!(text, "<node id='{at}' lat='{latitude:.7}' lon='{longitude:.7}'/>")?;
        for next in [(column + 1 < SIDE).then_some(at + 1), (row + 1 < SIDE).then_some(at + SIDE)] {
            if let Some(next) = next.filter(|_| random.u32(..8) != 0) {
                let one_way = if random.u32(..6) == 0 { "yes" } else { "no" };
                let tags = format!("<tag k='highway' v='x'/><tag k='oneway' v='{one_way}'/>");
                write!(text, "<way id='{at}'><nd ref='{at}'/><nd ref='{next}'/>{tags}</way>")?;
            }
        }
    }
    text.push_str("</osm>");
    Ok(text)
}
