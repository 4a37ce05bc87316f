//! Quality of service, as values.

use crate::error::{DdsError, text};
use cyclors::{
    DDS_DATA_REPRESENTATION_XCDR1, DDS_DATA_REPRESENTATION_XCDR2,
    dds_destination_order_kind_DDS_DESTINATIONORDER_BY_RECEPTION_TIMESTAMP as BY_RECEPTION,
    dds_destination_order_kind_DDS_DESTINATIONORDER_BY_SOURCE_TIMESTAMP as BY_SOURCE,
    dds_durability_kind_DDS_DURABILITY_PERSISTENT as PERSISTENT,
    dds_durability_kind_DDS_DURABILITY_TRANSIENT as TRANSIENT,
    dds_durability_kind_DDS_DURABILITY_TRANSIENT_LOCAL as TRANSIENT_LOCAL,
    dds_durability_kind_DDS_DURABILITY_VOLATILE as VOLATILE,
    dds_history_kind_DDS_HISTORY_KEEP_ALL as KEEP_ALL, dds_history_kind_DDS_HISTORY_KEEP_LAST as KEEP_LAST,
    dds_ownership_kind_DDS_OWNERSHIP_EXCLUSIVE as EXCLUSIVE,
    dds_ownership_kind_DDS_OWNERSHIP_SHARED as SHARED,
    dds_presentation_access_scope_kind_DDS_PRESENTATION_GROUP as GROUP,
    dds_presentation_access_scope_kind_DDS_PRESENTATION_INSTANCE as INSTANCE,
    dds_presentation_access_scope_kind_DDS_PRESENTATION_TOPIC as TOPIC,
    dds_reliability_kind_DDS_RELIABILITY_BEST_EFFORT as BEST_EFFORT,
    dds_reliability_kind_DDS_RELIABILITY_RELIABLE as RELIABLE, *,
};
use std::fmt;
use std::time::Duration;

/// For how long samples are kept for readers that come later.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
#[allow(missing_docs, reason = "DDS 1.4, 2.2.3.4")]
pub enum Durability {
    #[default]
    Volatile,
    TransientLocal,
    Transient,
    Persistent,
}

/// How many samples of an instance are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum History {
    /// The newest so many.
    KeepLast(u32),
    /// All, within the resource limits.
    KeepAll,
}

/// Resource limits; none is without.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Limits {
    /// Samples in all.
    pub samples: Option<u32>,
    /// Instances.
    pub instances: Option<u32>,
    /// Samples of one instance.
    pub samples_per_instance: Option<u32>,
}

/// Over what order and coherence reach.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
#[allow(missing_docs, reason = "DDS 1.4, 2.2.3.6")]
pub enum Access {
    #[default]
    Instance,
    Topic,
    Group,
}

/// PRESENTATION.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Presentation {
    /// Its access scope.
    pub access: Access,
    /// Whether sets of changes are to be seen together.
    pub coherent: bool,
    /// Whether order is kept over the access scope.
    pub ordered: bool,
}

/// LIVELINESS: who says that a writer lives. The numbers are those of Cyclone DDS.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs, reason = "DDS 1.4, 2.2.3.11")]
#[repr(u32)]
pub enum Liveliness {
    Automatic = dds_liveliness_kind_DDS_LIVELINESS_AUTOMATIC,
    ManualByParticipant = dds_liveliness_kind_DDS_LIVELINESS_MANUAL_BY_PARTICIPANT,
    ManualByTopic = dds_liveliness_kind_DDS_LIVELINESS_MANUAL_BY_TOPIC,
}

/// How samples are written in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs, reason = "DDS-XTypes 1.3, 7.6.3.1")]
pub enum Representation {
    Xcdr1,
    Xcdr2,
}

