//! Frames as datagrams of UDP. One socket may serve many links: who sent a frame is told by its address, or by its hello.

use super::Outgoing;
use crate::runtime::Shared;
use aldis_envelope::EntityId;
use aldis_services::link::{CarrierId, sender_of};
use aldis_services::{Event, LinkEvent, LinkId, Place};
use bytes::Bytes;
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::net::UdpSocket;

/// How long to wait before a socket is opened again that could not be.
const RETRY: Duration = Duration::from_secs(2);
/// The longest datagram there is.
const DATAGRAM_MAX: usize = 65_535;
/// How many datagrams are handed to the node at once.
const AT_ONCE: usize = 64;
/// How many addresses are remembered by number. Strangers make up addresses; those of peers are found again.
const PLACES_MAX: usize = 1_024;

/// One carrier of a link at a socket.
#[derive(Debug, Clone)]
pub(crate) struct End {
    pub(crate) link: LinkId,
    pub(crate) carrier: CarrierId,
    /// The entity at the other end.
    pub(crate) entity: EntityId,
    /// Where it is, as configured.
    pub(crate) address: Option<SocketAddr>,
    pub(crate) mtu: usize,
}

/// A socket with the carriers that use it.
#[derive(Debug, Clone)]
pub(crate) struct Port {
    pub(crate) listen: SocketAddr,
    pub(crate) ends: Vec<End>,
}

/// The addresses met, by number.
#[derive(Debug, Default)]
struct Places {
    numbers: BTreeMap<SocketAddr, u64>,
    addresses: BTreeMap<u64, SocketAddr>,
    next: u64,
    /// Where peers are.
    peers: BTreeMap<SocketAddr, usize>,
}

impl Places {
    fn number(&mut self, address: SocketAddr) -> Place {
        if let Some(&number) = self.numbers.get(&address) {
            return Place(number);
        }
        if self.numbers.len() >= PLACES_MAX {
            let peers = &self.peers;
            self.numbers.retain(|address, _| peers.contains_key(address));
            self.addresses.retain(|_, address| peers.contains_key(address));
        }
        self.next += 1;
        self.numbers.insert(address, self.next);
        self.addresses.insert(self.next, address);
        Place(self.next)
    }
}

fn lock(places: &Mutex<Places>) -> MutexGuard<'_, Places> {
    places.lock().unwrap_or_else(PoisonError::into_inner)
}

struct Sender {
    socket: Arc<UdpSocket>,
    places: Arc<Mutex<Places>>,
    end: usize,
    to: Option<SocketAddr>,
}

impl Outgoing for Sender {
    fn send(&mut self, frame: &[u8]) {
        if let Some(to) = self.to
            && let Err(why) = self.socket.try_send_to(frame, to)
        {
            tracing::debug!("udp: a frame to {to} is dropped: {why}");
        }
    }

    fn found(&mut self, place: Place) {
        let mut places = lock(&self.places);
        if let Some(&address) = places.addresses.get(&place.0) {
            places.peers.retain(|_, end| *end != self.end);
            places.peers.insert(address, self.end);
            self.to = Some(address);
        }
    }
}

/// Serves a socket until the node ends: opens it, again where that fails, and hands frames in.
pub(crate) async fn serve(core: Shared, port: Port) {
    loop {
        match UdpSocket::bind(port.listen).await {
            Ok(socket) => {
                let why = receive(&core, &port, Arc::new(socket)).await;
                down(&core, &port, &why.to_string());
            }
            Err(why) => down(&core, &port, &format!("udp {}: {why}", port.listen)),
        }
        tokio::time::sleep(RETRY).await;
    }
}

fn down(core: &Shared, port: &Port, why: &str) {
    let mut core = core.lock();
    let mut events = Vec::new();
    for end in &port.ends {
        core.carriers().remove(end.link, end.carrier);
        events.push(Event::Link(end.link, LinkEvent::Down(end.carrier, why.to_owned())));
    }
    core.handle(&mut events);
}

