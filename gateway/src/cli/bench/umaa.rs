//! `aldis bench umaa`: what UMAA's flow control costs on top of Zenoh, and what a retained instance costs in memory.

use super::super::exit::Failure;
use super::super::print_line;
use super::bus::RawTrips;
use super::child::{Process, free_port};
use super::service_node::{configuration, label, member, source};
use super::statistics::{median, percentile, rounded};
use crate::cli::member::Member;
use crate::runtime;
use aldis_envelope::umaa::{
    Command, CommandState, ResourceAllocationCommand, ResourceAllocationPriorityCommand, Sequence,
};
use aldis_envelope::{
    DateTime, EntityId, Fleet, Guid, GuidForm, Guids, Instance, Label, Message, Monotonic, Now, Prefix,
    ServiceId, Source,
};
use aldis_services::umaa::command::{Consumer, ConsumerSettings, Outcome, Told};
use aldis_services::{Input, Outbox, Service, ServiceSpec};
use serde_json::json;
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

/// How long a measurement may take.
const PATIENCE: Duration = Duration::from_secs(60);
/// The arbiter's resource.
const RESOURCE: &str = "autopilot";
/// The entity of the arbiter's process.
const ARBITER: u64 = 2;

/// UMAA's flow control and retained instances, beside raw Zenoh.
///
/// A round trip is from a command that goes out to its status EXECUTING, the provider in another process; raw is one message of the
/// same size there and one back. An allocation is asked for, confirmed by its readers, given, and given back.
#[derive(clap::Args)]
pub(super) struct UmaaBench {
    /// Commands in each round.
    #[arg(long, default_value_t = 2_000)]
    commands: u64,
    /// Rounds.
    #[arg(long, default_value_t = 5)]
    rounds: u32,
    /// Instances retained for the measurement of memory.
    #[arg(long, default_value_t = 100_000)]
    instances: u64,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

/// The provider of `bench umaa`.
#[derive(clap::Args)]
pub(super) struct UmaaPeer {
    #[arg(long)]
    connect: String,
}

fn guids() -> Result<Guids, Failure> {
    let fleet = Fleet::new("bench").map_err(|why| Failure::Failed(why.to_string()))?;
    Ok(Guids::new(&fleet, GuidForm::Readable))
}

fn entity(number: u64) -> Result<EntityId, Failure> {
    EntityId::new(number).map_err(|why| Failure::Failed(why.to_string()))
}

/// Sends one command after the other: the next goes out when the one before has been cleaned up.
struct Repeating<C: Command> {
    consumer: Consumer<C>,
    command: C,
    destination: Guid,
    left: u64,
    session: Option<Guid>,
    sent: Instant,
    trips: Vec<Duration>,
    tell: mpsc::Sender<Result<Vec<Duration>, String>>,
    tasks: Arc<std::sync::Mutex<Option<u64>>>,
    next: Option<Monotonic>,
}

impl<C: Command> Repeating<C> {
    fn go(&mut self, now: Now, out: &mut Outbox) {
        self.sent = Instant::now();
        match self.consumer.start(now, self.destination, self.command.clone(), out) {
            Ok(session) => self.session = Some(session),
            Err(_) => self.next = Some(now.monotonic + Duration::from_millis(1)),
        }
    }

    fn told(&mut self, now: Now, told: Told<C::ExecutionStatus>, out: &mut Outbox) {
        match told {
            Told::State { session, state: CommandState::Executing, .. } if self.session == Some(session) => {
                self.trips.push(self.sent.elapsed());
                // What does not end by itself is cancelled.
                self.consumer.cancel(now, session, out);
            }
            Told::Ended { session, outcome } if self.session == Some(session) => {
                self.session = None;
                self.left -= 1;
                if let Outcome::Failed { reason, text } = outcome {
                    let _ = self.tell.send(Err(format!("a command failed: {reason} {text}")));
                } else if self.left == 0 {
                    let _ = self.tell.send(Ok(std::mem::take(&mut self.trips)));
                } else {
                    self.go(now, out);
                }
            }
            _ => {}
        }
    }
}

/// How often a repeating consumer looks for a task.
const LOOK_EVERY: Duration = Duration::from_millis(1);

impl<C: Command> Service for Repeating<C> {
    fn subscriptions(&self) -> Vec<Prefix> {
        self.consumer.subscriptions()
    }

