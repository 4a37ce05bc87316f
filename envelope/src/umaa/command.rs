//! Commands and what providers say of them (ICD 4.1, tables 23, 25 and 26). A command type brings its whole family along:
//! its status, its acknowledgement and, where it has one, its execution status.

use super::{CommandKey, CommandState, CommandStatusReason, LongDescription, SessionKey, Sourced, Topic};
use crate::guid::Guid;
use crate::time::DateTime;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::marker::PhantomData;

/// The members that every command has (`UMAACommand`, table 23).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CommandHeader {
    /// When the command was made. A newer one of the same source and session is an update (4.1.4.2).
    pub time_stamp: DateTime,
    /// The consumer.
    pub source: Guid,
    /// The session, unique among all commands of its kind on the bus.
    pub session_id: Guid,
    /// The provider.
    pub destination: Guid,
}

/// A command, and the names of its family. [`umaa_command!`](crate::umaa_command) implements it.
pub trait Command: Topic<Key = CommandKey> {
    /// What its provider says while it is executed; [`NoExecutionStatus`] where nothing is defined.
    type ExecutionStatus: ExecutionStatus;
    /// The name of the topic with its statuses.
    const STATUS_NAME: &'static str;
    /// The name of the statuses' type.
    const STATUS_TYPE_NAME: &'static str;
    /// The name of the topic with its acknowledgements.
    const ACK_REPORT_NAME: &'static str;
    /// The name of the acknowledgements' type.
    const ACK_REPORT_TYPE_NAME: &'static str;

    /// The members that every command has.
    fn header(&self) -> CommandHeader;

    /// Sets the members that every command has.
    fn set_header(&mut self, header: CommandHeader);
}

/// What a provider says of a command while it is executed (4.1.4.1, item 4).
pub trait ExecutionStatus: Topic<Key = SessionKey> {
    /// Whether the command has an execution status at all.
    const DEFINED: bool = true;
}

/// The execution status of a command for which none is defined. No such sample can be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum NoExecutionStatus {}

impl Topic for NoExecutionStatus {
    const NAME: &'static str = "";
    const TYPE_NAME: &'static str = "";
    type Key = SessionKey;

    fn key(&self) -> SessionKey {
        match *self {}
    }
}

impl ExecutionStatus for NoExecutionStatus {
    const DEFINED: bool = false;
}

/// The status of a command (`UMAACommandStatus`, table 26). The same members for all commands.
#[derive(Serialize, Deserialize)]
#[serde(bound = "", rename_all = "camelCase", deny_unknown_fields)]
pub struct CommandStatus<C> {
    /// When the status was made.
    pub time_stamp: DateTime,
    /// The provider (key).
    pub source: Guid,
    /// The command's session (key).
    #[serde(rename = "sessionID")]
    pub session_id: Guid,
    /// How far the command has come.
    pub command_status: CommandState,
    /// Why it came there.
    pub command_status_reason: CommandStatusReason,
    /// In words, for people.
    pub log_message: LongDescription,
    #[serde(skip)]
    of: PhantomData<fn() -> C>,
}

impl<C> CommandStatus<C> {
    /// The status of the session `key` at a time.
    pub fn new(
        time_stamp: DateTime,
        key: SessionKey,
        command_status: CommandState,
        command_status_reason: CommandStatusReason,
        log_message: LongDescription,
    ) -> Self {
        let SessionKey { source, session_id } = key;
        let of = PhantomData;
        Self { time_stamp, source, session_id, command_status, command_status_reason, log_message, of }
    }
}

// By hand, because derived ones would ask the same of the command, which is not in it.
impl<C> Clone for CommandStatus<C> {
    fn clone(&self) -> Self {
        Self::new(
            self.time_stamp,
            SessionKey { source: self.source, session_id: self.session_id },
            self.command_status,
            self.command_status_reason,
            self.log_message.clone(),
        )
    }
}

impl<C> PartialEq for CommandStatus<C> {
    fn eq(&self, other: &Self) -> bool {
        let key = |status: &Self| (status.time_stamp, status.source, status.session_id);
        let state = |status: &Self| (status.command_status, status.command_status_reason);
        key(self) == key(other) && state(self) == state(other) && self.log_message == other.log_message
    }
}

