//! The topics of Support Operations in version 5.2.1: members in the order of the wire (umaa-so, Version 5.2.1).

use super::structure::Described;
use super::topics::{TopicInfo, topics};
use crate::description::{DescriptionError, Draft, Library, Topic};

mod health_report;
mod log_report;
mod resource_allocation;

pub use health_report::HealthReport;
pub use log_report::LogReport;
pub use resource_allocation::{
    ResourceAllocationCommand, ResourceAllocationCommandAckReport, ResourceAllocationCommandStatus,
    ResourceAllocationConfigReport, ResourceAllocationControlInfo, ResourceAllocationControlSession,
    ResourceAllocationDefinition, ResourceAllocationPriorityCommand,
    ResourceAllocationPriorityCommandAckReport, ResourceAllocationPriorityCommandStatus,
    ResourceAllocationPriorityInfo, ResourceAllocationPriorityReport, ResourceAllocationReport,
};

/// All topics with the names of their types.
pub fn described_topics() -> Vec<Topic> {
    let topic = |info: &TopicInfo| Topic { name: info.name.to_owned(), type_name: info.type_name.to_owned() };
    topics().map(topic).collect()
}

/// Everything that the topics are made of.
///
/// # Errors
/// [`DescriptionError`], which a test rules out.
pub fn library() -> Result<Library, Vec<DescriptionError>> {
    let mut draft = Draft::default();
    let all = [
        HealthReport::described,
        LogReport::described,
        ResourceAllocationCommandStatus::described,
        ResourceAllocationCommandAckReport::described,
        ResourceAllocationReport::described,
        ResourceAllocationConfigReport::described,
        ResourceAllocationPriorityCommandStatus::described,
        ResourceAllocationPriorityCommandAckReport::described,
        ResourceAllocationPriorityReport::described,
    ];
    for described in all {
        described(&mut draft).map_err(|error| vec![error])?;
    }
    draft.finish()
}

/// Makes a struct with `time_stamp` and `source` a report whose key is its source (`UMAAStatus`, table 24).
macro_rules! report {
    ($report:ty, $name:literal) => {
        impl $crate::umaa::Topic for $report {
            const NAME: &'static str = $name;
            const TYPE_NAME: &'static str = concat!($name, "Type");
            type Key = $crate::umaa::SourceKey;

            fn key(&self) -> $crate::umaa::SourceKey {
                $crate::umaa::SourceKey { source: self.source }
            }
        }

        $crate::umaa::v5_2_1::sourced!($report);
    };
}

macro_rules! sourced {
    ($message:ty) => {
        impl $crate::umaa::Sourced for $message {
            fn time_stamp(&self) -> $crate::DateTime {
                self.time_stamp
            }

            fn source(&self) -> $crate::Guid {
                self.source
            }
        }
    };
}

use {report, sourced};
