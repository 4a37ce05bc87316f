//! Who may command the vehicles of a scenario, from its `control.toml`.

use crate::cli::exit::Failure;
use aldis_envelope::EntityId;
use aldis_services::sim::mission::TakeOver;
use serde::Deserialize;
use std::path::Path;
use std::time::Duration;

/// The file of a scenario that says it.
const FILE: &str = "control.toml";

/// Missions go out under control of a resource, which others may take over.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ControlFile {
    /// The resource of each vehicle.
    pub(super) resource: String,
    #[serde(default)]
    take_over: Vec<Taken>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Taken {
    vehicle: u64,
    at_s: f64,
}

impl ControlFile {
    /// Reads the file of a scenario, where there is one.
    pub(super) fn read(directory: &Path) -> Result<Option<Self>, Failure> {
        let path = directory.join(FILE);
        if !path.exists() {
            return Ok(None);
        }
        let wrong = |why: String| Failure::Usage(format!("{}: {why}", path.display()));
        let text = std::fs::read_to_string(&path).map_err(|why| wrong(why.to_string()))?;
        let file: Self = toml::from_str(&text).map_err(|why| wrong(why.to_string()))?;
        file.takes_over().map_err(wrong)?;
        Ok(Some(file))
    }

    /// Who is taken over, and when.
    pub(super) fn takes_over(&self) -> Result<Vec<TakeOver>, String> {
        let one = |taken: &Taken| {
            let vehicle = EntityId::new(taken.vehicle).map_err(|why| format!("vehicle: {why}"))?;
            let at = Duration::try_from_secs_f64(taken.at_s).map_err(|why| format!("at_s: {why}"))?;
            Ok(TakeOver { at, vehicle, resource: self.resource.clone() })
        };
        self.take_over.iter().map(one).collect()
    }
}
