//! A second kind of command beside ResourceAllocation: the simulator's course to steer, with its provider.

pub(crate) use crate::sim::umaa::commands::{VectorCommand, VectorExecutionStatus, steer};

use super::asking::Seen;
use crate::service::Service;
use crate::sim::umaa::scripted::Scripted;
use crate::umaa::command::{Admission, Provider, ProviderSettings};
use aldis_envelope::{Guids, Source};

/// The provider as a service.
pub(crate) fn provider(
    source: Source,
    guids: &Guids,
    settings: ProviderSettings,
    admission: impl Admission + 'static,
    asked: Seen<String>,
) -> Box<dyn Service> {
    let steering = Scripted::new(guids.of_service(source), Some(asked));
    Box::new(Provider::<VectorCommand, _, _>::new(source, guids.clone(), settings, steering, admission))
}