    fn follows_bus(&self) -> bool {
        true
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        for told in self.consumer.handle(now, &input, out) {
            self.told(now, told, out);
        }
        match input {
            Input::HistoryComplete(_) => self.next = Some(now.monotonic),
            Input::Deadline if self.next.is_some_and(|next| next <= now.monotonic) => {
                self.next = Some(now.monotonic + LOOK_EVERY);
                if self.left == 0 {
                    let mut task = self.tasks.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                    self.left = task.take().unwrap_or_default();
                }
                if self.left > 0 && self.session.is_none() {
                    self.go(now, out);
                }
            }
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        [self.consumer.next_deadline(), self.next].into_iter().flatten().min()
    }
}

/// A consumer in this process, given tasks from outside.
struct Side {
    tasks: Arc<std::sync::Mutex<Option<u64>>>,
    told: mpsc::Receiver<Result<Vec<Duration>, String>>,
    spec: ServiceSpec,
}

impl Side {
    fn new<C: Command>(service: u64, destination: Guid, command: C) -> Result<Self, Failure> {
        let service = ServiceId::new(service).map_err(|why| Failure::Failed(why.to_string()))?;
        let source = Source::new(entity(1)?, service);
        let (guids, tasks) = (guids()?, Arc::new(std::sync::Mutex::new(None)));
        let (tell, told) = mpsc::channel();
        let for_service = tasks.clone();
        let factory = Arc::new(move || -> Box<dyn Service> {
            Box::new(Repeating {
                consumer: Consumer::new(source, guids.clone(), ConsumerSettings::default()),
                command: command.clone(),
                destination,
                left: 0,
                session: None,
                sent: Instant::now(),
                trips: Vec::new(),
                tell: tell.clone(),
                tasks: for_service.clone(),
                next: None,
            })
        });
        Ok(Self { tasks, told, spec: ServiceSpec { source, name: "bench".into(), factory } })
    }

    fn run(&self, count: u64) -> Result<(Duration, Vec<Duration>), Failure> {
        let start = Instant::now();
        *self.tasks.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = Some(count);
        let trips = self.told.recv_timeout(PATIENCE);
        let trips = trips.map_err(|_| Failure::Failed("the commands do not end within 60 s".into()))?;
        Ok((start.elapsed(), trips.map_err(Failure::Failed)?))
    }
}

impl UmaaBench {
    pub(super) fn run(self) -> Result<(), Failure> {
        let memory = self.memory()?;
        let locator = format!("tcp/127.0.0.1:{}", free_port()?);
        let guids = guids()?;
        let arbiter = guids.of_service(Source::new(entity(ARBITER)?, ServiceId::ALLOCATION));
        let resource = guids.of_resource(entity(ARBITER)?, RESOURCE);
        let consumer = |service: u64| -> Result<Guid, Failure> {
            let service = ServiceId::new(service).map_err(|why| Failure::Failed(why.to_string()))?;
            Ok(guids.of_service(Source::new(entity(1)?, service)))
        };
        let (time_stamp, nobody) = (DateTime::default(), Guid::default());
        let priorities =
            Sequence::new(vec![consumer(102)?]).map_err(|why| Failure::Failed(why.to_string()))?;
        let commands = Side::new(
            101,
            arbiter,
            ResourceAllocationPriorityCommand {
                priorities,
                resource_id: resource,
                time_stamp,
                source: nobody,
                session_id: nobody,
                destination: nobody,
            },
        )?;
        let allocations = Side::new(
            102,
            arbiter,
            ResourceAllocationCommand {
                duration: None,
                resource_id: resource,
                time_stamp,
                source: nobody,
                session_id: nobody,
                destination: nobody,
            },
        )?;
        let config = configuration(1, &format!("listen = [\"{locator}\"]"))?;
        let outside = runtime::outside(&config).map_err(|why| Failure::Failed(why.to_string()))?;
        let mut node = runtime::node_config(&config);
        node.services.extend([commands.spec.clone(), allocations.spec.clone()]);
        let mut raw = RawTrips::start()?;
        let _peer = Process::start(&["bench", "umaa-peer", "--connect", &locator])?;
        let member = Member::start(node, outside)?;
        let (mut p50, mut p99, mut of_raw, mut rates) =
            (Vec::new(), Vec::new(), (Vec::new(), Vec::new()), Vec::new());
        for round in 0..=self.rounds {
            // The first round warms up and does not count.
            let count = if round == 0 { self.commands / 10 + 1 } else { self.commands };
            let mut raw_trips = raw.round_trips(100, count)?;
            let (_, mut trips) = commands.run(count)?;
            let (took, _) = allocations.run(count / 4 + 1)?;
            if round > 0 {
                p50.push(percentile(&mut trips, 0.5).as_secs_f64() * 1e6);
                p99.push(percentile(&mut trips, 0.99).as_secs_f64() * 1e6);
                of_raw.0.push(percentile(&mut raw_trips, 0.5).as_secs_f64() * 1e6);
                of_raw.1.push(percentile(&mut raw_trips, 0.99).as_secs_f64() * 1e6);
                rates.push((count / 4 + 1) as f64 / took.as_secs_f64());
            }
        }
        member.leave()?;
        let result = json!({
            "p50_ratio": rounded(super::statistics::paired(&p50, &of_raw.0)),
            "p99_ratio": rounded(super::statistics::paired(&p99, &of_raw.1)),
            "command_us": { "p50": median(&p50).round(), "p99": median(&p99).round() },
            "raw_us": { "p50": median(&of_raw.0).round(), "p99": median(&of_raw.1).round() },
            "allocations_per_s": median(&rates).round(),
            "memory": memory,
            "rounds": self.rounds, "commands": self.commands,
        });
        print_line(if self.json { result.to_string() } else { format!("{result:#}") });
        Ok(())
    }

