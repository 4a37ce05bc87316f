//! ResourceAllocation (ICD 5.1.3): who may command the providers of a resource, and how everybody comes to agree on it.
//!
//! The [`Arbiter`] gives control of resources to one consumer at a time and reports it. A [`Guard`] lets a provider execute the
//! commands of the consumer in control alone. A [`ControlledConsumer`] asks for control first and commands then.
//!
//! What is decided where the ICD is silent or contradicts itself:
//!
//! | where | clauses | what is done, and why |
//! | --- | --- | --- |
//! | [`Guard`], another holder | 5.1.3 | running commands of a former holder end with FAILED / INTERRUPTED: the ICD checks on arrival only, and two consumers would steer |
//! | [`Guard`], expiry and release | 5.1.3 | end acceptance, not commands that run: nobody else steers, and a vehicle that stops by itself is no safer |
//! | [`Guard`], end times | 5.1.3 | in the arbiter's clock: vehicles' clocks may differ by minutes |
//! | [`Guard`], freshness | 5.1.3, strong consistency | a copy that is not repeated within three fifths of the lease names nobody: a reader that the arbiter has given up must have given up before |
//! | [`Guard`], two arbiters | 5.1.3 | neither's holder is let through: they cannot both be right |
//! | [`Arbiter`], take-over | 5.1.3, table 33 | the loser is FAILED / INTERRUPTED before the report names the winner |
//! | [`Arbiter`], confirmation | 5.1.3, strong consistency | EXECUTING once every reliable reader has the report; else FAILED / TIMEOUT and the report is withdrawn |
//! | [`Arbiter`], a second session | 5.1.3 | of the holder replaces the first, which goes COMPLETED |
//! | [`Arbiter`], a second session before control is given | 5.1.3 | takes the place of the first, which is FAILED / INTERRUPTED: COMPLETED would have to say EXECUTING first |
//! | [`Guard`], between COMMANDED and EXECUTING | 5.1.3 | the consumer has to be in control still, after a restart of the provider too: nothing moves yet, and another may have taken over |
//! | [`Arbiter`], a holder that a new list leaves out | 5.1.3 | keeps control, and cannot renew it: a new list does not move control that is held |
//! | [`Arbiter`], a command that is not there after a restart | 4.1.2.1, 5.1.3 | FAILED / SERVICE_FAILED at once, and the report names its consumer no more: were its status left to stand until its consumer is in contact, another would be given control beside it |
//! | [`Arbiter`], priorities after a restart | 5.1.3 | those of the former life, which the ICD publishes for persistence; the log says where the configuration differs |

mod arbiter;
mod consumer;
mod control;
mod guard;
mod priority;
mod settings;

pub use arbiter::Arbiter;
pub use consumer::{ControlOutcome, ControlTold, ControlledConsumer, Plan, PlanError, TaskId};
pub use guard::{Guard, GuardSettings};
pub use settings::{ArbiterSettings, Arbitration, MEMBERS_MAX, RESOURCES_MAX, Resource, SettingsError};
