//! Calls: a request, its replies and its refusals, correlated by an id of the caller.

use serde::{Deserialize, Serialize};

/// The number of a call, unique for its caller's life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct CallId(pub u64);

/// That a message is part of a call.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Call {
    /// Which call. A reply carries the id of its request.
    pub id: CallId,
    /// Which part.
    pub role: Role,
}

/// The part of a message in a call.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub enum Role {
    /// Asks for an answer.
    Request {
        /// How long the caller still waits, in milliseconds: a remaining time, because clocks differ.
        time_left_ms: u32,
    },
    /// Answers.
    Reply {
        /// Whether this answerer is done.
        last: bool,
    },
    /// Says why there is no answer from this service.
    Refused {
        /// Why.
        reason: Refusal,
    },
}

/// Why a call was not answered.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum Refusal {
    /// No such service is alive.
    #[error("nobody is there: no service at this address is alive")]
    NobodyThere,
    /// The time ran out.
    #[error("no answer before the deadline")]
    NoAnswer,
    /// The called node does not allow this caller.
    #[error("not allowed: {0}")]
    NotAllowed(String),
    /// The service does not know the request or could not read it.
    #[error("not understood: {0}")]
    NotUnderstood(String),
    /// The service failed while it worked on the request.
    #[error("failed: {0}")]
    Failed(String),
    /// A limit was reached, at the caller or at the called node.
    #[error("overloaded: {0}")]
    Overloaded(String),
}
