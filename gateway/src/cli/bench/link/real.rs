//! Commands between real processes through a relay that is as bad as a link, and the same over plain Zenoh through the same relay.

use super::super::child::{Process, free_port};
use super::super::statistics::{percentile, rounded};
use super::plain;
use crate::cli::exit::Failure;
use crate::cli::link::relay::{Passed, Relay, Running};
use aldis_envelope::codec::stream::{Item, Reader, Writer};
use aldis_envelope::{ContentType, Dialect, EntityId, Label, Name, ServiceId, Source};
use aldis_services::sim::link::Profile;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream, UdpSocket};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// What is sent.
const TOPIC: &str = "bench.Order";
/// The bytes of a command.
pub(super) const BYTES: usize = 64;
/// How long a command is worth carrying, and how long those on their way are waited for at the end.
pub(super) const LIFESPAN: Duration = Duration::from_secs(60);
/// How long the two ends may take to meet.
pub(super) const MEET_WITHIN: Duration = Duration::from_secs(60);

/// What is measured.
#[derive(Debug, Clone)]
pub(super) struct Real {
    pub(super) profile: Profile,
    pub(super) seconds: u64,
    pub(super) rate: f64,
    pub(super) seed: u64,
}

/// Commands that were sent and came.
#[derive(Debug, Default)]
pub(super) struct Score {
    sent: BTreeMap<u64, Instant>,
    latency: Vec<Duration>,
    seen: BTreeMap<u64, u64>,
    last: u64,
    reordered: u64,
}

impl Score {
    /// The content of the next command.
    pub(super) fn next(&mut self) -> [u8; BYTES] {
        let number = self.sent.len() as u64 + 1;
        self.sent.insert(number, Instant::now());
        let mut content = [0x5a; BYTES];
        content[..8].copy_from_slice(&number.to_be_bytes());
        content
    }

    /// A command came.
    pub(super) fn came(&mut self, content: &[u8]) {
        let Some(number) = content.first_chunk::<8>().map(|number| u64::from_be_bytes(*number)) else {
            return;
        };
        let Some(sent) = self.sent.get(&number) else { return };
        let times = self.seen.entry(number).or_default();
        *times += 1;
        if *times == 1 {
            self.latency.push(sent.elapsed());
            self.reordered += u64::from(number < self.last);
            self.last = number.max(self.last);
        }
    }

    /// Whether all that was sent has come.
    pub(super) fn is_whole(&self) -> bool {
        self.seen.len() == self.sent.len()
    }

    pub(super) fn object(mut self, bytes: u64) -> Value {
        let mut at = |share| rounded(percentile(&mut self.latency, share).as_secs_f64());
        let (p50, p99) = (at(0.5), at(0.99));
        json!({
            "sent": self.sent.len(), "delivered": self.seen.len(),
            "duplicates": self.seen.values().map(|times| times - 1).sum::<u64>(), "reordered": self.reordered,
            "p50_s": p50, "p99_s": p99,
            "wire_bytes_per_command": (bytes as f64 / self.sent.len().max(1) as f64).round(),
        })
    }
}

pub(super) fn failed(why: impl std::fmt::Display) -> Failure {
    Failure::Failed(why.to_string())
}

/// A relay on its way, with what passed it.
pub(super) fn relay(real: &Real, mtu: usize, first: SocketAddr) -> Result<(Running, Arc<Passed>), Failure> {
    let here = SocketAddr::from(([127, 0, 0, 1], 0));
    let profile = Profile { mtu: mtu.max(real.profile.mtu), ..real.profile.clone() };
    let relay = Relay::new(&profile, real.seed, here, (first, None)).map_err(failed)?;
    let passed = relay.passed();
    Ok((relay.spawn().map_err(failed)?, passed))
}

pub(super) fn bytes(passed: &Passed) -> u64 {
    passed.bytes.iter().map(|bytes| bytes.load(Ordering::Relaxed)).sum()
}

/// An address that nobody uses now.
pub(super) fn free_address() -> Result<SocketAddr, Failure> {
    UdpSocket::bind("127.0.0.1:0").and_then(|socket| socket.local_addr()).map_err(failed)
}

impl Real {
    /// Sends at the rate, and has what came counted meanwhile, until all is there or too late.
    pub(super) fn pace(
        &self,
        score: &mut Score,
        mut send: impl FnMut(&[u8]) -> Result<(), Failure>,
        mut receive: impl FnMut(&mut Score, Duration) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let (start, gap) = (Instant::now(), Duration::from_secs_f64(1.0 / self.rate));
        let count = (self.seconds as f64 * self.rate).ceil().max(1.0) as u32;
        for number in 0..count {
            let due = start + gap * number;
            while let Some(wait) = due.checked_duration_since(Instant::now()) {
                receive(score, wait.min(Duration::from_millis(20)).max(Duration::from_micros(100)))?;
            }
            let content = score.next();
            send(&content)?;
        }
        let end = Instant::now() + LIFESPAN;
        while !score.is_whole() && Instant::now() < end {
            receive(score, Duration::from_millis(20))?;
        }
        Ok(())
    }

    /// The same load over our link, and over plain Zenoh where that is asked for.
    pub(super) fn run(&self, against: Option<&str>) -> Result<Value, Failure> {
        against.map_or(Ok(()), plain::check)?;
        let mut result = json!({
            "profile": self.profile.name, "seconds": self.seconds, "rate": self.rate, "seed": self.seed,
            "aldis": self.aldis()?,
        });
        if let Some(against) = against {
            result[against] = plain::run(self)?;
        }
        Ok(result)
    }

