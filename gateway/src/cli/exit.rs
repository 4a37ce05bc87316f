//! How the program ends.

use crate::config::ConfigError;
use aldis_envelope::Refusal;
use std::process::ExitCode;

/// Why a command did not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    /// It failed.
    #[error("{0}")]
    Failed(String),
    /// Wrong usage: nothing was started.
    #[error("{0}")]
    Usage(String),
    /// A wrong configuration: nothing was started.
    #[error("the configuration is wrong")]
    Config(Box<ConfigError>),
    /// A call ended without an answer.
    #[error("{0}")]
    Refused(Refusal),
    /// The bus is out of reach.
    #[error("the bus is out of reach: {0}")]
    Unreachable(String),
}

impl From<ConfigError> for Failure {
    fn from(error: ConfigError) -> Self {
        Self::Config(Box::new(error))
    }
}

impl Failure {
    /// Says what happened on standard error, and gives the exit code.
    pub(crate) fn report(self) -> ExitCode {
        let code = self.code();
        match self {
            Self::Config(error) => eprintln!("{:?}", miette::Report::new(*error)),
            other => eprintln!("aldis: {other}"),
        }
        ExitCode::from(code)
    }

    /// The exit code, as `--help` documents it.
    pub(crate) fn code(&self) -> u8 {
        match self {
            Self::Failed(_) => 1,
            Self::Usage(_) | Self::Config(_) => 2,
            Self::Refused(Refusal::NobodyThere) => 3,
            Self::Refused(Refusal::NoAnswer) => 4,
            Self::Refused(_) => 1,
            Self::Unreachable(_) => 5,
        }
    }
}