/// The quality of service of a reader or a writer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Qos {
    /// RELIABLE, or BEST_EFFORT.
    pub reliable: bool,
    /// DURABILITY.
    pub durability: Durability,
    /// HISTORY.
    pub history: History,
    /// RESOURCE_LIMITS.
    pub limits: Limits,
    /// How many samples of an instance a writer keeps for readers that come later, and within what.
    pub durability_service: (History, Limits),
    /// EXCLUSIVE ownership with this strength; none is SHARED.
    pub exclusive: Option<i32>,
    /// DEADLINE.
    pub deadline: Option<Duration>,
    /// LATENCY_BUDGET.
    pub latency_budget: Duration,
    /// LIVELINESS: who says that a writer lives, and how often at least; none is never.
    pub liveliness: (Liveliness, Option<Duration>),
    /// PARTITION.
    pub partitions: Vec<String>,
    /// PRESENTATION.
    pub presentation: Presentation,
    /// DESTINATION_ORDER by source timestamps, or by reception.
    pub by_source_timestamp: bool,
    /// Whether instances that a writer unregisters, or leaves behind, are disposed of.
    pub autodispose: bool,
    /// DATA_REPRESENTATION; empty is what the type allows.
    pub representations: Vec<Representation>,
    /// Whether a writer holds small changes back to send them together: [`crate::Writer::flush`] sends them.
    pub batching: bool,
    /// Whether endpoints of the whole process are not heard, or those of the same participant alone.
    pub ignores_process: bool,
}

impl Default for Qos {
    /// What DDS says of a reader of which nothing is said.
    fn default() -> Self {
        Self {
            reliable: false,
            durability: Durability::Volatile,
            history: History::KeepLast(1),
            limits: Limits::default(),
            durability_service: (History::KeepLast(1), Limits::default()),
            exclusive: None,
            deadline: None,
            latency_budget: Duration::ZERO,
            liveliness: (Liveliness::Automatic, None),
            partitions: Vec::new(),
            presentation: Presentation::default(),
            by_source_timestamp: false,
            autodispose: true,
            representations: Vec::new(),
            batching: false,
            ignores_process: false,
        }
    }
}

/// A policy of which both sides must agree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Policy(pub u32);

impl fmt::Display for Policy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.0 {
            dds_qos_policy_id_DDS_DURABILITY_QOS_POLICY_ID => "DURABILITY",
            dds_qos_policy_id_DDS_PRESENTATION_QOS_POLICY_ID => "PRESENTATION",
            dds_qos_policy_id_DDS_DEADLINE_QOS_POLICY_ID => "DEADLINE",
            dds_qos_policy_id_DDS_LATENCYBUDGET_QOS_POLICY_ID => "LATENCY_BUDGET",
            dds_qos_policy_id_DDS_OWNERSHIP_QOS_POLICY_ID => "OWNERSHIP",
            dds_qos_policy_id_DDS_LIVELINESS_QOS_POLICY_ID => "LIVELINESS",
            dds_qos_policy_id_DDS_PARTITION_QOS_POLICY_ID => "PARTITION",
            dds_qos_policy_id_DDS_RELIABILITY_QOS_POLICY_ID => "RELIABILITY",
            dds_qos_policy_id_DDS_DESTINATIONORDER_QOS_POLICY_ID => "DESTINATION_ORDER",
            dds_qos_policy_id_DDS_TYPE_CONSISTENCY_ENFORCEMENT_QOS_POLICY_ID => {
                "TYPE_CONSISTENCY_ENFORCEMENT"
            }
            dds_qos_policy_id_DDS_DATA_REPRESENTATION_QOS_POLICY_ID => "DATA_REPRESENTATION",
            other => return write!(f, "policy {other}"),
        })
    }
}

/// A quality of service in Cyclone's own form.
pub(crate) struct Native(pub(crate) *mut dds_qos_t);

impl Drop for Native {
    fn drop(&mut self) {
        // SAFETY: the pointer came from `dds_create_qos` and is deleted once, here.
        unsafe { dds_delete_qos(self.0) };
    }
}

/// A bound that C writes as -1 where there is none.
fn length(bound: Option<u32>) -> i32 {
    bound.map_or(-1, |bound| i32::try_from(bound).unwrap_or(i32::MAX))
}

fn history(history: History) -> (dds_history_kind_t, i32) {
    match history {
        History::KeepLast(depth) => (KEEP_LAST, length(Some(depth.max(1)))),
        History::KeepAll => (KEEP_ALL, -1),
    }
}

