//! What may be done against the ICD, and by whom.

use super::arrangement::Arrangement;
use aldis_envelope::Source;

/// What is done against the ICD.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Act {
    LeavesOutIssued,
    LeavesOutCommanded,
    ExecutesTwice,
    GivesWrongReason,
    AcknowledgesLate,
    AcknowledgesOther,
    HidesExecution,
    UpdatesWithoutTime,
    IgnoresCommand,
    CancelsUnasked,
    HearsCancelLate,
    LeavesCommand,
    CleansUpEarly,
    LeavesAcknowledgement,
    UnregistersStatus,
    UnregistersCommand,
    UnregistersReport,
    SpeaksForAnother,
    UsesSessionTwice,
    NamesSecondHolder,
    ReportsLate,
    WritesNonsense,
}

impl Act {
    /// Who does it: a provider that everybody may command, its consumer, the one that steers, or the arbiter.
    pub(super) fn by(self, arrangement: &Arrangement) -> Source {
        match self {
            Self::HidesExecution => arrangement.steersman,
            Self::UnregistersReport | Self::NamesSecondHolder | Self::ReportsLate => arrangement.arbiter,
            Self::UpdatesWithoutTime
            | Self::LeavesCommand
            | Self::UnregistersCommand
            | Self::UsesSessionTwice => arrangement.lamplighter,
            _ => arrangement.lamp,
        }
    }
}
