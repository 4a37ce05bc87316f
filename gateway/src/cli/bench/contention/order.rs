//! The command of this measurement: something that a provider does for some milliseconds.

use aldis_envelope::umaa::NoExecutionStatus;
use aldis_envelope::{DateTime, Guid, umaa_command};
use serde::{Deserialize, Serialize};

/// Something to be done for a time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct OrderCommand {
    pub(super) milliseconds: u32,
    pub(super) time_stamp: DateTime,
    pub(super) source: Guid,
    #[serde(rename = "sessionID")]
    pub(super) session_id: Guid,
    pub(super) destination: Guid,
}

umaa_command!(OrderCommand, "UMAA::MO::Contention::OrderCommand", NoExecutionStatus);

/// One; the members that all commands have are set when it goes out.
pub(super) fn order(milliseconds: u32) -> OrderCommand {
    OrderCommand {
        milliseconds,
        time_stamp: DateTime::default(),
        source: Guid::NIL,
        session_id: Guid::NIL,
        destination: Guid::NIL,
    }
}
