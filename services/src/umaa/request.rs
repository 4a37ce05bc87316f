//! Request and reply without query data (ICD 4.2.1): to subscribe to a report is the request, its samples are the replies.
//!
//! Requests with query data are not defined in this version (4.2.2).

mod consumer;
mod provider;

pub use consumer::{ReportConsumer, ReportTold};
pub use provider::{NotOwn, ReportAction, ReportProvider};
