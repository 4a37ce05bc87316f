//! What a reader has of the former life of a stream: a writer's node that starts again retains anew what it had, and a reader
//! that stayed is not to hear it as news.

use super::super::history::History;
use aldis_envelope::{Change, Envelope, KeyHash};
use std::collections::{BTreeMap, VecDeque};

/// The samples of a former life, by instance and in their order.
#[derive(Debug, Default)]
pub(super) struct Former(BTreeMap<Option<KeyHash>, VecDeque<Envelope>>);

impl Former {
    /// What was kept of a stream until its writer's node started again.
    pub(super) fn of(history: &History) -> Self {
        let mut samples: BTreeMap<_, VecDeque<Envelope>> = BTreeMap::new();
        for sample in history.samples() {
            samples.entry(instance_of(sample)).or_default().push_back(sample.clone());
        }
        Self(samples)
    }

    /// Whether a sample has been heard and is not to be handed over again. The last of an instance that is alive is: who
    /// takes what a vanished writer said for lost has to hear that it stands.
    pub(super) fn has(&mut self, sample: &Envelope) -> bool {
        let instance = instance_of(sample);
        let Some(of_instance) = self.0.get_mut(&instance) else { return false };
        let Some(place) = of_instance.iter().position(|known| is_same(known, sample)) else { return false };
        of_instance.drain(..=place);
        let is_last = of_instance.is_empty();
        if is_last {
            self.0.remove(&instance);
        }
        !(is_last && sample.message.change == Change::Put)
    }

    /// All that is retained has come: what is left has gone with the former life.
    pub(super) fn forget(&mut self) {
        self.0.clear();
    }
}

fn instance_of(sample: &Envelope) -> Option<KeyHash> {
    sample.message.instance.as_ref().map(|instance| instance.hash)
}

fn is_same(known: &Envelope, sample: &Envelope) -> bool {
    let of = |envelope: &Envelope| (envelope.stamp.source_time, envelope.message.change);
    of(known) == of(sample) && known.message.content == sample.message.content
}
