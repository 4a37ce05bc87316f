//! `aldis route`: a way around zones, of a request in a file.

use super::exit::Failure;
use super::print_line;
use aldis_services::plan::route_file::{RouteFile, RouteFileError};
use serde_json::json;
use std::path::PathBuf;

/// Find a way around zones, with turns no tighter than the vehicle makes.
///
/// FILE is JSON: `start` and `goal` (`latitude`, `longitude`, `heading`, in degrees), `turn_radius_m`, `zones` (`id`, `kind`: keep_in,
/// keep_out or water; `polygon`: [[latitude, longitude], …], or `circle`: [latitude, longitude, radius in metres]; `padding_m`,
/// `altitude_m`, `time_ms`, `affected`), and of the vehicle `vehicle`, `on_water`, `altitude_m`, `time_ms`.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  aldis route boat.json --json")]
pub(crate) struct Route {
    /// The request.
    file: PathBuf,
    /// One JSON object: `length_m`, `arcs`, `places` (latitude and longitude of each). Where there is no way: `error`.
    #[arg(long)]
    json: bool,
}

impl Route {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let file = self.file.display();
        let wrong = |why: String| Failure::Usage(format!("{file}: {why}"));
        let text = std::fs::read_to_string(&self.file).map_err(|why| wrong(why.to_string()))?;
        let request: RouteFile =
            serde_json::from_str(&text).map_err(|why| wrong(format!("no request: {why}")))?;
        let route = match request.plan() {
            Ok(route) => route,
            Err(why) => {
                if self.json {
                    print_line(json!({ "error": why.to_string() }));
                }
                return Err(match why {
                    RouteFileError::Route { .. } => Failure::Failed(format!("{file}: {why}")),
                    _ => wrong(why.to_string()),
                });
            }
        };
        if self.json {
            let places: Vec<_> =
                route.places.iter().map(|place| (place.latitude_deg, place.longitude_deg)).collect();
            print_line(json!({ "length_m": route.length_m, "arcs": route.arcs, "places": places }));
            return Ok(());
        }
        for place in &route.places {
            print_line(format_args!("{:>12.7} {:>13.7}", place.latitude_deg, place.longitude_deg));
        }
        print_line(format_args!("{:.1} m, {} arcs", route.length_m, route.arcs));
        Ok(())
    }
}