impl<C> fmt::Debug for CommandStatus<C> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { time_stamp, source, session_id, command_status, command_status_reason, .. } = self;
        let time = time_stamp.seconds();
        write!(f, "{command_status} {command_status_reason} of {session_id} by {source} at {time} s")?;
        write!(f, " {:?}", self.log_message.as_str())
    }
}

impl<C: Command> Topic for CommandStatus<C> {
    const NAME: &'static str = C::STATUS_NAME;
    const TYPE_NAME: &'static str = C::STATUS_TYPE_NAME;
    type Key = SessionKey;

    fn key(&self) -> SessionKey {
        SessionKey { source: self.source, session_id: self.session_id }
    }
}

impl<C: Command> Sourced for CommandStatus<C> {
    fn time_stamp(&self) -> DateTime {
        self.time_stamp
    }

    fn source(&self) -> Guid {
        self.source
    }
}

/// The acknowledgement of a command: what its provider is executing (`UMAACommandStatusBase`, table 25; 4.1.4.1, item 1).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(bound(deserialize = "C: Command"), rename_all = "camelCase", deny_unknown_fields)]
pub struct CommandAckReport<C> {
    /// The command as it came.
    pub command: C,
    /// When the acknowledgement was made.
    pub time_stamp: DateTime,
    /// The provider (key).
    pub source: Guid,
    /// The command's session (key).
    #[serde(rename = "sessionID")]
    pub session_id: Guid,
}

impl<C: Command> Topic for CommandAckReport<C> {
    const NAME: &'static str = C::ACK_REPORT_NAME;
    const TYPE_NAME: &'static str = C::ACK_REPORT_TYPE_NAME;
    type Key = SessionKey;

    fn key(&self) -> SessionKey {
        SessionKey { source: self.source, session_id: self.session_id }
    }
}

impl<C: Command> Sourced for CommandAckReport<C> {
    fn time_stamp(&self) -> DateTime {
        self.time_stamp
    }

    fn source(&self) -> Guid {
        self.source
    }
}

/// Makes a struct with `time_stamp`, `source`, `session_id` and `destination` a command: its topic and the names of its
/// family follow from its name (ICD 3.4).
///
/// `umaa_command!(Type, "UMAA::…::TypeCommand", ExecutionStatusType)`
#[macro_export]
macro_rules! umaa_command {
    ($command:ty, $name:literal, $execution_status:ty) => {
        impl $crate::umaa::Topic for $command {
            const NAME: &'static str = $name;
            const TYPE_NAME: &'static str = concat!($name, "Type");
            type Key = $crate::umaa::CommandKey;

            fn key(&self) -> $crate::umaa::CommandKey {
                let Self { source, session_id, destination, .. } = *self;
                $crate::umaa::CommandKey { source, session_id, destination }
            }
        }

        impl $crate::umaa::Sourced for $command {
            fn time_stamp(&self) -> $crate::DateTime {
                self.time_stamp
            }

            fn source(&self) -> $crate::Guid {
                self.source
            }
        }

        impl $crate::umaa::Command for $command {
            type ExecutionStatus = $execution_status;
            const STATUS_NAME: &'static str = concat!($name, "Status");
            const STATUS_TYPE_NAME: &'static str = concat!($name, "StatusType");
            const ACK_REPORT_NAME: &'static str = concat!($name, "AckReport");
            const ACK_REPORT_TYPE_NAME: &'static str = concat!($name, "AckReportType");

            fn header(&self) -> $crate::umaa::CommandHeader {
                let Self { time_stamp, source, session_id, destination, .. } = *self;
                $crate::umaa::CommandHeader { time_stamp, source, session_id, destination }
            }

            fn set_header(&mut self, header: $crate::umaa::CommandHeader) {
                let $crate::umaa::CommandHeader { time_stamp, source, session_id, destination } = header;
                (self.time_stamp, self.source) = (time_stamp, source);
                (self.session_id, self.destination) = (session_id, destination);
            }
        }
    };
}
