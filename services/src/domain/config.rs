//! What a bridge to a domain is configured to do.

use crate::map::dds::{QualityRule, Rules};
use aldis_envelope::description::Library;
use aldis_envelope::{Fleet, Source};
use std::collections::BTreeSet;
use std::sync::Arc;

/// What a bridge to a domain is configured to do.
#[derive(Debug, Clone)]
pub struct DomainConfig {
    /// The fleet: two gateways on one bus know each other by it and by their entities.
    pub fleet: Fleet,
    /// The bridge's own ids.
    pub source: Source,
    /// The partition; empty is the default one.
    pub partition: String,
    /// Which topics cross.
    pub topics: Rules,
    /// What is said of the quality of service of topics; the first that matches counts.
    pub rules: Vec<QualityRule>,
    /// The types that are described.
    pub types: Arc<Library>,
    /// The names of types of Support Operations that are described as the specification has them, so that their samples are messages
    /// of this project, member for member, or can be translated into such.
    pub exact: Arc<BTreeSet<String>>,
    /// Whether the bus speaks version 6.0, which is translated into 5.2.1 and back.
    pub translates: bool,
    /// How many changes may wait for slow readers; over half of it the node stops reading.
    pub queue_max: usize,
}