    /// What a retained instance costs beside its content, in a node that has written them.
    fn memory(&self) -> Result<serde_json::Value, Failure> {
        const CONTENT: usize = 200;
        let (tell, told) = mpsc::channel();
        let label = label("UMAA::SO::Bench::BenchReport", source(1)?)?;
        let instances = self.instances.max(1);
        let make = move || -> Box<dyn Service> {
            Box::new(Filling {
                label: label.clone(),
                instances,
                written: 0,
                content: CONTENT,
                tell: tell.clone(),
                next: None,
            })
        };
        let member = member(1, "", make)?;
        told.recv_timeout(PATIENCE).map_err(|_| Failure::Failed("the node does not start".into()))?;
        let before = resident_bytes()?;
        told.recv_timeout(PATIENCE).map_err(|_| Failure::Failed("the instances are not written".into()))?;
        let after = resident_bytes()?;
        member.leave()?;
        let each = after.saturating_sub(before) as f64 / instances as f64;
        Ok(json!({
            "instances": instances, "content_bytes": CONTENT, "bytes_each": each.round(),
            "bytes_each_beside_content": (each - CONTENT as f64).round(),
        }))
    }
}

/// Writes many instances, in pieces so that what is on its way is not counted as retained.
struct Filling {
    label: Arc<Label>,
    instances: u64,
    written: u64,
    content: usize,
    tell: mpsc::Sender<()>,
    next: Option<Monotonic>,
}

impl Service for Filling {
    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            Input::Started => {
                let _ = self.tell.send(());
                self.next = Some(now.monotonic + Duration::from_millis(500));
            }
            Input::Deadline => {
                for _ in 0..256.min(self.instances - self.written) {
                    let instance = Instance::of_number(self.written as i64);
                    let message = Message::new(self.label.clone(), vec![0; self.content].into());
                    out.send(message.of_instance(instance));
                    self.written += 1;
                }
                let is_done = self.written == self.instances;
                self.next = if is_done { None } else { Some(now.monotonic) };
                if is_done {
                    let _ = self.tell.send(());
                }
            }
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.next
    }
}

/// The memory of this process that is in use, in bytes.
fn resident_bytes() -> Result<u64, Failure> {
    let failed = |why: String| Failure::Failed(format!("this system does not tell memory in /proc: {why}"));
    let status = std::fs::read_to_string("/proc/self/status").map_err(|why| failed(why.to_string()))?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kib = line.and_then(|line| line.trim().trim_end_matches("kB").trim().parse::<u64>().ok());
    kib.map(|kib| kib * 1024).ok_or_else(|| failed("no VmRSS".into()))
}

impl UmaaPeer {
    pub(super) fn run(self) -> Result<(), Failure> {
        let bus = format!(
            "connect = [\"{}\"]\n[[resource]]\nname = \"{RESOURCE}\"\npriorities = [\"eid1sid102\"]\n",
            self.connect
        );
        let mut config = configuration(ARBITER, &bus)?;
        config.operators = vec![entity(1)?].try_into().map_err(Failure::Failed)?;
        let outside = runtime::outside(&config).map_err(|why| Failure::Failed(why.to_string()))?;
        let _member = Member::start(runtime::node_config(&config), outside)?;
        super::serve_until_killed()
    }
}
