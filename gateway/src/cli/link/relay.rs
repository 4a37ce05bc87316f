//! A relay of datagrams on this machine that does to them what a bad link would: the emulator of the simulator, on real sockets.

use aldis_envelope::Monotonic;
use aldis_services::sim::link::{Profile, Way};
use std::collections::BTreeMap;
use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// The longest wait for a datagram, so that the end is noticed.
const WAIT_MAX: Duration = Duration::from_millis(50);
/// Nearer than this, what is due is waited for without sleep: the machine's timers are no finer.
const WAIT_MIN: Duration = Duration::from_micros(100);

/// What passed a relay.
#[derive(Debug, Default)]
pub(crate) struct Passed {
    /// Datagrams that came, from the first end and from the second.
    pub(crate) came: [AtomicU64; 2],
    /// Their bytes.
    pub(crate) bytes: [AtomicU64; 2],
    /// Those that did not go on.
    pub(crate) lost: [AtomicU64; 2],
}

/// A relay between two ends.
pub(crate) struct Relay {
    socket: UdpSocket,
    /// Where the ends are; the second may be found where datagrams come from.
    first: SocketAddr,
    second: Option<SocketAddr>,
    ways: [Way; 2],
    outage: Option<Duration>,
    random: fastrand::Rng,
    next_turn: Option<Instant>,
    start: Instant,
    due: BTreeMap<(Monotonic, u64), (SocketAddr, Vec<u8>)>,
    number: u64,
    /// Nothing passes, whatever the profile says.
    cut: Arc<AtomicBool>,
    passed: Arc<Passed>,
}

/// A relay on a thread of its own; it ends when this is dropped.
pub(crate) struct Running {
    stop: Arc<AtomicBool>,
    cut: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    /// Where it listens.
    pub(crate) address: SocketAddr,
}

impl Running {
    /// Cuts the link both ways, or mends it.
    pub(crate) fn cut(&self, cut: bool) {
        self.cut.store(cut, Ordering::Relaxed);
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A panic of the thread was reported when it happened.
            let _ = thread.join();
        }
    }
}

impl Relay {
    /// A relay that listens at an address.
    ///
    /// # Errors
    /// What the system says of the socket.
    pub(crate) fn new(
        profile: &Profile,
        seed: u64,
        listen: SocketAddr,
        (first, second): (SocketAddr, Option<SocketAddr>),
    ) -> io::Result<Self> {
        let socket = UdpSocket::bind(listen)?;
        let way = |end: u64| Way::new(profile.clone(), seed.wrapping_mul(2).wrapping_add(end));
        Ok(Self {
            socket,
            first,
            second,
            ways: [way(0), way(1)],
            outage: profile.outage,
            random: fastrand::Rng::with_seed(seed),
            next_turn: None,
            start: Instant::now(),
            due: BTreeMap::new(),
            number: 0,
            cut: Arc::default(),
            passed: Arc::default(),
        })
    }

