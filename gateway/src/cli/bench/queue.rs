//! `aldis bench queue`: what a long queue for many vehicles takes in memory, and how soon it is there again after a restart.

use super::super::exit::Failure;
use super::super::print_line;
use super::journal::{Scratch, failed, resident_kib};
use crate::clock::Clock;
use crate::journal::{JournalThread, seed};
use aldis_envelope::{
    Address, BootId, ContentType, Descriptor, EntityId, Fleet, Label, Message, Monotonic, Now, Prefix,
    ServiceId, Source,
};
use aldis_services::journal::{JournalConfig, JournalEvent};
use aldis_services::link::export::{Export, Rule};
use aldis_services::link::{CarrierConfig, CarrierId, Class, LinkConfig, LinkSpec};
use aldis_services::{Effect, Event, Input, Node, NodeConfig, Outbox, Service, ServiceSpec};
use bytes::Bytes;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// The first vehicle's entity; the others follow.
const FIRST: u64 = 400;
/// How many commands are offered in one turn of the node.
const AT_ONCE: u64 = 1_000;
/// The bytes of a command.
const BYTES: usize = 64;

/// Commands that wait for vehicles that are not heard: the memory of the process that has them, and a restart with them.
///
/// One process fills the queue, on a real disk, and is killed; another opens it. Its memory is told without the bytes of the commands.
#[derive(clap::Args)]
pub(super) struct QueueBench {
    /// Commands.
    #[arg(long, default_value_t = 1_000_000)]
    messages: u64,
    /// Vehicles, each behind a link of its own.
    #[arg(long, default_value_t = 100)]
    vehicles: u64,
    /// Where to write. Default: the directory for temporary files.
    #[arg(long)]
    directory: Option<PathBuf>,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

impl QueueBench {
    pub(super) fn run(self) -> Result<(), Failure> {
        let base = self.directory.clone().unwrap_or_else(std::env::temp_dir);
        let scratch = Scratch(base.join(format!("aldis-bench-queue-{}", std::process::id())));
        let filled = self.other(&scratch.0, self.messages)?;
        let opened = self.other(&scratch.0, 0)?;
        let beside = |told: &Value| {
            let resident = told["resident_kib"].as_f64().unwrap_or_default() / 1024.0;
            ((resident - told["bytes"].as_f64().unwrap_or_default() / 1_048_576.0) * 10.0).round() / 10.0
        };
        let result = json!({
            "messages": opened["commands"], "vehicles": self.vehicles, "resident_mib": beside(&opened),
            "resident_filling_mib": beside(&filled), "restart_s": opened["seconds"], "filled_s": filled["seconds"],
            "queue_mib": (opened["bytes"].as_f64().unwrap_or_default() / 104_857.6).round() / 10.0,
            "whole": opened["commands"] == self.messages,
        });
        print_line(if self.json { result.to_string() } else { format!("{result:#}") });
        Ok(())
    }

    /// Another process opens the queue, and fills it with so many more.
    fn other(&self, directory: &Path, fill: u64) -> Result<Value, Failure> {
        let program = std::env::current_exe().map_err(failed)?;
        let mut command = Command::new(program);
        command.args(["bench", "queue-peer"]).arg(directory);
        command.args(["--fill", &fill.to_string(), "--vehicles", &self.vehicles.to_string()]);
        let output = command.stdin(Stdio::null()).stderr(Stdio::inherit()).output().map_err(failed)?;
        serde_json::from_slice(&output.stdout).map_err(failed)
    }
}

/// The other process of `bench queue`.
#[derive(clap::Args)]
pub(super) struct QueuePeer {
    directory: PathBuf,
    #[arg(long)]
    fill: u64,
    #[arg(long)]
    vehicles: u64,
}

/// Offers commands as fast as the journal takes them.
struct Filler {
    labels: Vec<Arc<Label>>,
    left: u64,
    next: Option<Monotonic>,
}

impl Service for Filler {
    fn handle(&mut self, now: Now, _: Input<'_>, out: &mut Outbox) {
        for _ in 0..self.left.min(AT_ONCE) {
            let label = &self.labels[(self.left % self.labels.len() as u64) as usize];
            let mut content = vec![0x5a; BYTES];
            content[..8].copy_from_slice(&self.left.to_be_bytes());
            out.send(Message::new(label.clone(), Bytes::from(content)));
            self.left -= 1;
        }
        self.next = (self.left > 0).then(|| now.monotonic + Duration::from_nanos(1));
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.next
    }
}

impl QueuePeer {
    pub(super) fn run(self) -> Result<(), Failure> {
        let begin = Instant::now();
        let (tell, told) = channel();
        let config = JournalConfig { limit_bytes: 8 << 30, ..JournalConfig::new(seed()) };
        let journal = JournalThread::start(&self.directory, config, move |events: &mut Vec<JournalEvent>| {
            // Nobody listens any more where the measurement has ended.
            let _ = tell.send(std::mem::take(events));
        });
        let node = Node::new(self.config()?).map_err(Failure::Failed)?.with_journal();
        let mut shell = Shell {
            node,
            journal: journal.map_err(failed)?,
            told,
            clock: Clock::start(),
            appended: 0,
            written: 0,
        };
        let before = resident_kib();
        shell.start()?;
        for _ in 0..self.fill.div_ceil(AT_ONCE) {
            shell.turn(Event::Deadline)?;
        }
        let seconds = begin.elapsed().as_secs_f64();
        let (commands, bytes) = shell.node.queued_commands();
        print_line(json!({
            "commands": commands, "bytes": bytes, "resident_kib": resident_kib(), "resident_before_kib": before,
            "seconds": (seconds * 1e3).round() / 1e3,
        }));
        // As a kill would end it: nothing is closed.
        std::process::exit(0)
    }

