//! One session on the bus, and all that is declared on it.

use super::Inbox;
use super::outlet::Outlet;
use aldis_envelope::codec::native::encode;
use aldis_envelope::{Change, Envelope, Keys, Priority, Source};
use aldis_services::{Event, PublisherId};
use bytes::Bytes;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;
use tokio::sync::Notify;
use zenoh::bytes::ZBytes;
use zenoh::key_expr::KeyExpr;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::qos::CongestionControl;
use zenoh::sample::{Locality, Sample, SampleKind};
use zenoh::{Session, Wait};

/// How many keys of others are declared: with them Zenoh keeps a route for each. Ten thousand at once block for seconds.
const KEYS_DECLARED_MAX: usize = 2_000;

/// What is done where tokens are.
const FOLLOW: &str = "follow the liveliness tokens";

/// How long the answer to who is there may take.
const TOKENS_WITHIN: Duration = Duration::from_secs(3);

/// How often is asked who is there, where nobody seems to be.
const TOKENS_ASKED_MAX: u32 = 3;

/// How long closing the session may take.
const CLOSE_WITHIN: Duration = Duration::from_secs(2);

/// Contents up to this size are copied out of Zenoh's buffers, so that a small message does not keep a large one's
/// buffer; larger ones are shared.
const COPY_UP_TO: usize = 2_048;

/// Zenoh's word for what went wrong.
#[derive(Debug, thiserror::Error)]
#[error("{doing}: {why}")]
pub(crate) struct BusError {
    doing: &'static str,
    why: String,
}

pub(super) fn failed<E: std::fmt::Display>(doing: &'static str) -> impl Fn(E) -> BusError {
    move |why| BusError { doing, why: why.to_string() }
}

/// A session on the bus.
pub(crate) struct Bus {
    session: Session,
    keys: Keys,
    inbox: Arc<Inbox>,
    congestion: CongestionControl,
    publishers: Vec<Option<Outlet>>,
    subscribers: BTreeMap<String, Subscriber<()>>,
    tokens: BTreeMap<Source, LivelinessToken>,
    learned: Vec<KeyExpr<'static>>,
    asked_for_tokens: u32,
    /// How often who is there has changed.
    changes: Arc<AtomicU64>,
    _alive: Option<Subscriber<()>>,
}

impl Bus {
    /// Opens a session. What comes in goes to the inbox.
    pub(crate) async fn open(
        config: zenoh::Config,
        keys: Keys,
        congestion: CongestionControl,
        inbox: Arc<Inbox>,
    ) -> Result<Self, BusError> {
        let doing = "open the session";
        let session = off_the_loop(move || zenoh::open(config).wait()).await.map_err(failed(doing))?;
        let session = session.map_err(failed(doing))?;
        Ok(Self {
            session,
            keys,
            inbox,
            congestion,
            publishers: Vec::new(),
            subscribers: BTreeMap::new(),
            tokens: BTreeMap::new(),
            learned: Vec::new(),
            asked_for_tokens: 0,
            changes: Arc::default(),
            _alive: None,
        })
    }

    /// Follows the liveliness tokens of the fleet, and says when those that are there now are all told. A machine under load
    /// may give no answer in time, which is not "nobody": then `again` is told, and has to call [`Self::ask_for_tokens`].
    pub(crate) fn follow_tokens(&mut self, again: &Arc<Notify>) -> Result<(), BusError> {
        let (inbox, keys, changes) = (self.inbox.clone(), self.keys.clone(), self.changes.clone());
        let liveliness = self.session.liveliness();
        let subscriber = liveliness
            .declare_subscriber(self.keys.every_alive())
            .callback(move |sample| {
                // Counted before it is told: who answers to the news is heard.
                changes.fetch_add(1, Ordering::Relaxed);
                tell_alive(&inbox, &keys, &sample);
            })
            .wait()
            .map_err(failed(FOLLOW))?;
        self._alive = Some(subscriber);
        self.ask_for_tokens(again)
    }