    /// Where it listens.
    pub(crate) fn address(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    pub(crate) fn passed(&self) -> Arc<Passed> {
        self.passed.clone()
    }

    /// Runs on a thread of its own.
    ///
    /// # Errors
    /// What the system says of the socket or the thread.
    pub(crate) fn spawn(mut self) -> io::Result<Running> {
        let address = self.address()?;
        let (stop, cut) = (Arc::new(AtomicBool::new(false)), self.cut.clone());
        let asked = stop.clone();
        let run = move || {
            if let Err(why) = self.run(|| asked.load(Ordering::Relaxed)) {
                tracing::error!("the relay at {address} ended: {why}");
            }
        };
        let thread = Some(std::thread::Builder::new().name("relay".into()).spawn(run)?);
        Ok(Running { stop, cut, thread, address })
    }

    /// Relays until it is to stop.
    ///
    /// # Errors
    /// What the system says of the socket.
    pub(crate) fn run(&mut self, stop: impl Fn() -> bool) -> io::Result<()> {
        let mut buffer = vec![0; 65_535];
        while !stop() {
            self.outages();
            self.send_due();
            let now = self.now();
            let wait = self.due.first_key_value().map_or(WAIT_MAX, |((at, _), _)| (*at - now).min(WAIT_MAX));
            if wait < WAIT_MIN {
                continue;
            }
            self.socket.set_read_timeout(Some(wait))?;
            match self.socket.recv_from(&mut buffer) {
                Ok((length, from)) => self.take(from, &buffer[..length]),
                Err(why) if matches!(why.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {}
                // An end whose port is closed: it may be opened yet.
                Err(why)
                    if matches!(
                        why.kind(),
                        io::ErrorKind::ConnectionRefused | io::ErrorKind::Interrupted
                    ) => {}
                Err(why) => return Err(why),
            }
        }
        Ok(())
    }

    fn now(&self) -> Monotonic {
        Monotonic::since_start(self.start.elapsed())
    }

    fn take(&mut self, from: SocketAddr, bytes: &[u8]) {
        let end = usize::from(from != self.first);
        if end == 1 {
            self.second = Some(from);
        }
        let now = self.now();
        let arrivals = self.ways[end].send(now, bytes.len());
        let is_cut = self.cut.load(Ordering::Relaxed);
        self.passed.came[end].fetch_add(1, Ordering::Relaxed);
        self.passed.bytes[end].fetch_add(bytes.len() as u64, Ordering::Relaxed);
        self.passed.lost[end].store(self.ways[end].lost, Ordering::Relaxed);
        let Some(to) = (if end == 0 { self.second } else { Some(self.first) }) else { return };
        for at in arrivals.into_iter().filter(|_| !is_cut) {
            self.number += 1;
            self.due.insert((at, self.number), (to, bytes.to_vec()));
        }
    }

    fn send_due(&mut self) {
        let now = self.now();
        while let Some(first) = self.due.first_entry().filter(|first| first.key().0 <= now) {
            let (to, bytes) = first.remove();
            // What cannot be sent is lost, as on any bad link.
            let _ = self.socket.send_to(&bytes, to);
        }
    }

    /// Profiles with outages are cut half of the time, for times that are drawn around their mean.
    fn outages(&mut self) {
        let Some(mean) = self.outage else { return };
        let now = Instant::now();
        if self.next_turn.is_none_or(|at| at <= now) {
            let cut = self.next_turn.is_some() && !self.ways[0].cut;
            self.ways.iter_mut().for_each(|way| way.cut = cut);
            self.next_turn = Some(now + mean.mul_f64(0.5 + self.random.f64()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn datagrams_go_to_the_other_end_late_and_not_all() {
        let ends = [0, 1].map(|_| UdpSocket::bind("127.0.0.1:0").unwrap());
        let address = |end: usize| ends[end].local_addr().unwrap();
        let delay = Duration::from_millis(30);
        let profile = Profile { delay, rate: 1_000_000, queue: 100_000, ..Profile::L1 };
        let relay = Relay::new(&profile, 3, "127.0.0.1:0".parse().unwrap(), (address(0), None)).unwrap();
        let passed = relay.passed();
        let relay = relay.spawn().unwrap();
        let start = Instant::now();
        // The second end is found by what it sends.
        ends[1].send_to(b"hello", relay.address).unwrap();
        for number in 0..100_u8 {
            ends[1].send_to(&[number], relay.address).unwrap();
        }
        let receive = |end: usize| {
            ends[end].set_read_timeout(Some(Duration::from_secs(1))).unwrap();
            let mut buffer = [0; 16];
            let mut got = Vec::new();
            while let Ok((length, _)) = ends[end].recv_from(&mut buffer) {
                got.push(buffer[..length].to_vec());
                if got.len() == 1 {
                    assert!(start.elapsed() >= delay);
                }
            }
            got
        };
        let got = receive(0);
        assert!((50..90).contains(&got.len()), "{} of 101 at 30 % loss", got.len());
        ends[0].send_to(b"back", relay.address).unwrap();
        ends[0].send_to(b"back", relay.address).unwrap();
        ends[0].send_to(b"back", relay.address).unwrap();
        assert!(receive(1).iter().all(|back| back == b"back"));
        assert_eq!(passed.came[1].load(Ordering::Relaxed), 101);
    }
}
