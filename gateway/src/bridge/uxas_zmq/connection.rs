//! One connection of a ZeroMQ socket: a handshake, then messages in or out.

use super::{Endpoint, Sockets};
use crate::bridge::connection::tell;
use crate::bridge::peers::{CREDIT, Form};
use crate::bridge::stream::writing;
use crate::runtime::Shared;
use aldis_envelope::codec::zmtp::{
    Framing, GREETING, Item, Reader, SocketType, Topics, Writer, pong, ready, subscription,
};
use aldis_services::event::BadInput;
use aldis_services::{BridgeEvent, BridgeId, Event, PeerEvent, PeerId};
use std::io::ErrorKind;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::io::AsyncWriteExt;
use tokio::net::TcpStream;
use tokio::sync::{Notify, watch};

/// How long the handshake may take.
const HANDSHAKE_WITHIN: Duration = Duration::from_secs(5);
/// How much is read at once.
const READ_BYTES: usize = 64 * 1024;

/// What is needed to serve connections of one socket.
#[derive(Clone)]
pub(super) struct Connection {
    core: Shared,
    bridge: BridgeId,
    socket: SocketType,
    endpoint: Arc<Endpoint>,
    paused: watch::Receiver<bool>,
}

impl Connection {
    pub(super) fn new(
        core: Shared,
        bridge: BridgeId,
        socket: SocketType,
        endpoint: Arc<Endpoint>,
        paused: watch::Receiver<bool>,
    ) -> Self {
        Self { core, bridge, socket, endpoint, paused }
    }

