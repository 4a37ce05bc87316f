//! What services have written, as the node has kept it and handed it on.

use crate::sim::observe::Fact;
use aldis_envelope::umaa::{
    self, CommandKey, CommandStatus, Key, ResourceAllocationCommand, ResourceAllocationReport, Topic,
};
use aldis_envelope::{Change, Envelope};
use std::fmt;

/// A service has written something: its node retains it, and hands it to all who read it.
#[derive(Clone, PartialEq)]
pub(super) struct Wrote(pub(super) Envelope);

impl Fact for Wrote {}

/// In one line, for traces: statuses as what they say, the rest by its instance.
impl fmt::Debug for Wrote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let message = &self.0.message;
        let (topic, writer) = (message.label.descriptor(), message.label.source());
        let name = topic.rsplit("::").next().unwrap_or_default();
        write!(f, "{writer} writes {name}: ")?;
        match (message.change, &message.instance) {
            (Change::Put, _) if topic.ends_with("CommandStatus") => {
                // All statuses have the same members.
                match umaa::decode::<CommandStatus<ResourceAllocationCommand>>(&message.content) {
                    Ok(status) => write!(f, "{status:?}"),
                    Err(why) => write!(f, "{why}"),
                }
            }
            (Change::Put, _) if topic == ResourceAllocationReport::NAME => {
                match umaa::decode::<ResourceAllocationReport>(&message.content) {
                    Ok(report) => write!(f, "{:?}", report.control_info),
                    Err(why) => write!(f, "{why}"),
                }
            }
            (change, Some(instance)) => match CommandKey::of_instance(instance) {
                Some(key) => write!(f, "{change:?} of session {} by {}", key.session_id, key.source),
                None => write!(f, "{change:?} of {}", instance.hash),
            },
            (change, None) => write!(f, "{change:?}"),
        }
    }
}
