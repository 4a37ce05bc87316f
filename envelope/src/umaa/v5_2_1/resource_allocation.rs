//! `UMAA::SO::ResourceAllocation` (ICD 5.1.3, tables 13 to 21 and 29 to 32).

use super::report;
use crate::guid::Guid;
use crate::time::DateTime;
use crate::umaa::{CommandAckReport, CommandStatus, DurationSeconds, NoExecutionStatus, Sequence};
use crate::umaa_command;
use serde::{Deserialize, Serialize};

/// Asks for control of a resource (table 20). The consumer that asks is its source.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct ResourceAllocationCommand {
    /// How long control is wanted; without end where none is given.
    pub duration: Option<DurationSeconds>,
    /// The resource.
    #[serde(rename = "resourceID")]
    pub resource_id: Guid,
    /// When the command was made.
    pub time_stamp: DateTime,
    /// The consumer (key).
    pub source: Guid,
    /// The session (key).
    #[serde(rename = "sessionID")]
    pub session_id: Guid,
    /// The provider of ResourceAllocation (key).
    pub destination: Guid,
}

umaa_command!(
    ResourceAllocationCommand,
    "UMAA::SO::ResourceAllocation::ResourceAllocationCommand",
    NoExecutionStatus
);

/// How far a [`ResourceAllocationCommand`] has come (table 15).
pub type ResourceAllocationCommandStatus = CommandStatus<ResourceAllocationCommand>;
/// The [`ResourceAllocationCommand`] that is executed (table 14).
pub type ResourceAllocationCommandAckReport = CommandAckReport<ResourceAllocationCommand>;

/// Sets who may control a resource, and who goes before whom (table 21).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct ResourceAllocationPriorityCommand {
    /// The consumers, from low to high priority.
    pub priorities: Sequence<Guid, 100>,
    /// The resource.
    #[serde(rename = "resourceID")]
    pub resource_id: Guid,
    /// When the command was made.
    pub time_stamp: DateTime,
    /// The consumer of this command (key).
    pub source: Guid,
    /// The session (key).
    #[serde(rename = "sessionID")]
    pub session_id: Guid,
    /// The provider of ResourceAllocation (key).
    pub destination: Guid,
}

umaa_command!(
    ResourceAllocationPriorityCommand,
    "UMAA::SO::ResourceAllocation::ResourceAllocationPriorityCommand",
    NoExecutionStatus
);

/// How far a [`ResourceAllocationPriorityCommand`] has come (table 19).
pub type ResourceAllocationPriorityCommandStatus = CommandStatus<ResourceAllocationPriorityCommand>;
/// The [`ResourceAllocationPriorityCommand`] that is executed (table 18).
pub type ResourceAllocationPriorityCommandAckReport = CommandAckReport<ResourceAllocationPriorityCommand>;

/// Who controls a resource until when (table 30).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct ResourceAllocationControlSession {
    /// The consumer in control.
    pub controlling_consumer: Guid,
    /// When its control ends, in the arbiter's clock; without end where none is given.
    pub end_time: Option<DateTime>,
}

/// Who controls a resource (table 29).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct ResourceAllocationControlInfo {
    /// Who controls it; none where nobody does.
    pub control_session: Option<ResourceAllocationControlSession>,
    /// The resource (key in the list).
    #[serde(rename = "resourceID")]
    pub resource_id: Guid,
}

/// Who controls what (table 13).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct ResourceAllocationReport {
    /// Every resource that the source allocates.
    pub control_info: Sequence<ResourceAllocationControlInfo, 256>,
    /// When the report was made.
    pub time_stamp: DateTime,
    /// The provider of ResourceAllocation (key).
    pub source: Guid,
}

report!(ResourceAllocationReport, "UMAA::SO::ResourceAllocation::ResourceAllocationReport");

/// Which providers share one resource (`ResourceAllocationDefinitionType`, table 31).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct ResourceAllocationDefinition {
    /// The providers: no two of them may be commanded by different consumers at a time.
    pub related_sources: Sequence<Guid, 100>,
    /// The resource (key in the list).
    #[serde(rename = "resourceID")]
    pub resource_id: Guid,
}

/// Which providers share which resource (table 16).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct ResourceAllocationConfigReport {
    /// Every resource that the source allocates.
    pub resources: Sequence<ResourceAllocationDefinition, 256>,
    /// When the report was made.
    pub time_stamp: DateTime,
    /// The provider of ResourceAllocation (key).
    pub source: Guid,
}

report!(ResourceAllocationConfigReport, "UMAA::SO::ResourceAllocation::ResourceAllocationConfigReport");

/// Who may control a resource, and who goes before whom (table 32).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct ResourceAllocationPriorityInfo {
    /// The consumers, from low to high priority.
    pub priorities: Sequence<Guid, 100>,
    /// The resource (key in the list).
    #[serde(rename = "resourceID")]
    pub resource_id: Guid,
}

/// The priorities of every resource (table 17). The ICD's table has lost the bound; the IDL says 32 (umaa-so).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct ResourceAllocationPriorityReport {
    /// Every resource that the source allocates.
    pub priorities: Sequence<ResourceAllocationPriorityInfo, 32>,
    /// When the report was made.
    pub time_stamp: DateTime,
    /// The provider of ResourceAllocation (key).
    pub source: Guid,
}

report!(ResourceAllocationPriorityReport, "UMAA::SO::ResourceAllocation::ResourceAllocationPriorityReport");
