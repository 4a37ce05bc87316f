//! `UMAA::Common::MaritimeEnumeration` (ICD 5.3, tables 33 to 37). Ordinals are alphabetical, from 0 (umaa-so, Type rules).

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// The text is no value of an enumeration.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{found}` is no {enumeration}: {known}")]
pub struct EnumerationError {
    found: String,
    enumeration: &'static str,
    known: String,
}

/// Declares an enumeration: its values in alphabetical order, each with its name in the IDL.
macro_rules! enumeration {
    ($(#[$about:meta])* $name:ident, $idl:literal { $($(#[$value_about:meta])* $value:ident = $text:literal,)+ }) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        pub enum $name { $($(#[$value_about])* #[serde(rename = $text)] $value,)+ }

        impl $name {
            /// All values by their ordinals.
            pub const ALL: &'static [Self] = &[$(Self::$value),+];

            /// The ordinal on the wire.
            pub const fn ordinal(self) -> u32 {
                self as u32
            }

            /// The value's name in the IDL.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$value => $text),+ }
            }
        }

        impl crate::umaa::structure::Described for $name {
            fn described(
                draft: &mut crate::description::Draft,
            ) -> Result<crate::description::Type, crate::description::DescriptionError> {
                let names = Self::ALL.iter().map(|value| value.name());
                let literals = crate::description::Enumeration::counted(names);
                let name = concat!("UMAA::Common::MaritimeEnumeration::", $idl);
                crate::umaa::structure::define(draft, name, crate::description::Definition::Enumeration(literals))
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.pad(self.name())
            }
        }

        /// Reads the name in the IDL, in any case.
        impl FromStr for $name {
            type Err = EnumerationError;
            fn from_str(text: &str) -> Result<Self, EnumerationError> {
                let value = Self::ALL.iter().find(|value| value.name().eq_ignore_ascii_case(text));
                value.copied().ok_or_else(|| EnumerationError {
                    found: crate::name::shortened(text),
                    enumeration: $idl,
                    known: Self::ALL.iter().map(|value| value.name()).collect::<Vec<_>>().join(", "),
                })
            }
        }
    };
}

enumeration! {
    /// Why the status of a command changed (table 33).
    CommandStatusReason, "CommandStatusReasonEnumType" {
        /// To CANCELED: cancelled as asked for.
        Canceled = "CANCELED",
        /// To FAILED: something of higher priority took over.
        Interrupted = "INTERRUPTED",
        /// To FAILED: the objective cannot be reached for reasons outside.
        ObjectiveFailed = "OBJECTIVE_FAILED",
        /// To FAILED: the resource or the platform failed.
        ResourceFailed = "RESOURCE_FAILED",
        /// To FAILED: the resource refuses the command.
        ResourceRejected = "RESOURCE_REJECTED",
        /// To FAILED: the service itself failed.
        ServiceFailed = "SERVICE_FAILED",
        /// The normal way on.
        Succeeded = "SUCCEEDED",
        /// To FAILED: no acknowledgement within its bound.
        Timeout = "TIMEOUT",
        /// Back to ISSUED: the command has been updated.
        Updated = "UPDATED",
        /// To FAILED: parameters are missing, outside their range or otherwise wrong.
        ValidationFailed = "VALIDATION_FAILED",
    }
}

enumeration! {
    /// The kind of system that an error concerns (table 34).
    #[allow(missing_docs, reason = "the values' names say it all")]
    ErrorCode, "ErrorCodeEnumType" {
        Actuator = "ACTUATOR",
        Filesys = "FILESYS",
        None = "NONE",
        Power = "POWER",
        Processor = "PROCESSOR",
        Ram = "RAM",
        Rom = "ROM",
        Sensor = "SENSOR",
        Software = "SOFTWARE",
    }
}

enumeration! {
    /// How bad an error is (table 35). The order is the wire's, not that of badness.
    ErrorCondition, "ErrorConditionEnumType" {
        /// The use of the part is seriously impaired.
        Error = "ERROR",
        /// The part does not work.
        Fail = "FAIL",
        /// It hardly matters.
        Info = "INFO",
        /// All is well.
        None = "NONE",
        /// The part's performance suffers much.
        Warn = "WARN",
    }
}

enumeration! {
    /// The level of an entry (table 36).
    LogLevel, "LogLevelEnumType" {
        /// Something failed.
        Error = "ERROR",
        /// Worth knowing.
        Information = "INFORMATION",
        /// Worth a look.
        Warning = "WARNING",
    }
}

enumeration! {
    /// How far a command has come (`CommandStatusEnumType`, table 37). The order is the wire's, not that of progress.
    CommandState, "CommandStatusEnumType" {
        /// Cancelled by its consumer before it was done.
        Canceled = "CANCELED",
        /// Accepted by the provider, not yet by the resource.
        Commanded = "COMMANDED",
        /// Done.
        Completed = "COMPLETED",
        /// Under way.
        Executing = "EXECUTING",
        /// Tried, without success.
        Failed = "FAILED",
        /// Received, not yet looked at.
        Issued = "ISSUED",
    }
}

impl CommandState {
    /// Whether a command in this state is over (ICD 4.1.4.2, item 2).
    pub const fn is_terminal(self) -> bool {
        matches!(self, Self::Completed | Self::Failed | Self::Canceled)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check<T: Copy + fmt::Debug + PartialEq + Serialize + FromStr<Err = EnumerationError>>(
        all: &[T],
        name: fn(T) -> &'static str,
        names: &str,
    ) {
        let found: Vec<_> = all.iter().map(|value| name(*value)).collect();
        assert_eq!(found.join(" "), names);
        assert!(found.is_sorted(), "{names}");
        for (ordinal, value) in all.iter().enumerate() {
            assert_eq!(postcard::to_allocvec(value).unwrap(), [ordinal as u8]);
            assert_eq!(serde_json::to_string(value).unwrap(), format!("\"{}\"", name(*value)));
            assert_eq!(name(*value).to_lowercase().parse::<T>().as_ref(), Ok(value));
        }
    }

    #[test]
    fn ordinals_are_alphabetical() {
        let states = "CANCELED COMMANDED COMPLETED EXECUTING FAILED ISSUED";
        check(CommandState::ALL, CommandState::name, states);
        let reasons = "CANCELED INTERRUPTED OBJECTIVE_FAILED RESOURCE_FAILED RESOURCE_REJECTED SERVICE_FAILED \
                       SUCCEEDED TIMEOUT UPDATED VALIDATION_FAILED";
        check(CommandStatusReason::ALL, CommandStatusReason::name, reasons);
        let codes = "ACTUATOR FILESYS NONE POWER PROCESSOR RAM ROM SENSOR SOFTWARE";
        check(ErrorCode::ALL, ErrorCode::name, codes);
        check(ErrorCondition::ALL, ErrorCondition::name, "ERROR FAIL INFO NONE WARN");
        check(LogLevel::ALL, LogLevel::name, "ERROR INFORMATION WARNING");
        assert_eq!(CommandState::Issued.ordinal(), 5);
    }

    #[test]
    fn a_wrong_value_is_told_with_the_right_ones() {
        let why = "BAD".parse::<ErrorCondition>().unwrap_err().to_string();
        assert_eq!(why, "`BAD` is no ErrorConditionEnumType: ERROR, FAIL, INFO, NONE, WARN");
        assert!(postcard::from_bytes::<LogLevel>(&[3]).is_err());
        assert!(serde_json::from_str::<LogLevel>("\"Warning\"").is_err());
    }
}