    /// Two nodes as processes with a link between them; a UxAS on either side sends and receives.
    fn aldis(&self) -> Result<Value, Failure> {
        let files = Files::new()?;
        let (listen, ports) = (free_address()?, [free_port()?, free_port()?]);
        let (relay, passed) = relay(self, 0, listen)?;
        let far = free_address()?;
        let shore = files.node(self, 1, 400, (listen, relay.address), ports[0])?;
        let vehicle = files.node(self, 400, 1, (far, relay.address), ports[1])?;
        let start = |path: PathBuf| Process::start(&["run", &path.display().to_string()]);
        let _nodes = [start(shore)?, start(vehicle)?];
        let [mut from, mut to] = [Uxas::connect(ports[0])?, Uxas::connect(ports[1])?];
        // The two ends meet, and what has no number is not counted.
        let met = Instant::now() + MEET_WITHIN;
        while to.receive(Duration::from_millis(500))?.is_empty() {
            if Instant::now() > met {
                return Err(Failure::Failed("the two ends of the link do not meet".into()));
            }
            from.send(&[0; BYTES])?;
        }
        while !to.receive(Duration::from_secs(3))?.is_empty() {}
        let before = bytes(&passed);
        let mut score = Score::default();
        self.pace(
            &mut score,
            |content| from.send(content),
            |score, wait| {
                to.receive(wait)?.iter().for_each(|content| score.came(content));
                Ok(())
            },
        )?;
        Ok(score.object(bytes(&passed) - before))
    }
}

/// Files that go with the measurement.
struct Files(PathBuf);

impl Files {
    fn new() -> Result<Self, Failure> {
        let path = std::env::temp_dir().join(format!("aldis-bench-link-{}", std::process::id()));
        std::fs::create_dir_all(&path).map_err(failed)?;
        Ok(Self(path))
    }

    fn node(
        &self,
        real: &Real,
        own: u64,
        peer: u64,
        (listen, to): (SocketAddr, SocketAddr),
        uxas: u16,
    ) -> Result<PathBuf, Failure> {
        let Profile { rate, mtu, loss, .. } = &real.profile;
        let (round_trip, loss) = (real.profile.round_trip().as_millis().max(1), loss * 100.0);
        let mut text = format!(
            "name = \"bench-{own}\"\nfleet = \"bench\"\nentities = [{own}]\n[bus]\nmode = \"peer\"\n[log]\nlevel = \"warn\"\n\
             [journal]\npath = \"kept-{own}\"\n[[bridge]]\nkind = \"uxas-tcp\"\nname = \"uxas\"\nservice = 20\n\
             listen = \"127.0.0.1:{uxas}\"\nimport = [\"{TOPIC}\"]\nexport = [\"{TOPIC}\"]\n"
        );
        let written = write!(
            text,
            "[[link]]\nname = \"link\"\npeer = {peer}\n[[link.carrier]]\nkind = \"udp\"\nlisten = \"{listen}\"\npeer = \"{to}\"\n\
             rate_bytes_per_s = {rate}\nmtu = {mtu}\nround_trip_ms = {round_trip}\nloss_percent = {loss:.0}\n\
             [[link.rule]]\ndescriptor = \"{TOPIC}\"\nclass = \"command\"\nlifespan_s = {}\n",
            LIFESPAN.as_secs()
        );
        let path = self.0.join(format!("{own}.toml"));
        written.map_err(failed)?;
        std::fs::write(&path, text).map_err(failed)?;
        Ok(path)
    }
}

impl Drop for Files {
    fn drop(&mut self) {
        // What is left behind in the directory for temporary files does no harm.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A UxAS at a bridge.
struct Uxas {
    stream: TcpStream,
    reader: Reader,
    writer: Writer,
    label: Arc<Label>,
}

impl Uxas {
    fn connect(port: u16) -> Result<Self, Failure> {
        let until = Instant::now() + MEET_WITHIN;
        let source =
            EntityId::new(1).and_then(|entity| ServiceId::new(61).map(|own| Source::new(entity, own)));
        let name = Name::new(TOPIC).map_err(failed)?;
        let label = Arc::new(Label::broadcast(ContentType::Lmcp, name, source.map_err(failed)?));
        loop {
            match TcpStream::connect(("127.0.0.1", port)) {
                Ok(stream) => {
                    stream.set_nodelay(true).map_err(failed)?;
                    let (reader, writer) = (Reader::new(1 << 20), Writer::new(Dialect::OpenUxas));
                    return Ok(Self { stream, reader, writer, label });
                }
                Err(why) if Instant::now() > until => return Err(failed(why)),
                Err(_) => std::thread::park_timeout(Duration::from_millis(50)),
            }
        }
    }

    fn send(&mut self, content: &[u8]) -> Result<(), Failure> {
        let mut frame = Vec::new();
        self.writer.write(&self.label, content, &mut frame);
        self.stream.write_all(&frame).map_err(failed)
    }

    /// The contents that come within a time; as soon as there are some.
    fn receive(&mut self, within: Duration) -> Result<Vec<Vec<u8>>, Failure> {
        let mut contents = Vec::new();
        self.stream.set_read_timeout(Some(within)).map_err(failed)?;
        let mut piece = [0; 16_384];
        match self.stream.read(&mut piece) {
            Ok(0) => return Err(Failure::Failed("a node has closed its bridge".into())),
            Ok(count) => self.reader.buffer().extend_from_slice(&piece[..count]),
            Err(why)
                if matches!(why.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut) => {}
            Err(why) => return Err(failed(why)),
        }
        while let Some(item) = self.reader.next_item() {
            if let Item::Message(message) = item {
                let content = message.len().checked_sub(BYTES).map(|start| message[start..].to_vec());
                contents.extend(content);
            }
        }
        Ok(contents)
    }
}
