//! `aldis route`: a way around zones, or along roads, of a request in a file.

use super::exit::Failure;
use super::print_line;
use aldis_services::plan::geodesy::Place;
use aldis_services::plan::roads::Roads;
use aldis_services::plan::route_file::{RouteFile, RouteFileError};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Find a way around zones, with turns no tighter than the vehicle makes; or along roads.
///
/// FILE is JSON: `start` and `goal` (`latitude`, `longitude`, `heading`, in degrees), `zones` (`id`, `kind`: keep_in, keep_out or
/// water; `polygon`: [[latitude, longitude], …], or `circle`: [latitude, longitude, radius in metres]; `padding_m`, `altitude_m`,
/// `time_ms`, `affected`), and of the vehicle `vehicle`, `on_water`, `altitude_m`, `time_ms`.
///
/// How it turns: `turn_radius_m`, or `speed_m_per_s` with `bank_angle_deg` (air) or `yaw_rate_deg_per_s` (surface); without one of
/// them, or without both headings, on the spot.
///
/// A ground vehicle keeps to `roads`: a file in OpenStreetMap's XML, beside FILE, and to the way of one-way roads unless
/// `ignore_one_way`. It turns on the spot; roads under zones are closed.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  aldis route boat.json --json")]
pub(crate) struct Route {
    /// The request.
    file: PathBuf,
    /// One JSON object: `length_m`, `places` (latitude and longitude of each); around zones `arcs` and `turn_radius_m` (null on the
    /// spot), along roads `on_road_m` and `nodes`. Where there is no way: `error`.
    #[arg(long)]
    json: bool,
}

/// What there is to tell of a route.
struct Told {
    places: Vec<Place>,
    /// The same as JSON, without the places.
    object: serde_json::Map<String, Value>,
    line: String,
}

impl Route {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let file = self.file.display();
        let wrong = |why: String| Failure::Usage(format!("{file}: {why}"));
        let text = std::fs::read_to_string(&self.file).map_err(|why| wrong(why.to_string()))?;
        let request: RouteFile =
            serde_json::from_str(&text).map_err(|why| wrong(format!("no request: {why}")))?;
        let planned = match &request.roads {
            Some(roads) => on_roads(&request, &self.file.with_file_name(roads))?,
            None => around_zones(&request),
        };
        let told = match planned {
            Ok(told) => told,
            Err(why) => {
                if self.json {
                    print_line(json!({ "error": why.to_string() }));
                }
                return Err(match why {
                    RouteFileError::Route { .. } | RouteFileError::Roads(_) => {
                        Failure::Failed(format!("{file}: {why}"))
                    }
                    _ => wrong(why.to_string()),
                });
            }
        };
        if self.json {
            let places: Vec<_> =
                told.places.iter().map(|place| (place.latitude_deg, place.longitude_deg)).collect();
            let mut object = told.object;
            object.insert("places".to_owned(), json!(places));
            print_line(Value::Object(object));
            return Ok(());
        }
        for place in &told.places {
            print_line(format_args!("{:>12.7} {:>13.7}", place.latitude_deg, place.longitude_deg));
        }
        print_line(told.line);
        Ok(())
    }
}

fn around_zones(request: &RouteFile) -> Result<Told, RouteFileError> {
    let route = request.plan()?;
    // Both headings are needed for turns.
    let headings = request.start.heading.and(request.goal.heading);
    let radius = request.turn_radius_m()?.filter(|_| headings.is_some());
    let object = json!({ "length_m": route.length_m, "arcs": route.arcs, "turn_radius_m": radius });
    let turns = radius.map_or("turns on the spot".to_owned(), |radius| format!("turns of {radius:.1} m"));
    let line = format!("{:.1} m, {} arcs, {turns}", route.length_m, route.arcs);
    Ok(told(route.places, object, line))
}

fn on_roads(request: &RouteFile, path: &Path) -> Result<Result<Told, RouteFileError>, Failure> {
    let wrong = |why: String| Failure::Usage(format!("{}: {why}", path.display()));
    let document = std::fs::read(path).map_err(|why| wrong(why.to_string()))?;
    let roads = Roads::read(&document).map_err(|why| wrong(why.to_string()))?;
    Ok(request.plan_on_roads(roads).map(|route| {
        let (length_m, on_road_m) = (route.length_m, route.on_road_m);
        let line = format!("{length_m:.1} m, {on_road_m:.1} m of it along roads");
        let object = json!({ "length_m": length_m, "on_road_m": on_road_m, "nodes": route.nodes });
        told(route.places, object, line)
    }))
}

fn told(places: Vec<Place>, object: Value, line: String) -> Told {
    let object = match object {
        Value::Object(object) => object,
        _ => serde_json::Map::new(),
    };
    Told { places, object, line }
}