    fn config(&self) -> Result<NodeConfig, Failure> {
        let entity = |number: u64| EntityId::new(number).map_err(failed);
        let service = |number: u64| ServiceId::new(number).map_err(failed);
        let own = Source::new(entity(1)?, service(100)?);
        let (mut links, mut labels) = (Vec::new(), Vec::new());
        for vehicle in FIRST..FIRST + self.vehicles.max(1) {
            let peer = entity(vehicle)?;
            let carrier = CarrierConfig {
                id: CarrierId(0),
                rate: 1_200,
                mtu: 256,
                round_trip: Duration::from_millis(600),
                loss: 0.3,
            };
            let rule =
                Rule { address: Prefix::new(&format!("eid{vehicle}")).ok(), ..Rule::new("", Class::Command) };
            links.push(LinkSpec {
                name: format!("vehicle-{vehicle}"),
                link: LinkConfig::new(own.entity, peer, vec![carrier]),
                export: Export { behind: [peer].into(), rules: vec![rule] },
            });
            let to = Address::Service(Source::new(peer, own.service));
            let order = Descriptor::new("bench.Order").map_err(failed)?;
            labels.push(Arc::new(Label::limitedcast(to, ContentType::Cdr, order, own)));
        }
        let left = self.fill;
        let make =
            move || -> Box<dyn Service> { Box::new(Filler { labels: labels.clone(), left, next: None }) };
        let filler = ServiceSpec { source: own, name: "filler".into(), factory: Arc::new(make) };
        Ok(NodeConfig {
            fleet: Fleet::new("bench").map_err(failed)?,
            entities: vec![own.entity],
            boot: BootId(1),
            operators: Vec::new(),
            allow: Vec::new(),
            import: Vec::new(),
            export: Vec::new(),
            topics: Vec::new(),
            reliable: true,
            services: if self.fill > 0 { vec![filler] } else { Vec::new() },
            bridges: Vec::new(),
            links,
        })
    }
}

/// A node with its journal, and nothing else of a shell.
struct Shell {
    node: Node,
    journal: JournalThread,
    told: Receiver<Vec<JournalEvent>>,
    clock: Clock,
    appended: u64,
    written: u64,
}

impl Shell {
    /// Until the journal is read back and the node has started.
    fn start(&mut self) -> Result<(), Failure> {
        self.handle(&mut Vec::new());
        let mut started = false;
        while !started || self.written < self.appended {
            started |= self.take()?;
        }
        Ok(())
    }

    /// Gives the node an event, and waits until what came of it is on disk.
    fn turn(&mut self, event: Event) -> Result<(), Failure> {
        self.handle(&mut vec![event]);
        while self.written < self.appended {
            self.take()?;
        }
        Ok(())
    }

    fn handle(&mut self, events: &mut Vec<Event>) {
        let mut effects = Vec::new();
        self.node.handle(self.clock.now(), events, &mut effects);
        for effect in effects {
            if let Effect::Append(number, batch) = effect {
                self.appended = number;
                self.journal.hand_over(batch);
            }
        }
    }

    /// Takes what the journal tells; whether it was the end of what it held.
    fn take(&mut self) -> Result<bool, Failure> {
        let told = self.told.recv().map_err(failed)?;
        let mut is_end = false;
        for event in &told {
            match event {
                JournalEvent::Written { up_to } => self.written = *up_to,
                JournalEvent::Refused { reason, .. } => return Err(failed(reason)),
                JournalEvent::Unusable(why) => return Err(failed(why)),
                JournalEvent::RecoveredAll(_) => is_end = true,
                _ => {}
            }
        }
        self.handle(&mut told.into_iter().map(Event::Journal).collect());
        Ok(is_end)
    }
}
