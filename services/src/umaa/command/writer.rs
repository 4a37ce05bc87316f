//! Puts samples of one topic, and says when their instances end.

use crate::service::Outbox;
use aldis_envelope::umaa::{self, Topic};
use aldis_envelope::{Change, ContentType, Envelope, Label, Source};
use std::marker::PhantomData;
use std::sync::Arc;
use std::time::Duration;

/// Writes one topic in the name of a service.
#[derive(Debug, Clone)]
pub(crate) struct Writer<T> {
    /// None for a topic that is not defined.
    label: Option<Arc<Label>>,
    of: PhantomData<fn(T)>,
}

impl<T: Topic> Writer<T> {
    pub(crate) fn new(source: Source) -> Self {
        Self { label: umaa::label::<T>(source).ok(), of: PhantomData }
    }

    pub(crate) fn put(&self, sample: &T, out: &mut Outbox) {
        if let Some(label) = &self.label {
            out.send(umaa::put(label.clone(), sample));
        }
    }

    /// Puts a sample that every reader has to confirm; the answer comes with this number.
    pub(crate) fn put_confirmed(&self, sample: &T, number: u64, within: Duration, out: &mut Outbox) {
        if let Some(label) = &self.label {
            out.send_confirmed(umaa::put(label.clone(), sample), number, within);
        }
    }

    pub(crate) fn dispose(&self, key: T::Key, out: &mut Outbox) {
        self.end(Change::Dispose, key, out);
    }

    pub(crate) fn unregister(&self, key: T::Key, out: &mut Outbox) {
        self.end(Change::Unregister, key, out);
    }

    fn end(&self, change: Change, key: T::Key, out: &mut Outbox) {
        if let Some(label) = &self.label {
            out.send(umaa::about_instance(label.clone(), change, key));
        }
    }
}

/// Whether an envelope is about a topic, as a broadcast in the form that is read here.
pub(crate) fn is_about<T: Topic>(envelope: &Envelope) -> bool {
    let label = &envelope.message.label;
    label.descriptor() == T::NAME
        && label.is_broadcast()
        && label.attributes.content_type == ContentType::Umaa
}