    /// Asks for the tokens that are there now; what is told twice does no harm.
    pub(crate) fn ask_for_tokens(&mut self, again: &Arc<Notify>) -> Result<(), BusError> {
        self.asked_for_tokens += 1;
        let keys = self.keys.clone();
        let told = Told {
            inbox: self.inbox.clone(),
            again: (self.asked_for_tokens < TOKENS_ASKED_MAX).then(|| again.clone()),
            others: AtomicBool::new(false),
        };
        let own: BTreeSet<_> = self.tokens.keys().copied().collect();
        self.session
            .liveliness()
            .get(self.keys.every_alive())
            .timeout(TOKENS_WITHIN)
            .callback(move |reply| {
                let of = reply.result().ok().and_then(|sample| tell_alive(&told.inbox, &keys, sample));
                if of.is_some_and(|of| !own.contains(&of)) {
                    told.others.store(true, Ordering::Relaxed);
                }
            })
            .wait()
            .map_err(failed(FOLLOW))
    }

    /// Subscribes to these key expressions and to no others. New ones are declared before old ones go, so that nothing
    /// is missed; what is received twice meanwhile is a duplicate in its stream and dropped.
    pub(crate) fn subscribe(&mut self, expressions: Vec<String>) -> Result<(), BusError> {
        for expression in &expressions {
            if self.subscribers.contains_key(expression) {
                continue;
            }
            let inbox = self.inbox.clone();
            let subscriber = self
                .session
                .declare_subscriber(expression.clone())
                .allowed_origin(Locality::Remote)
                .callback(move |sample| take(&inbox, &sample))
                .wait()
                .map_err(failed("subscribe"))?;
            self.subscribers.insert(expression.clone(), subscriber);
        }
        self.subscribers.retain(|expression, _| expressions.contains(expression));
        Ok(())
    }

    /// Prepares a publisher.
    pub(crate) fn declare(
        &mut self,
        id: PublisherId,
        key: String,
        constant: Vec<u8>,
        priority: Priority,
    ) -> Result<(), BusError> {
        let publisher = self
            .session
            .declare_publisher(key)
            .congestion_control(self.congestion)
            .priority(zenoh_priority(priority))
            .allowed_destination(Locality::Remote)
            .wait()
            .map_err(failed("declare a publisher"))?;
        if self.publishers.len() <= id.0 {
            self.publishers.resize_with(id.0 + 1, || None);
        }
        self.publishers[id.0] = Some(Outlet::new(publisher, constant)?);
        Ok(())
    }

    /// Puts an envelope with a prepared publisher, where anybody listens.
    pub(crate) fn publish(&mut self, id: PublisherId, envelope: Envelope) -> Result<(), BusError> {
        match self.publishers.get_mut(id.0) {
            Some(Some(outlet)) => outlet.put(envelope, &self.changes),
            _ => Err(failed("publish")("the publisher was not declared")),
        }
    }

    /// Puts an envelope on a key without a publisher.
    pub(crate) fn publish_on(&self, key: String, envelope: Envelope) -> Result<(), BusError> {
        let mut header = Vec::with_capacity(128);
        encode(&envelope, &mut header);
        let priority = zenoh_priority(envelope.stamp.priority);
        let put = match envelope.message.change {
            Change::Dispose => {
                let delete = self.session.delete(key).congestion_control(self.congestion).priority(priority);
                delete.allowed_destination(Locality::Remote).attachment(header).wait()
            }
            _ => {
                let content = ZBytes::from(envelope.message.content);
                let put =
                    self.session.put(key, content).congestion_control(self.congestion).priority(priority);
                put.allowed_destination(Locality::Remote).attachment(header).wait()
            }
        };
        put.map_err(failed("publish"))
    }

    /// Shows or withdraws the token of a service.
    pub(crate) fn token(&mut self, source: Source, shown: bool) -> Result<(), BusError> {
        if !shown {
            self.tokens.remove(&source);
            return Ok(());
        }
        let key = self.keys.alive(source);
        let token = self.session.liveliness().declare_token(key).wait().map_err(failed("show a token"))?;
        self.tokens.insert(source, token);
        Ok(())
    }

    /// Declares keys of others, seen for the first time: Zenoh caches routes for declared keys alone. A subscriber that comes
    /// and goes at once makes their senders know a number for the key, which then travels in place of its text.
    pub(crate) fn declare_learned(&mut self, keys: Vec<String>) {
        for key in keys {
            if self.learned.len() >= KEYS_DECLARED_MAX {
                return;
            }
            if let Ok(declared) = self.session.declare_keyexpr(key).wait() {
                let passing = self.session.declare_subscriber(declared.clone()).callback(drop).wait();
                // Without the number the key travels as text, which is slower and nothing else.
                let _ = passing.map(|passing| passing.undeclare().wait());
                self.learned.push(declared);
            }
        }
    }

