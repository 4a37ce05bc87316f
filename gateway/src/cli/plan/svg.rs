//! A picture of a plan: zones, tasks and missions.

use super::outcome::Outcome;
use super::scenario::Scenario;
use aldis_envelope::lmcp::cmasi::{
    AbstractGeometry, AbstractZone, AreaSearchTask, EntityState, KeepOutZone, LineSearchTask, Location3D,
    PointSearchTask, Waypoint,
};
use aldis_envelope::lmcp::impact::{AreaOfInterest, LineOfInterest};
use aldis_envelope::lmcp::{Object, Ref};
use aldis_services::uxas::ground::{Ground, Point, middle, outline};
use std::fmt::Write;

/// The longer side of the picture.
const SIDE: f64 = 1000.0;

/// The room around it.
const MARGIN: f64 = 30.0;

/// The colours of missions, in turn.
const COLOURS: [&str; 6] = ["#c0392b", "#2471a3", "#1e8449", "#7d3c98", "#b7950b", "#212f3c"];

/// Something to draw: a line, closed or not, with its style.
struct Shape {
    points: Vec<Point>,
    closed: bool,
    style: String,
    label: String,
}

/// The picture as SVG.
pub(super) fn picture(scenario: &Scenario, outcome: &Outcome) -> String {
    let states = || scenario.all().filter_map(|object| object.get::<EntityState>());
    let origin = states().find_map(|state| state.location.get().cloned()).unwrap_or_default();
    let ground = Ground::new(&origin, false);
    let mut shapes: Vec<Shape> = scenario.all().filter_map(|object| shape(object, &ground)).collect();
    for ((vehicle, mission), colour) in outcome.missions.iter().zip(COLOURS.iter().cycle()) {
        let start = states().find(|state| state.id == *vehicle).and_then(|state| state.location.get());
        let waypoints = mission.waypoint_list.iter().filter_map(|at| at.get()).map(|at: &Waypoint| &at.base);
        let points: Vec<_> = start.into_iter().chain(waypoints).map(|at| ground.point(at)).collect();
        let style = format!("fill:none;stroke:{colour};stroke-width:1.5");
        shapes.push(Shape { points, closed: false, style, label: format!("vehicle {vehicle}") });
    }
    draw(&shapes)
}

fn shape(object: &dyn Object, ground: &Ground) -> Option<Shape> {
    let area = |geometry: &Ref<AbstractGeometry>, style: &str, label: String| {
        middle(geometry)?;
        let points = outline(geometry, ground)?;
        Some(Shape { points, closed: true, style: style.to_owned(), label })
    };
    let line = |points: &[Ref<Location3D>], label: String| {
        let points: Vec<_> = points.iter().filter_map(|at| at.get()).map(|at| ground.point(at)).collect();
        let style = "fill:none;stroke:#e67e22;stroke-width:4;stroke-opacity:0.4".to_owned();
        (!points.is_empty()).then_some(Shape { points, closed: false, style, label })
    };
    const TASK: &str = "fill:#f5b041;fill-opacity:0.25;stroke:#e67e22";
    if let Some(zone) = object.get::<AbstractZone>() {
        let style = match object.get::<KeepOutZone>() {
            Some(_) => "fill:#922b21;fill-opacity:0.25;stroke:#922b21",
            None => "fill:none;stroke:#117864;stroke-dasharray:6 4",
        };
        area(&zone.boundary, style, format!("zone {}", zone.zone_id))
    } else if let Some(task) = object.get::<AreaSearchTask>() {
        area(&task.search_area, TASK, format!("task {}", task.task_id))
    } else if let Some(interest) = object.get::<AreaOfInterest>() {
        area(&interest.area, TASK, format!("area {}", interest.area_id))
    } else if let Some(task) = object.get::<LineSearchTask>() {
        line(&task.point_list, format!("task {}", task.task_id))
    } else if let Some(interest) = object.get::<LineOfInterest>() {
        line(&interest.line, format!("line {}", interest.line_id))
    } else if let Some(task) = object.get::<PointSearchTask>() {
        line(std::slice::from_ref(&task.search_location), format!("task {}", task.task_id))
    } else {
        None
    }
}

fn draw(shapes: &[Shape]) -> String {
    let all = || shapes.iter().flat_map(|shape| &shape.points);
    let low = all().fold((f64::INFINITY, f64::INFINITY), |low, p| (low.0.min(p.0), low.1.min(p.1)));
    let high =
        all().fold((f64::NEG_INFINITY, f64::NEG_INFINITY), |high, p| (high.0.max(p.0), high.1.max(p.1)));
    let extent = (high.0 - low.0).max(high.1 - low.1).max(1.0);
    let scale = (SIDE - 2.0 * MARGIN) / extent;
    // North is up.
    let at = |p: &Point| (MARGIN + (p.1 - low.1) * scale, MARGIN + (high.0 - p.0) * scale);
    let mut picture = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {SIDE} {SIDE}\" font-size=\"12\">\n"
    );
    // Writing to a String cannot fail.
    for shape in shapes {
        let points: String = shape.points.iter().map(at).map(|(x, y)| format!("{x:.1},{y:.1} ")).collect();
        let element = if shape.closed { "polygon" } else { "polyline" };
        let _ = writeln!(picture, "<{element} points=\"{}\" style=\"{}\"/>", points.trim_end(), shape.style);
        if let Some((x, y)) = shape.points.first().map(at) {
            let _ = writeln!(picture, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\"/>");
            let _ =
                writeln!(picture, "<text x=\"{:.1}\" y=\"{:.1}\">{}</text>", x + 5.0, y - 5.0, shape.label);
        }
    }
    picture.push_str("</svg>\n");
    picture
}
