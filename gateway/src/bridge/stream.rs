//! One connection in stream form, over whatever carries bytes: bytes in become events, effects become bytes out.

use super::peers::{CREDIT, Form, Sink};
use crate::runtime::Shared;
use aldis_envelope::Dialect;
use aldis_envelope::codec::stream::{Check, Item, Reader, Writer};
use aldis_services::event::BadInput;
use aldis_services::{BridgeId, Event, PeerEvent, PeerId};
use bytes::BytesMut;
use std::io::ErrorKind;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::net::TcpStream;
use tokio::sync::{Notify, watch};

/// How much is read at once.
const READ_BYTES: usize = 64 * 1024;
/// A frame unfinished for so long gives way where whole frames stand behind its head.
const UNFINISHED_AFTER: Duration = Duration::from_secs(2);

/// What carries bytes both ways.
pub(super) trait Port: Sink + Sized + 'static {
    /// Waits until something can be read.
    async fn readable(&self) -> std::io::Result<()>;
    /// Waits until something is taken.
    async fn writable(&self) -> std::io::Result<()>;
    /// Reads what is there; 0 is the end.
    fn try_read(&self, buffer: &mut BytesMut) -> std::io::Result<usize>;
}

impl Port for TcpStream {
    async fn readable(&self) -> std::io::Result<()> {
        Self::readable(self).await
    }
    async fn writable(&self) -> std::io::Result<()> {
        Self::writable(self).await
    }
    fn try_read(&self, buffer: &mut BytesMut) -> std::io::Result<usize> {
        self.try_read_buf(buffer)
    }
}

/// How messages are read and written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    pub(crate) dialect: Dialect,
    pub(crate) message_bytes_max: usize,
    pub(crate) check: Check,
}

/// Serves one connection until it ends; why it did.
pub(super) async fn run<P: Port>(
    core: Shared,
    bridge: BridgeId,
    (port, from): (P, String),
    limits: Limits,
    paused: watch::Receiver<bool>,
) -> String {
    let (port, blocked) = (Arc::new(port), Arc::new(Notify::new()));
    let form = Form::Stream(Writer::new(limits.dialect).with_check(limits.check));
    let id = {
        let mut core = core.lock();
        let id = core.peers().add(bridge, port.clone(), form, blocked.clone());
        core.handle(&mut vec![Event::Peer(bridge, id, PeerEvent::Up(from, CREDIT))]);
        id
    };
    let reader = Reader::new(limits.message_bytes_max).with_check(limits.check);
    let mut reading = Reading { core: core.clone(), bridge, id, reader, paused };
    let why = tokio::select! {
        why = reading.run(&*port) => why,
        why = writing(&core, bridge, id, &*port, &blocked) => why,
    };
    let mut core = core.lock();
    core.peers().remove(bridge, id);
    core.handle(&mut vec![Event::Peer(bridge, id, PeerEvent::Down(why.clone()))]);
    why
}

/// Waits, whenever writing was blocked, until it is not.
pub(super) async fn writing(
    core: &Shared,
    bridge: BridgeId,
    id: PeerId,
    port: &impl Port,
    blocked: &Notify,
) -> String {
    loop {
        blocked.notified().await;
        if let Err(why) = port.writable().await {
            return why.to_string();
        }
        let mut events = Vec::new();
        let mut core = core.lock();
        core.peers().unblocked(bridge, id, &mut events);
        core.handle(&mut events);
    }
}

struct Reading {
    core: Shared,
    bridge: BridgeId,
    id: PeerId,
    reader: Reader,
    paused: watch::Receiver<bool>,
}

impl Reading {
    /// Reads until the connection ends; why it did.
    async fn run(&mut self, port: &impl Port) -> String {
        let mut events = Vec::new();
        let mut progress = Instant::now();
        loop {
            if self.paused.wait_for(|paused| !*paused).await.is_err() {
                return "the node ends".into();
            }
            let readable = tokio::time::timeout(UNFINISHED_AFTER, port.readable()).await;
            if let Ok(Err(why)) = readable {
                return why.to_string();
            }
            let read = if readable.is_ok() { self.read(port) } else { Ok(None) };
            match read {
                Ok(Some(0)) => return "it closed the connection".into(),
                Ok(_) => {}
                Err(why) => return why.to_string(),
            }
            self.take_items(&mut events);
            if events.is_empty() && progress.elapsed() >= UNFINISHED_AFTER && self.reader.is_inside_a_frame()
            {
                events.extend(self.reader.abandon_unfinished().map(|item| self.event(item)));
                self.take_items(&mut events);
                progress = Instant::now();
            }
            if !events.is_empty() {
                progress = Instant::now();
                self.core.lock().handle(&mut events);
            }
        }
    }

    /// Reads what is there; none when there is nothing after all.
    fn read(&mut self, port: &impl Port) -> std::io::Result<Option<usize>> {
        let buffer = self.reader.buffer();
        buffer.reserve(READ_BYTES);
        match port.try_read(buffer) {
            Ok(count) => Ok(Some(count)),
            Err(e) if e.kind() == ErrorKind::WouldBlock => Ok(None),
            Err(e) => Err(e),
        }
    }

    fn take_items(&mut self, events: &mut Vec<Event>) {
        while let Some(item) = self.reader.next_item() {
            let event = self.event(item);
            events.push(event);
        }
    }

    fn event(&self, item: Item) -> Event {
        let event = match item {
            Item::Message(message) => PeerEvent::Message(message),
            Item::Bad(error) => PeerEvent::Bad(BadInput::Stream(error)),
        };
        Event::Peer(self.bridge, self.id, event)
    }
}
