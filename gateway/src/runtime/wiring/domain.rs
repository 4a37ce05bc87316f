//! Bridges to DDS domains: the service that has the meaning, and what the shell opens for it.

use crate::config::{Bridge, Config, Dds, DdsVersion};
use aldis_envelope::Source;
use aldis_services::domain::{Domain, DomainConfig};
use aldis_services::{Service, ServiceSpec};
use std::sync::Arc;

fn domains(config: &Config) -> impl Iterator<Item = &Dds> {
    config.bridges.iter().filter_map(|bridge| if let Bridge::Dds(dds) = bridge { Some(dds) } else { None })
}

fn source(config: &Config, dds: &Dds) -> Source {
    Source::new(config.entities.own(), dds.common.service)
}

fn domain_config(config: &Config, dds: &Dds) -> DomainConfig {
    DomainConfig {
        fleet: config.fleet.clone(),
        source: source(config, dds),
        partition: dds.table.partition.clone(),
        topics: dds.topics.clone(),
        rules: dds.rules.clone(),
        types: dds.types.clone(),
        exact: dds.exact.clone(),
        translates: dds.table.version == DdsVersion::V6_0 && dds.table.translate,
        queue_max: dds.common.queue_messages_max as usize,
    }
}

/// The services that bridge domains.
pub(super) fn services(config: &Config) -> Vec<ServiceSpec> {
    let spec = |dds: &Dds| {
        let domain = domain_config(config, dds);
        ServiceSpec {
            source: source(config, dds),
            name: dds.common.name.as_str().to_owned(),
            factory: Arc::new(move || -> Box<dyn Service> { Box::new(Domain::new(domain.clone())) }),
        }
    };
    domains(config).map(spec).collect()
}

/// What the shell opens for them.
#[cfg(feature = "dds")]
pub(super) fn endpoints(config: &Config) -> Result<Vec<crate::bridge::dds::Endpoint>, super::OutsideError> {
    let endpoint = |dds: &Dds| {
        let read = |path: &std::path::PathBuf| {
            std::fs::read_to_string(path)
                .map_err(|why| super::OutsideError::CycloneDds { path: path.clone(), why })
        };
        Ok(crate::bridge::dds::Endpoint {
            source: source(config, dds),
            participant: aldis_dds::ParticipantConfig {
                domain: dds.table.domain,
                xml: dds.table.cyclonedds.as_ref().map(read).transpose()?,
                user_data: aldis_services::domain::mark(&domain_config(config, dds)).into_bytes(),
            },
            types: dds.types.clone(),
            stall_timeout: dds.common.stall_timeout(),
        })
    };
    domains(config).map(endpoint).collect()
}