    /// The socket, for people.
    pub(super) fn name(&self) -> &'static str {
        self.socket.as_str()
    }

    /// Whether messages go out here.
    fn gives(&self) -> bool {
        matches!(self.socket, SocketType::Pub | SocketType::Push)
    }

    /// Serves one connection until it ends, and says why it did.
    ///
    /// # Errors
    /// Why there was no connection: the other end does not fit, or says nothing.
    pub(super) async fn run(&self, mut stream: TcpStream, from: SocketAddr) -> Result<String, String> {
        // Without this a message waits for the acknowledgement of the one before it.
        let _ = stream.set_nodelay(true);
        let mut reader = Reader::new(self.socket, self.endpoint.message_bytes_max);
        match tokio::time::timeout(HANDSHAKE_WITHIN, self.handshake(&mut stream, &mut reader)).await {
            Ok(done) => done?,
            Err(_) => return Err(format!("no handshake within {HANDSHAKE_WITHIN:?}")),
        }
        let (stream, blocked) = (Arc::new(stream), Arc::new(Notify::new()));
        let id = self.up(&stream, from, &blocked);
        let why = tokio::select! {
            why = self.clone().reading(id, reader, &stream) => why,
            why = writing(&self.core, self.bridge, id, &*stream, &blocked) => why,
        };
        let mut core = self.core.lock();
        core.peers().remove(self.bridge, id);
        core.handle(&mut vec![Event::Peer(self.bridge, id, PeerEvent::Down(why.clone()))]);
        Ok(why)
    }

    async fn handshake(&self, stream: &mut TcpStream, reader: &mut Reader) -> Result<(), String> {
        let text = |why: std::io::Error| why.to_string();
        stream.write_all(&GREETING).await.map_err(text)?;
        loop {
            match reader.next_item().map_err(|why| why.to_string())? {
                Some(Item::Greeted) => stream.write_all(&ready(self.socket)).await.map_err(text)?,
                Some(Item::Ready) => break,
                Some(_) => {}
                None => {
                    stream.readable().await.map_err(text)?;
                    match read(stream, reader) {
                        Ok(Some(0)) => return Err("it closed the connection".into()),
                        Ok(_) => {}
                        Err(why) => return Err(why.to_string()),
                    }
                }
            }
        }
        if let Sockets::SubscribePush { topics, .. } = &self.endpoint.sockets
            && self.socket == SocketType::Sub
        {
            for topic in topics {
                stream.write_all(&subscription(topic.as_bytes())).await.map_err(text)?;
            }
        }
        Ok(())
    }

    /// Tells the node of the peer.
    fn up(&self, stream: &Arc<TcpStream>, from: SocketAddr, blocked: &Arc<Notify>) -> PeerId {
        let name = format!("{from} ({})", self.socket.as_str());
        if matches!(self.endpoint.sockets, Sockets::SubscribePush { .. }) {
            tell(&self.core, self.bridge, BridgeEvent::Working(format!("{name} connected")));
        }
        let mut core = self.core.lock();
        let writer = Writer::new(self.endpoint.framing, self.endpoint.dialect);
        let (id, event) = if self.gives() {
            let form = match self.socket {
                SocketType::Pub => Form::Published(writer, Topics::default()),
                _ => Form::Pushed(writer),
            };
            let id = core.peers().add(self.bridge, stream.clone(), form, blocked.clone());
            (id, PeerEvent::Up(name, CREDIT))
        } else {
            (core.peers().number(), PeerEvent::Gives(name))
        };
        core.handle(&mut vec![Event::Peer(self.bridge, id, event)]);
        id
    }

    /// Reads until the connection ends; why it did.
    async fn reading(mut self, id: PeerId, mut reader: Reader, stream: &TcpStream) -> String {
        let mut events = Vec::new();
        loop {
            loop {
                match reader.next_item() {
                    Ok(None) => break,
                    Ok(Some(item)) => match self.take(id, item, stream) {
                        Ok(event) => events.extend(event),
                        Err(why) => return why,
                    },
                    Err(why) => {
                        let bad = PeerEvent::Bad(BadInput::Zmtp(why.clone()));
                        events.push(Event::Peer(self.bridge, id, bad));
                        self.core.lock().handle(&mut events);
                        return why.to_string();
                    }
                }
            }
            if !events.is_empty() {
                self.core.lock().handle(&mut events);
            }
            // Subscriptions are read even while messages must wait.
            if !self.gives() && self.paused.wait_for(|paused| !*paused).await.is_err() {
                return "the node ends".into();
            }
            if let Err(why) = stream.readable().await {
                return why.to_string();
            }
            match read(stream, &mut reader) {
                Ok(Some(0)) => return "it closed the connection".into(),
                Ok(_) => {}
                Err(why) => return why.to_string(),
            }
        }
    }

    /// What the node is told of an item; an error ends the connection.
    fn take(&self, id: PeerId, item: Item, stream: &TcpStream) -> Result<Option<Event>, String> {
        let subscribe = |topic: &[u8], wanted| {
            let subscribed = self.core.lock().peers().subscribe(self.bridge, id, topic, wanted);
            subscribed.map_err(|why| why.to_string())
        };
        let multipart = self.endpoint.framing == Framing::Multipart;
        let event = match item {
            Item::Subscribe(topic) => return subscribe(&topic, true).map(|()| None),
            Item::Cancel(topic) => return subscribe(&topic, false).map(|()| None),
            Item::Ping(context) => {
                self.pong(id, &context, stream);
                return Ok(None);
            }
            Item::Greeted | Item::Ready => return Ok(None),
            Item::Single(_) | Item::Several(_) | Item::TooLarge(_) if self.gives() => return Ok(None),
            Item::Single(message) if !multipart => PeerEvent::Message(message),
            Item::Several(frames) if multipart => PeerEvent::Parts(frames),
            Item::Single(_) => PeerEvent::Bad(BadInput::OneFrame),
            Item::Several(frames) => PeerEvent::Bad(BadInput::SeveralFrames(frames.len())),
            Item::TooLarge(declared) => {
                let limit = self.endpoint.message_bytes_max;
                PeerEvent::Bad(BadInput::TooLarge { declared, limit })
            }
        };
        Ok(Some(Event::Peer(self.bridge, id, event)))
    }

    /// Answers a sign of life. Where nothing else is written here, what the stream does not take at once is dropped whole.
    fn pong(&self, id: PeerId, context: &[u8], stream: &TcpStream) {
        let pong = pong(context);
        if self.gives() {
            self.core.lock().peers().insert(self.bridge, id, &pong);
        } else {
            let _ = stream.try_write(&pong);
        }
    }
}

/// Reads what is there; none when there is nothing after all.
fn read(stream: &TcpStream, reader: &mut Reader) -> std::io::Result<Option<usize>> {
    let buffer = reader.buffer();
    buffer.reserve(READ_BYTES);
    match stream.try_read_buf(buffer) {
        Ok(count) => Ok(Some(count)),
        Err(e) if e.kind() == ErrorKind::WouldBlock => Ok(None),
        Err(e) => Err(e),
    }
}
