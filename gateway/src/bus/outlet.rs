//! A publisher that keeps silent while nobody listens.

use super::session::{BusError, failed};
use aldis_envelope::codec::native::encode_variable;
use aldis_envelope::{Change, Envelope};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};
use zenoh::Wait;
use zenoh::bytes::ZBytes;
use zenoh::matching::MatchingListener;
use zenoh::pubsub::Publisher;

/// After its declaration and after every change of who is there, a publisher sends for so long whatever Zenoh says of
/// listeners: what others declare arrives by and by, and Zenoh tells of it on a thread of its own.
const SETTLING: Duration = Duration::from_secs(1);

/// A prepared publisher and the part of its header that never changes.
pub(super) struct Outlet {
    /// Before the publisher, which ends what listens for it and complains of none.
    _listener: MatchingListener<()>,
    publisher: Publisher<'static>,
    constant: Vec<u8>,
    /// Whether somebody listens, as Zenoh said last.
    wanted: Arc<AtomicBool>,
    /// How often who is there had changed when this was looked at last.
    changes_seen: u64,
    /// Until when everything goes out; none when that time has passed.
    settling: Option<Instant>,
}

impl Outlet {
    pub(super) fn new(publisher: Publisher<'static>, constant: Vec<u8>) -> Result<Self, BusError> {
        let wanted = Arc::new(AtomicBool::new(false));
        let tell = wanted.clone();
        let listener = publisher
            .matching_listener()
            .callback(move |status| tell.store(status.matching(), Ordering::Relaxed))
            .wait()
            .map_err(failed("ask who listens"))?;
        let settling = Some(Instant::now() + SETTLING);
        Ok(Self { publisher, constant, wanted, _listener: listener, changes_seen: 0, settling })
    }

    /// Puts an envelope, unless nobody listens. `changes` counts how often who is there has changed.
    pub(super) fn put(&mut self, envelope: Envelope, changes: &AtomicU64) -> Result<(), BusError> {
        if !self.wanted.load(Ordering::Relaxed) && !self.is_settling(changes) {
            return Ok(());
        }
        let mut header = Vec::with_capacity(self.constant.len() + 48);
        header.extend_from_slice(&self.constant);
        encode_variable(&envelope.message, &envelope.stamp, &mut header);
        let put = match envelope.message.change {
            Change::Dispose => self.publisher.delete().attachment(header).wait(),
            _ => self.publisher.put(ZBytes::from(envelope.message.content)).attachment(header).wait(),
        };
        put.map_err(failed("publish"))
    }

    fn is_settling(&mut self, changes: &AtomicU64) -> bool {
        let changes = changes.load(Ordering::Relaxed);
        if changes != self.changes_seen {
            self.changes_seen = changes;
            self.settling = Some(Instant::now() + SETTLING);
        }
        if self.settling.is_some_and(|until| until <= Instant::now()) {
            self.settling = None;
        }
        self.settling.is_some()
    }
}