    /// Whether the session is gone.
    pub(crate) fn is_closed(&self) -> bool {
        self.session.is_closed()
    }

    /// What is declared goes first; all of it on this thread, because dropping it may block too.
    fn close_here(self) -> zenoh::Result<()> {
        let Self { session, publishers, subscribers, tokens, learned, _alive, .. } = self;
        drop((tokens, subscribers, publishers, learned, _alive));
        session.close().wait()
    }

    /// Closes the session, within a bound.
    pub(crate) async fn close(self) {
        match tokio::time::timeout(CLOSE_WITHIN, off_the_loop(move || self.close_here())).await {
            Ok(Ok(Ok(()))) => {}
            Ok(Ok(Err(why))) => tracing::warn!("the session on the bus did not close well: {why}"),
            Ok(Err(_)) | Err(_) => {
                tracing::warn!("the session on the bus did not close within {CLOSE_WITHIN:?}")
            }
        }
    }
}

/// Runs what Zenoh blocks in on a thread of its own: inside a runtime of one thread Zenoh refuses to block.
pub(super) async fn off_the_loop<T: Send + 'static>(
    blocking: impl FnOnce() -> T + Send + 'static,
) -> Result<T, tokio::sync::oneshot::error::RecvError> {
    let (tell, told) = tokio::sync::oneshot::channel();
    // Where no thread can be had, the sender is dropped with the closure, and the caller is told so.
    let _ = std::thread::Builder::new().name("bus".into()).spawn(move || tell.send(blocking()));
    told.await
}

/// Says that all tokens are told when Zenoh has dropped the query's callback, which it does after the last reply. Where none but
/// the own came, it is asked again.
struct Told {
    inbox: Arc<Inbox>,
    /// None: it has been asked often enough.
    again: Option<Arc<Notify>>,
    others: AtomicBool,
}

impl Drop for Told {
    fn drop(&mut self) {
        match &self.again {
            Some(again) if !self.others.load(Ordering::Relaxed) => again.notify_one(),
            _ => self.inbox.event(Event::AliveKnown),
        }
    }
}

/// Tells of a token, and whose it is.
fn tell_alive(inbox: &Inbox, keys: &Keys, sample: &Sample) -> Option<Source> {
    let of = keys.parse(sample.key_expr().as_str()).ok()?.source;
    inbox.event(Event::Alive(of, sample.kind() == SampleKind::Put));
    Some(of)
}

fn take(inbox: &Inbox, sample: &Sample) {
    let header = sample.attachment().map(ZBytes::to_bytes).unwrap_or_default();
    let content = content_of(sample.payload());
    inbox.sample(sample.key_expr().as_str(), sample.kind() == SampleKind::Delete, &header, content);
}

fn content_of(payload: &ZBytes) -> Bytes {
    let mut slices = payload.slices();
    match (slices.next(), slices.next()) {
        (None, _) => Bytes::new(),
        (Some(only), None) if only.len() > COPY_UP_TO => Bytes::from_owner(Whole(payload.clone())),
        (Some(only), None) => Bytes::copy_from_slice(only),
        _ => Bytes::from(payload.to_bytes().into_owned()),
    }
}

/// A payload in one piece.
struct Whole(ZBytes);

impl AsRef<[u8]> for Whole {
    fn as_ref(&self) -> &[u8] {
        self.0.slices().next().unwrap_or_default()
    }
}

fn zenoh_priority(priority: Priority) -> zenoh::qos::Priority {
    use zenoh::qos::Priority as Zenoh;
    match priority {
        Priority::RealTime => Zenoh::RealTime,
        Priority::InteractiveHigh => Zenoh::InteractiveHigh,
        Priority::InteractiveLow => Zenoh::InteractiveLow,
        Priority::DataHigh => Zenoh::DataHigh,
        Priority::Data => Zenoh::Data,
        Priority::DataLow => Zenoh::DataLow,
        Priority::Background => Zenoh::Background,
    }
}
