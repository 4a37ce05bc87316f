//! Two kinds of commands beside ResourceAllocation: a course to steer, with an execution status, and a rudder to set, without.

use aldis_envelope::umaa::{Command, ExecutionStatus, LongDescription, NoExecutionStatus, SessionKey, Topic};
use aldis_envelope::{DateTime, Guid, umaa_command};
use serde::{Deserialize, Serialize};

/// A command that says itself how its execution is to go.
pub(crate) trait Script: Command {
    /// How long it lasts; 0 is without end.
    fn seconds(&self) -> u32;
    /// What goes wrong, by name; empty is nothing.
    fn trouble(&self) -> &str;
    /// Whether its own members are within their ranges.
    fn is_valid(&self) -> bool;
    /// Its own member in words.
    fn text(&self) -> String;
    /// What its execution status says, where it has one.
    fn status(key: SessionKey, time_stamp: DateTime, seconds_left: u32) -> Option<Self::ExecutionStatus>;
}

/// A course to steer for some seconds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct VectorCommand {
    pub(crate) course_degrees: f64,
    /// How long it is steered; 0 is without end.
    pub(crate) seconds: u32,
    /// What goes wrong, by name; empty is nothing.
    pub(crate) trouble: LongDescription,
    pub(crate) time_stamp: DateTime,
    pub(crate) source: Guid,
    #[serde(rename = "sessionID")]
    pub(crate) session_id: Guid,
    pub(crate) destination: Guid,
}

umaa_command!(VectorCommand, "UMAA::MO::VectorControl::VectorCommand", VectorExecutionStatus);

/// How long a course is steered yet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct VectorExecutionStatus {
    pub(crate) seconds_left: u32,
    pub(crate) time_stamp: DateTime,
    pub(crate) source: Guid,
    #[serde(rename = "sessionID")]
    pub(crate) session_id: Guid,
}

impl Topic for VectorExecutionStatus {
    const NAME: &'static str = "UMAA::MO::VectorControl::VectorExecutionStatusReport";
    const TYPE_NAME: &'static str = "UMAA::MO::VectorControl::VectorExecutionStatusReportType";
    type Key = SessionKey;

    fn key(&self) -> SessionKey {
        SessionKey { source: self.source, session_id: self.session_id }
    }
}

impl ExecutionStatus for VectorExecutionStatus {}

impl Script for VectorCommand {
    fn seconds(&self) -> u32 {
        self.seconds
    }

    fn trouble(&self) -> &str {
        self.trouble.as_str()
    }

    fn is_valid(&self) -> bool {
        (0.0..360.0).contains(&self.course_degrees)
    }

    fn text(&self) -> String {
        self.course_degrees.to_string()
    }

    fn status(key: SessionKey, time_stamp: DateTime, seconds_left: u32) -> Option<VectorExecutionStatus> {
        let SessionKey { source, session_id } = key;
        Some(VectorExecutionStatus { seconds_left, time_stamp, source, session_id })
    }
}

/// A rudder to set for some seconds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct RudderCommand {
    pub(crate) angle_degrees: f64,
    /// How long it is held; 0 is without end.
    pub(crate) seconds: u32,
    /// What goes wrong, by name; empty is nothing.
    pub(crate) trouble: LongDescription,
    pub(crate) time_stamp: DateTime,
    pub(crate) source: Guid,
    #[serde(rename = "sessionID")]
    pub(crate) session_id: Guid,
    pub(crate) destination: Guid,
}

umaa_command!(RudderCommand, "UMAA::EO::RudderControl::RudderCommand", NoExecutionStatus);

impl Script for RudderCommand {
    fn seconds(&self) -> u32 {
        self.seconds
    }

    fn trouble(&self) -> &str {
        self.trouble.as_str()
    }

    fn is_valid(&self) -> bool {
        (-35.0..=35.0).contains(&self.angle_degrees)
    }

    fn text(&self) -> String {
        self.angle_degrees.to_string()
    }

    fn status(_: SessionKey, _: DateTime, _: u32) -> Option<NoExecutionStatus> {
        None
    }
}

/// A course; the members that all commands have are set when it goes out. A trouble that is too long is shortened.
pub(crate) fn steer(course_degrees: f64, seconds: u32, trouble: &str) -> VectorCommand {
    VectorCommand {
        course_degrees,
        seconds,
        trouble: LongDescription::shortened(trouble),
        time_stamp: DateTime::default(),
        source: Guid::NIL,
        session_id: Guid::NIL,
        destination: Guid::NIL,
    }
}

/// A rudder angle, likewise.
pub(crate) fn turn(angle_degrees: f64, seconds: u32, trouble: &str) -> RudderCommand {
    RudderCommand {
        angle_degrees,
        seconds,
        trouble: LongDescription::shortened(trouble),
        time_stamp: DateTime::default(),
        source: Guid::NIL,
        session_id: Guid::NIL,
        destination: Guid::NIL,
    }
}
