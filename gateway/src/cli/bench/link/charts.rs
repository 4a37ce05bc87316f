//! Charts as SVG files.

use crate::cli::exit::Failure;
use aldis_services::sim::link::{Chart, Profile, curves};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The picture, and the room around what is drawn in it.
const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 400.0;
const LEFT: f64 = 60.0;
const RIGHT: f64 = 20.0;
const TOP: f64 = 30.0;
const BOTTOM: f64 = 50.0;
/// The colours of lines, in turn.
const COLOURS: [&str; 3] = ["#2471a3", "#c0392b", "#1e8449"];
/// How many steps an axis has, about.
const STEPS: f64 = 6.0;

/// Measures the curves of a link and writes each chart into a directory. The files.
pub(super) fn write(
    profile: &Profile,
    count: u64,
    seed: u64,
    directory: &Path,
) -> Result<Vec<PathBuf>, Failure> {
    let failed = |path: &Path, why: std::io::Error| Failure::Failed(format!("{}: {why}", path.display()));
    std::fs::create_dir_all(directory).map_err(|why| failed(directory, why))?;
    let mut written = Vec::new();
    for chart in curves(profile, count, seed) {
        let path = directory.join(format!("{}-{}.svg", profile.name.to_lowercase(), chart.name));
        std::fs::write(&path, picture(&chart, profile.name)).map_err(|why| failed(&path, why))?;
        written.push(path);
    }
    Ok(written)
}

/// A round step that divides a length into about [`STEPS`].
fn step(length: f64) -> f64 {
    let rough = (length / STEPS).max(1e-9);
    let power = 10f64.powf(rough.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .map(|factor| factor * power)
        .into_iter()
        .find(|step| *step >= rough)
        .unwrap_or(rough)
}

/// A chart as SVG. Both axes begin at zero.
fn picture(chart: &Chart, link: &str) -> String {
    let points = || chart.lines.iter().flat_map(|(_, points)| points);
    let most = |of: fn(&(f64, f64)) -> f64| points().map(of).fold(1e-9, f64::max);
    let (across, up) = (step(most(|point| point.0)), step(most(|point| point.1)));
    let ends = ((most(|point| point.0) / across).ceil() * across, (most(|point| point.1) / up).ceil() * up);
    let x = |value: f64| LEFT + value / ends.0 * (WIDTH - LEFT - RIGHT);
    let y = |value: f64| HEIGHT - BOTTOM - value / ends.1 * (HEIGHT - TOP - BOTTOM);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>\n"
    );
    let mut axis = |line: [f64; 4], text: (f64, f64), anchor: &str, value: f64| {
        let [x1, y1, x2, y2] = line;
        // Writing to a String cannot fail.
        let _ = writeln!(
            out,
            "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"#ddd\"/>"
        );
        let shown = (value * 1e3).round() / 1e3;
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\">{shown}</text>",
            text.0, text.1
        );
    };
    for number in 0..=(ends.0 / across).round() as u32 {
        let at = x(f64::from(number) * across);
        axis([at, y(0.0), at, y(ends.1)], (at, y(0.0) + 16.0), "middle", f64::from(number) * across);
    }
    for number in 0..=(ends.1 / up).round() as u32 {
        let at = y(f64::from(number) * up);
        axis([x(0.0), at, x(ends.0), at], (x(0.0) - 6.0, at + 4.0), "end", f64::from(number) * up);
    }
    for (place, ((name, points), colour)) in chart.lines.iter().zip(COLOURS.iter().cycle()).enumerate() {
        let corners: Vec<_> =
            points.iter().map(|point| format!("{:.1},{:.1}", x(point.0), y(point.1))).collect();
        let _ = writeln!(
            out,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
            corners.join(" ")
        );
        let height = TOP + 4.0 + 16.0 * place as f64;
        let _ =
            writeln!(out, "<text x=\"{:.1}\" y=\"{height:.1}\" fill=\"{colour}\">{name}</text>", LEFT + 10.0);
    }
    let _ = writeln!(
        out,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}, link {link}</text>\n<text x=\"{LEFT}\" y=\"18\">{}</text>\n</svg>",
        (LEFT + WIDTH - RIGHT) / 2.0,
        HEIGHT - 12.0,
        chart.across,
        chart.up
    );
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round_and_lines_lie_in_the_picture() {
        assert_eq!([60.0, 6.0, 1.3, 240.0].map(step), [10.0, 1.0, 0.5, 50.0]);
        let lines = vec![("a line", vec![(0.0, 0.0), (60.0, 240.0)])];
        let chart = Chart { name: "n", across: "x", up: "y", lines };
        let drawn = picture(&chart, "L1");
        assert!(drawn.contains("points=\"60.0,350.0 620.0,42.8\""), "{drawn}");
        assert!(drawn.ends_with("</svg>\n") && drawn.contains("a line"));
    }
}