pub(crate) fn nanoseconds(duration: Duration) -> i64 {
    i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX)
}

impl Qos {
    /// The same in Cyclone's form, for a writer that never blocks.
    pub(crate) fn native(&self) -> Result<Native, DdsError> {
        let partitions = self.partitions.iter().map(|name| text("dds_qset_partition", name));
        let partitions = partitions.collect::<Result<Vec<_>, _>>()?;
        let mut partitions: Vec<_> = partitions.iter().map(|name| name.as_ptr()).collect();
        let representations: Vec<i16> = self.representations.iter().map(|r| id_of(*r)).collect();
        let (kind, depth) = history(self.history);
        let (kept, (kept_kind, kept_depth)) = (self.durability_service.1, history(self.durability_service.0));
        // SAFETY: `qos` is fresh and lives until `Native` deletes it. Every setter copies what it is given; the arrays of partitions
        // and of representations outlive the calls and have the lengths that are said.
        unsafe {
            let qos = dds_create_qos();
            dds_qset_reliability(qos, if self.reliable { RELIABLE } else { BEST_EFFORT }, 0);
            dds_qset_durability(qos, durability(self.durability));
            dds_qset_history(qos, kind, depth);
            let Limits { samples, instances, samples_per_instance } = self.limits;
            dds_qset_resource_limits(qos, length(samples), length(instances), length(samples_per_instance));
            let (samples, instances) = (length(kept.samples), length(kept.instances));
            let per_instance = length(kept.samples_per_instance);
            dds_qset_durability_service(qos, 0, kept_kind, kept_depth, samples, instances, per_instance);
            dds_qset_ownership(qos, if self.exclusive.is_some() { EXCLUSIVE } else { SHARED });
            if let Some(strength) = self.exclusive {
                dds_qset_ownership_strength(qos, strength);
            }
            if let Some(deadline) = self.deadline {
                dds_qset_deadline(qos, nanoseconds(deadline));
            }
            dds_qset_latency_budget(qos, nanoseconds(self.latency_budget));
            let (kind, lease) = self.liveliness;
            dds_qset_liveliness(qos, kind as u32, lease.map_or(i64::MAX, nanoseconds));
            if !partitions.is_empty() {
                dds_qset_partition(qos, partitions.len() as u32, partitions.as_mut_ptr());
            }
            let Presentation { access, coherent, ordered } = self.presentation;
            dds_qset_presentation(qos, scope(access), coherent, ordered);
            let by = if self.by_source_timestamp { BY_SOURCE } else { BY_RECEPTION };
            dds_qset_destination_order(qos, by);
            dds_qset_writer_data_lifecycle(qos, self.autodispose);
            if !representations.is_empty() {
                dds_qset_data_representation(qos, representations.len() as u32, representations.as_ptr());
            }
            dds_qset_writer_batching(qos, self.batching);
            let process = dds_ignorelocal_kind_DDS_IGNORELOCAL_PROCESS;
            let participant = dds_ignorelocal_kind_DDS_IGNORELOCAL_PARTICIPANT;
            dds_qset_ignorelocal(qos, if self.ignores_process { process } else { participant });
            Ok(Native(qos))
        }
    }
}

fn id_of(representation: Representation) -> i16 {
    match representation {
        Representation::Xcdr1 => DDS_DATA_REPRESENTATION_XCDR1 as i16,
        Representation::Xcdr2 => DDS_DATA_REPRESENTATION_XCDR2 as i16,
    }
}

fn durability(durability: Durability) -> dds_durability_kind_t {
    match durability {
        Durability::Volatile => VOLATILE,
        Durability::TransientLocal => TRANSIENT_LOCAL,
        Durability::Transient => TRANSIENT,
        Durability::Persistent => PERSISTENT,
    }
}

fn scope(access: Access) -> dds_presentation_access_scope_kind_t {
    match access {
        Access::Instance => INSTANCE,
        Access::Topic => TOPIC,
        Access::Group => GROUP,
    }
}
