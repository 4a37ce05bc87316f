//! Frames of a link over a Zenoh network that both its ends join: best-effort puts on `@link` keys, in a session of the link's own.

use super::session::{BusError, failed, off_the_loop};
use crate::carrier::Outgoing;
use crate::runtime::Shared;
use aldis_envelope::{EntityId, Fleet, Keys};
use aldis_services::link::CarrierId;
use aldis_services::{Event, LinkEvent, LinkId, Place};
use std::time::Duration;
use tokio::sync::mpsc;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::Locality;
use zenoh::{Session, Wait};

/// The first wait before a session is opened again.
const RETRY: Duration = Duration::from_secs(2);
/// How often a session is asked whether it still lives.
const CHECK_EVERY: Duration = Duration::from_secs(1);
/// How many frames wait for the node. A link that brings more is a flood, and frames may be lost.
const WAITING_MAX: usize = 1_024;
/// Who puts on these keys is the peer or nobody: the link's own keys tell.
const FAR_END: Place = Place(0);

/// A carrier over Zenoh.
#[derive(Debug, Clone)]
pub(crate) struct Channel {
    pub(crate) link: LinkId,
    pub(crate) carrier: CarrierId,
    pub(crate) fleet: Fleet,
    pub(crate) own: EntityId,
    pub(crate) peer: EntityId,
    pub(crate) config: zenoh::Config,
    pub(crate) mtu: usize,
}

impl Channel {
    /// What one entity says to another by a carrier.
    fn key(&self, from: EntityId, to: EntityId) -> String {
        Keys::new(&self.fleet).link_frames(from, to, self.carrier.0)
    }
}

/// Something of Zenoh's that is dropped on a thread of its own: dropping it blocks, which a runtime of one thread must not.
struct Elsewhere<T: Send + 'static>(Option<T>);

impl<T: Send + 'static> Drop for Elsewhere<T> {
    fn drop(&mut self) {
        let inner = self.0.take();
        // Where no thread can be had it is dropped here.
        let _ = std::thread::Builder::new().name("bus".into()).spawn(move || drop(inner));
    }
}

struct Putter(Elsewhere<Publisher<'static>>);

impl Outgoing for Putter {
    fn send(&mut self, frame: &[u8]) {
        let Some(publisher) = &self.0.0 else { return };
        if let Err(why) = publisher.put(frame).wait() {
            tracing::debug!("zenoh: a frame is dropped: {why}");
        }
    }
}

/// Serves a channel until the node ends.
pub(crate) async fn serve(core: Shared, channel: Channel) {
    loop {
        let why = match open(&channel).await {
            Ok((session, publisher, subscriber, frames)) => {
                // What is declared goes before the session.
                let open = Elsewhere(Some((subscriber, session)));
                let publisher = Putter(Elsewhere(Some(publisher)));
                receive(&core, &channel, &open, publisher, frames).await;
                "the session is gone".to_owned()
            }
            Err(why) => why.to_string(),
        };
        {
            let mut core = core.lock();
            core.handle(&mut vec![Event::Link(channel.link, LinkEvent::Down(channel.carrier, why))]);
        }
        tokio::time::sleep(RETRY).await;
    }
}

type Opened = (Session, Publisher<'static>, Subscriber<()>, mpsc::Receiver<bytes::Bytes>);

async fn open(channel: &Channel) -> Result<Opened, BusError> {
    let doing = "open the session of a link";
    let channel = channel.clone();
    let opened = off_the_loop(move || {
        let session = zenoh::open(channel.config.clone()).wait().map_err(failed(doing))?;
        let publisher = session
            .declare_publisher(channel.key(channel.own, channel.peer))
            .congestion_control(CongestionControl::Drop)
            .priority(Priority::RealTime)
            .express(true)
            .allowed_destination(Locality::Remote)
            .wait()
            .map_err(failed(doing))?;
        let (tell, frames) = mpsc::channel(WAITING_MAX);
        let subscriber = session
            .declare_subscriber(channel.key(channel.peer, channel.own))
            .allowed_origin(Locality::Remote)
            .callback(move |sample| {
                // Beyond what can wait, frames are lost, as on any link.
                let _ = tell.try_send(sample.payload().to_bytes().into_owned().into());
            })
            .wait()
            .map_err(failed(doing))?;
        Ok((session, publisher, subscriber, frames))
    });
    opened.await.map_err(failed(doing))?
}

/// Hands frames in until the session is gone.
async fn receive(
    core: &Shared,
    channel: &Channel,
    open: &Elsewhere<(Subscriber<()>, Session)>,
    publisher: Putter,
    mut frames: mpsc::Receiver<bytes::Bytes>,
) {
    let (link, carrier) = (channel.link, channel.carrier);
    {
        let mut core = core.lock();
        core.carriers().set(link, carrier, Box::new(publisher));
        core.handle(&mut vec![Event::Link(link, LinkEvent::Up(carrier, channel.mtu))]);
    }
    loop {
        tokio::select! {
            frame = frames.recv() => {
                let Some(frame) = frame else { break };
                let event = LinkEvent::Frame(carrier, FAR_END, frame);
                core.lock().handle(&mut vec![Event::Link(link, event)]);
            }
            () = tokio::time::sleep(CHECK_EVERY) => {
                if open.0.as_ref().is_none_or(|(_, session)| session.is_closed()) {
                    break;
                }
            }
        }
    }
    core.lock().carriers().remove(link, carrier);
}
