//! `kind = "osm-planner"`: ways of ground vehicles along the roads of a file.

use super::error::Fault;
use super::schema;
use super::service::named_service;
use aldis_envelope::ServiceId;
use aldis_services::plan::roads::OneWay;
use aldis_services::uxas::osm::OsmConfig;
use bytes::Bytes;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A road file of a country is cut into pieces first; a longer one is a mistake.
const FILE_BYTES_MAX: u64 = 1 << 30;

/// Finds ways of ground vehicles along roads, the roads that lead out of a place, and the places of a way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct OsmPlanner {
    /// The service id, 100 or more, unique on the node.
    #[schemars(with = "schema::NamedServiceId")]
    pub(crate) service: ServiceId,
    /// The roads, in OpenStreetMap's XML. A relative name begins beside the configuration.
    pub(crate) osm_file: PathBuf,
    /// Whether one-way roads are driven both ways, as the reference does. Default: false.
    #[serde(default)]
    pub(crate) ignore_one_way: bool,
    /// The roads, once they are read.
    #[serde(skip)]
    pub(crate) roads: Option<OsmConfig>,
}

impl OsmPlanner {
    /// Checks what the types do not.
    pub(super) fn check(self) -> Result<Self, Fault> {
        named_service(self.service)?;
        Ok(self)
    }

    /// Reads the file; a relative one is taken from the directory of the configuration.
    pub(super) fn read(&mut self, base: &Path) -> Result<(), Fault> {
        let file = base.join(&self.osm_file);
        let fault = |why: String, cure: &str| {
            Fault::new("osm_file", format!("{}: {why}", file.display()), cure.to_owned())
        };
        let readable = "give the name of a readable file";
        let length = std::fs::metadata(&file).map_err(|why| fault(why.to_string(), readable))?.len();
        if length > FILE_BYTES_MAX {
            return Err(fault(
                "the file is longer than 1 GiB".into(),
                "cut the region of interest out of it",
            ));
        }
        let bytes = std::fs::read(&file).map_err(|why| fault(why.to_string(), readable))?;
        let one_way = if self.ignore_one_way { OneWay::Ignore } else { OneWay::Respect };
        let roads = OsmConfig::new(Bytes::from(bytes), one_way);
        let cure = "give a file in OpenStreetMap's XML with ways that have a tag `highway`";
        self.roads = Some(roads.map_err(|why| fault(why.to_string(), cure))?);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn planner(file: &str) -> OsmPlanner {
        let service = ServiceId::new(100).unwrap();
        OsmPlanner { service, osm_file: file.into(), ignore_one_way: false, roads: None }
    }

    #[test]
    fn a_file_is_read_from_beside_the_configuration_and_a_wrong_one_is_told() {
        let base = Path::new(env!("CARGO_MANIFEST_DIR")).join("../services/src/uxas/osm");
        let mut town = planner("town.osm");
        town.read(&base).unwrap();
        assert!(town.roads.is_some());
        assert!(planner("no.osm").read(&base).is_err());
        // What is no road file at all.
        assert!(planner("tests.rs").read(&base).is_err());
    }
}
