//! Flow control of commands (ICD 4.1), generic over the command.
//!
//! A provider's author writes an [`Executor`]: validate, start, progress, stop. [`Provider`] is the rest: statuses in their
//! order, acknowledgements, updates, cancels, time limits, clean-up, recovery and shutdown; it is a service of a node.
//! A consumer's author starts commands at a [`Consumer`] and is told how they end.
//!
//! [`table`] is figure 5 as data, and nothing is published that is not in it. What is done where the ICD contradicts itself is
//! in [`decisions`], one function each.

mod consumer;
pub mod decisions;
mod executor;
mod provider;
mod session;
pub mod table;
mod writer;

pub use consumer::{Consumer, ConsumerError, ConsumerSettings, Outcome, Recovery, Told};
pub use executor::{
    Admission, Commanded, Everybody, Executor, Failure, FailureKind, Progress, SessionId, Stop, Stopped,
    Verdict,
};
pub use provider::{Provider, ProviderSettings};
pub(crate) use writer::{Writer, is_about};
