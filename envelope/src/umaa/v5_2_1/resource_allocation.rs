//! `UMAA::SO::ResourceAllocation` (ICD 5.1.3, tables 13 to 21 and 29 to 32).

use super::report;
use crate::guid::Guid;
use crate::time::DateTime;
use crate::umaa::structure::structure;
use crate::umaa::{CommandAckReport, CommandStatus, DurationSeconds, NoExecutionStatus, Sequence};
use crate::umaa_command;

structure! {
    /// Asks for control of a resource (table 20). The consumer that asks is its source.
    #[derive(Eq)]
    ResourceAllocationCommand = "UMAA::SO::ResourceAllocation::ResourceAllocationCommandType" {
        /// How long control is wanted; without end where none is given.
        duration: Option<DurationSeconds> = "duration",
        /// The resource.
        resource_id: Guid = "resourceID",
        /// When the command was made.
        time_stamp: DateTime = "timeStamp",
        /// The consumer (key).
        source: Guid = "source" [key],
        /// The session (key).
        session_id: Guid = "sessionID" [key],
        /// The provider of ResourceAllocation (key).
        destination: Guid = "destination" [key],
    }
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

structure! {
    /// Sets who may control a resource, and who goes before whom (table 21).
    #[derive(Eq)]
    ResourceAllocationPriorityCommand = "UMAA::SO::ResourceAllocation::ResourceAllocationPriorityCommandType" {
        /// The consumers, from low to high priority.
        priorities: Sequence<Guid, 100> = "priorities",
        /// The resource.
        resource_id: Guid = "resourceID",
        /// When the command was made.
        time_stamp: DateTime = "timeStamp",
        /// The consumer of this command (key).
        source: Guid = "source" [key],
        /// The session (key).
        session_id: Guid = "sessionID" [key],
        /// The provider of ResourceAllocation (key).
        destination: Guid = "destination" [key],
    }
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

structure! {
    /// Who controls a resource until when (table 30).
    #[derive(Copy, Eq)]
    ResourceAllocationControlSession = "UMAA::SO::ResourceAllocation::ResourceAllocationControlSession" {
        /// The consumer in control.
        controlling_consumer: Guid = "controllingConsumer",
        /// When its control ends, in the arbiter's clock; without end where none is given.
        end_time: Option<DateTime> = "endTime",
    }
}

structure! {
    /// Who controls a resource (table 29).
    #[derive(Copy, Eq)]
    ResourceAllocationControlInfo = "UMAA::SO::ResourceAllocation::ResourceAllocationControlInfo" {
        /// Who controls it; none where nobody does.
        control_session: Option<ResourceAllocationControlSession> = "controlSession",
        /// The resource (key in the list).
        resource_id: Guid = "resourceID" [key],
    }
}

structure! {
    /// Who controls what (table 13).
    #[derive(Eq)]
    ResourceAllocationReport = "UMAA::SO::ResourceAllocation::ResourceAllocationReportType" {
        /// Every resource that the source allocates.
        control_info: Sequence<ResourceAllocationControlInfo, 256> = "controlInfo",
        /// When the report was made.
        time_stamp: DateTime = "timeStamp",
        /// The provider of ResourceAllocation (key).
        source: Guid = "source" [key],
    }
}

report!(ResourceAllocationReport, "UMAA::SO::ResourceAllocation::ResourceAllocationReport");

structure! {
    /// Which providers share one resource (`ResourceAllocationDefinitionType`, table 31).
    #[derive(Eq)]
    ResourceAllocationDefinition = "UMAA::SO::ResourceAllocation::ResourceAllocationDefinitionType" {
        /// The providers: no two of them may be commanded by different consumers at a time.
        related_sources: Sequence<Guid, 100> = "relatedSources",
        /// The resource (key in the list).
        resource_id: Guid = "resourceID" [key],
    }
}

structure! {
    /// Which providers share which resource (table 16).
    #[derive(Eq)]
    ResourceAllocationConfigReport = "UMAA::SO::ResourceAllocation::ResourceAllocationConfigReportType" {
        /// Every resource that the source allocates.
        resources: Sequence<ResourceAllocationDefinition, 256> = "resources",
        /// When the report was made.
        time_stamp: DateTime = "timeStamp",
        /// The provider of ResourceAllocation (key).
        source: Guid = "source" [key],
    }
}

report!(ResourceAllocationConfigReport, "UMAA::SO::ResourceAllocation::ResourceAllocationConfigReport");

structure! {
    /// Who may control a resource, and who goes before whom (table 32).
    #[derive(Eq)]
    ResourceAllocationPriorityInfo = "UMAA::SO::ResourceAllocation::ResourceAllocationPriorityInfo" {
        /// The consumers, from low to high priority.
        priorities: Sequence<Guid, 100> = "priorities",
        /// The resource (key in the list).
        resource_id: Guid = "resourceID" [key],
    }
}

structure! {
    /// The priorities of every resource (table 17). The ICD's table has lost the bound; the IDL says 32 (umaa-so).
    #[derive(Eq)]
    ResourceAllocationPriorityReport = "UMAA::SO::ResourceAllocation::ResourceAllocationPriorityReportType" {
        /// Every resource that the source allocates.
        priorities: Sequence<ResourceAllocationPriorityInfo, 32> = "priorities",
        /// When the report was made.
        time_stamp: DateTime = "timeStamp",
        /// The provider of ResourceAllocation (key).
        source: Guid = "source" [key],
    }
}

report!(ResourceAllocationPriorityReport, "UMAA::SO::ResourceAllocation::ResourceAllocationPriorityReport");
