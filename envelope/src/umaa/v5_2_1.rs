//! The topics of Support Operations in version 5.2.1: members in the order of the wire (umaa-so, Version 5.2.1).

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