/// Receives until the socket fails.
async fn receive(core: &Shared, port: &Port, socket: Arc<UdpSocket>) -> std::io::Error {
    let places = Arc::new(Mutex::new(Places::default()));
    let known = port.ends.iter().enumerate().filter_map(|(place, end)| Some((end.address?, place)));
    lock(&places).peers.extend(known);
    up(core, port, &socket, &places);
    let mut buffer = vec![0; DATAGRAM_MAX];
    let mut events = Vec::new();
    loop {
        if let Err(why) = socket.readable().await {
            return why;
        }
        while events.len() < AT_ONCE {
            match socket.try_recv_from(&mut buffer) {
                Ok((length, from)) => events.extend(frame(port, &mut lock(&places), from, &buffer[..length])),
                Err(why) if why.kind() == std::io::ErrorKind::WouldBlock => break,
                // What an earlier datagram met on its way, such as a port that nobody listens on.
                Err(_) => continue,
            }
        }
        if !events.is_empty() {
            core.lock().handle(&mut events);
            // A flood at one socket is not to keep the others waiting.
            tokio::task::yield_now().await;
        }
    }
}

fn up(core: &Shared, port: &Port, socket: &Arc<UdpSocket>, places: &Arc<Mutex<Places>>) {
    let mut core = core.lock();
    let mut events = Vec::new();
    for (place, end) in port.ends.iter().enumerate() {
        let sender = Sender { socket: socket.clone(), places: places.clone(), end: place, to: end.address };
        core.carriers().set(end.link, end.carrier, Box::new(sender));
        events.push(Event::Link(end.link, LinkEvent::Up(end.carrier, end.mtu)));
    }
    core.handle(&mut events);
}

/// Whose frame it is. What a hello says goes before where it comes from: a peer may have taken another's address. None for what
/// nobody here waits for.
fn frame(port: &Port, places: &mut Places, from: SocketAddr, bytes: &[u8]) -> Option<Event> {
    let named =
        sender_of(bytes).and_then(|(sender, _)| port.ends.iter().position(|end| end.entity == sender));
    let known = || places.peers.get(&from).copied();
    let alone = || (port.ends.len() == 1).then_some(0);
    let end = &port.ends[named.or_else(known).or_else(alone)?];
    let place = places.number(from);
    Some(Event::Link(end.link, LinkEvent::Frame(end.carrier, place, Bytes::copy_from_slice(bytes))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(port: u16) -> SocketAddr {
        SocketAddr::from(([127, 0, 0, 1], port))
    }

    fn end(link: usize, entity: u64, address: Option<SocketAddr>) -> End {
        let (link, carrier) = (LinkId(link), CarrierId(0));
        End { link, carrier, entity: EntityId::new(entity).unwrap(), address, mtu: 256 }
    }

    fn link_of(event: Option<Event>) -> Option<(usize, Place)> {
        match event {
            Some(Event::Link(link, LinkEvent::Frame(_, place, _))) => Some((link.0, place)),
            _ => None,
        }
    }

    #[test]
    fn an_address_tells_whose_frame_it_is_and_strangers_are_forgotten() {
        let ends = vec![end(0, 400, Some(address(1))), end(1, 401, None)];
        let port = Port { listen: address(9), ends };
        let mut places = Places::default();
        places.peers.insert(address(1), 0);
        let known = link_of(frame(&port, &mut places, address(1), b"x")).unwrap();
        assert_eq!(known.0, 0);
        assert_eq!(link_of(frame(&port, &mut places, address(2), b"x")), None, "nobody's");
        let alone = Port { ends: vec![end(1, 401, None)], ..port.clone() };
        for number in 10..3_000 {
            assert!(link_of(frame(&alone, &mut places, address(number), b"x")).is_some());
        }
        assert!(places.numbers.len() <= PLACES_MAX && places.addresses.len() == places.numbers.len());
        assert_eq!(link_of(frame(&port, &mut places, address(1), b"y")), Some(known));
    }
}
