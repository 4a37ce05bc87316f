//! `aldis bench contention`: an arbiter, three providers and three consumers in processes of their own, which are killed one
//! after the other, watched from a process that takes no part.

mod order;
mod peer;
mod watch;

pub(super) use peer::ContentionPeer;

use super::super::exit::Failure;
use super::super::print_line;
use super::child::free_port;
use super::service_node::configuration;
use crate::cli::member::Member;
use crate::runtime;
use aldis_envelope::{EntityId, Fleet, Guid, GuidForm, Guids, ServiceId, Source};
use aldis_services::{Service, ServiceSpec};
use peer::Part;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use watch::{Seen, Watch};

/// The one resource.
const RESOURCE: &str = "autopilot";
/// The entity of the arbiter; shore, which watches, is 1.
const ARBITER: u64 = 2;
/// The entities of the providers of the resource.
const PROVIDERS: [u64; 3] = [11, 12, 13];
/// The entities of the consumers, from low to high priority.
const CONSUMERS: [u64; 3] = [21, 22, 23];
/// The service on shore that commands without control.
const PIRATE: u64 = 103;
/// The lease of a reader: nothing may take longer to be right again.
const LEASE: Duration = Duration::from_secs(10);
/// How long a process that was killed stays away.
const AWAY: Duration = Duration::from_secs(1);
/// How often is looked how far it is.
const LOOK_EVERY: Duration = Duration::from_millis(10);
/// How long nothing may happen at all.
const PATIENCE: Duration = Duration::from_secs(60);

/// Contended allocations between processes, some of which are killed.
///
/// Three consumers ask for one resource again and again, and command its three providers while they have it; a fourth commands
/// without ever asking. Each process is killed (SIGKILL) in its turn and started again a second later. What is seen on the bus
/// is judged by a second pair of eyes and by the conformance monitor. Exit code 1 where two had control, where a command without
/// control was executed, where control was not given again within the lease, or where anything is left at the end.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis bench contention --json
  aldis bench contention --allocations 40 --kills 2")]
pub(super) struct Contention {
    /// How often control is to be given.
    #[arg(long, default_value_t = 1_000)]
    allocations: u64,
    /// How many processes are killed: the arbiter, the providers and the consumers in turn.
    #[arg(long, default_value_t = 7)]
    kills: u64,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

fn failed(why: impl std::fmt::Display) -> Failure {
    Failure::Failed(why.to_string())
}

fn guids() -> Result<Guids, Failure> {
    Ok(Guids::new(&Fleet::new("bench").map_err(failed)?, GuidForm::Readable))
}

fn at(entity: u64, service: ServiceId) -> Result<Source, Failure> {
    Ok(Source::new(EntityId::new(entity).map_err(failed)?, service))
}

/// Providers and consumers have the service 100 of their entities.
fn member_of(entity: u64) -> Result<Source, Failure> {
    at(entity, ServiceId::new(100).map_err(failed)?)
}

fn guid_of(entity: u64) -> Result<Guid, Failure> {
    Ok(guids()?.of_service(member_of(entity)?))
}

/// A process of the fleet. It ends in order when its standard input is closed.
struct Process {
    part: Part,
    entity: u64,
    child: Child,
}

impl Process {
    fn start(part: Part, entity: u64, bus: &str, directory: &Path) -> Result<Self, Failure> {
        let cannot = |why: std::io::Error| failed(format!("cannot start another process: {why}"));
        let mut command = Command::new(std::env::current_exe().map_err(cannot)?);
        command.args(["bench", "contention-peer", "--connect", bus, "--part", part.name(), "--entity"]);
        command.arg(entity.to_string()).arg("--journal").arg(directory.join(entity.to_string()));
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::inherit());
        Ok(Self { part, entity, child: command.spawn().map_err(cannot)? })
    }

    fn kill(&mut self) {
        // It may have ended by itself, which is seen by what it no longer does.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    /// Ends it in order.
    fn end(mut self) -> Result<(), Failure> {
        drop(self.child.stdin.take());
        let until = Instant::now() + LEASE;
        while self.child.try_wait().map_err(failed)?.is_none() {
            if Instant::now() > until {
                return Err(failed(format!("{} of {} does not end", self.part.name(), self.entity)));
            }
            std::thread::park_timeout(LOOK_EVERY);
        }
        Ok(())
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill();
    }
}

/// A directory that goes with the value.
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        // What is left of it does no harm.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// What a kill came to.
struct Killed {
    part: Part,
    entity: u64,
    /// When control was given again after the kill; none where it was not within twice the lease.
    given_after: Option<Duration>,
}

/// The fleet, seen from shore.
struct Contenders {
    processes: Vec<Process>,
    bus: String,
    directory: Scratch,
    seen: Arc<Mutex<Seen>>,
}

impl Contention {
    pub(super) fn run(self) -> Result<(), Failure> {
        let bus = format!("tcp/127.0.0.1:{}", free_port()?);
        let name =
            format!("aldis-contention-{}-{}", std::process::id(), bus.rsplit(':').next().unwrap_or(""));
        let directory = Scratch(std::env::temp_dir().join(name));
        let seen: Arc<Mutex<Seen>> = Arc::default();
        lock(&seen).tells = Some(std::thread::current());
        let shore = shore(&bus, &seen)?;
        let parts = std::iter::once((Part::Arbiter, ARBITER))
            .chain(PROVIDERS.map(|entity| (Part::Provider, entity)))
            .chain(CONSUMERS.map(|entity| (Part::Consumer, entity)));
        let processes = parts.map(|(part, entity)| Process::start(part, entity, &bus, &directory.0));
        let processes = processes.collect::<Result<Vec<_>, _>>()?;
        let mut fleet = Contenders { processes, bus, directory, seen };
        let begun = Instant::now();
        let kills = self.contend(&mut fleet)?;
        let took = begun.elapsed();
        let left = fleet.end()?;
        shore.leave()?;
        let seen = std::mem::take(&mut *lock(&fleet.seen));
        self.tell(seen, &kills, took, left)
    }

    /// Until control was given often enough; what is killed goes in between.
    fn contend(&self, fleet: &mut Contenders) -> Result<Vec<Killed>, Failure> {
        let mut kills = Vec::new();
        for turn in 0..=self.kills {
            fleet.wait_until_given(self.allocations * (turn + 1) / (self.kills + 1))?;
            if turn < self.kills {
                let place = turn as usize % fleet.processes.len();
                kills.push(fleet.kill(place)?);
            }
        }
        Ok(kills)
    }

    fn tell(
        &self,
        mut seen: Seen,
        kills: &[Killed],
        took: Duration,
        left: Vec<String>,
    ) -> Result<(), Failure> {
        let report = seen.finish();
        let broken: Vec<_> = report.iter().flat_map(|report| report.broken()).collect();
        let seconds =
            |after: Option<Duration>| after.map(|after| (after.as_secs_f64() * 100.0).round() / 100.0);
        let late = kills.iter().filter(|killed| killed.given_after.is_none_or(|after| after > LEASE)).count();
        let killed = kills.iter().map(|killed| {
            json!({
                "process": killed.part.name(), "entity": killed.entity,
                "given_again_after_s": seconds(killed.given_after),
            })
        });
        let clauses = broken.iter().map(|found| {
            let first = found.first.as_ref().map(|first| first.text.as_str());
            json!({ "clause": found.clause.name(), "times": found.broken, "first": first })
        });
        let result = json!({
            "allocations": seen.given,
            "refused": seen.refused,
            "taken_over": seen.taken_over,
            "commands_executed": seen.executed,
            "commands_without_control": seen.without_control,
            "executed_without_control": seen.pirated,
            "two_holders": seen.two_holders.len(),
            "two_holders_first": seen.two_holders.first(),
            "kills": killed.collect::<Vec<_>>(),
            "kills_not_right_within_the_lease": late,
            "left": left,
            "clauses_broken": broken.len(),
            "clauses": clauses.collect::<Vec<_>>(),
            "seconds": took.as_secs_f64().round(),
        });
        print_line(if self.json { result.to_string() } else { format!("{result:#}") });
        let wrong = seen.two_holders.len() + seen.pirated as usize + late + left.len() + broken.len();
        if wrong == 0 { Ok(()) } else { Err(failed(format!("{wrong} things were wrong"))) }
    }
}

impl Contenders {
    fn given(&self) -> u64 {
        lock(&self.seen).given
    }

    fn wait_until_given(&self, wanted: u64) -> Result<(), Failure> {
        let (mut last, mut since) = (self.given(), Instant::now());
        while last < wanted {
            std::thread::park_timeout(LOOK_EVERY);
            let given = self.given();
            if given > last {
                (last, since) = (given, Instant::now());
            } else if since.elapsed() > PATIENCE {
                return Err(failed(format!(
                    "control was given {last} times, and not again for {PATIENCE:?}"
                )));
            }
        }
        Ok(())
    }

    /// Kills a process while control is contended, and starts it again.
    fn kill(&mut self, place: usize) -> Result<Killed, Failure> {
        let process = &mut self.processes[place];
        let (part, entity) = (process.part, process.entity);
        process.kill();
        let (before, at) = (self.given(), Instant::now());
        let mut is_back = false;
        let mut given_after = None;
        while at.elapsed() < 2 * LEASE && !(is_back && given_after.is_some()) {
            std::thread::park_timeout(LOOK_EVERY);
            if given_after.is_none() && self.given() > before {
                given_after = Some(at.elapsed());
            }
            if !is_back && at.elapsed() >= AWAY {
                self.processes[place] = Process::start(part, entity, &self.bus, &self.directory.0)?;
                is_back = true;
            }
        }
        Ok(Killed { part, entity, given_after })
    }

    /// The consumers end in order; what is then on the bus that is not right, when the lease is over.
    fn end(&mut self) -> Result<Vec<String>, Failure> {
        lock(&self.seen).is_ending = true;
        let consumers = self.processes.extract_if(.., |process| process.part == Part::Consumer);
        consumers.map(Process::end).collect::<Result<Vec<_>, _>>()?;
        let until = Instant::now() + LEASE;
        loop {
            let left = lock(&self.seen).left();
            if left.is_empty() || Instant::now() > until {
                return Ok(left);
            }
            std::thread::park_timeout(LOOK_EVERY);
        }
    }
}

fn lock(seen: &Mutex<Seen>) -> MutexGuard<'_, Seen> {
    seen.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The node that all join, with those who watch and the one who commands without control.
fn shore(bus: &str, seen: &Arc<Mutex<Seen>>) -> Result<Member, Failure> {
    let config = configuration(1, &format!("mode = \"router\"\nlisten = [\"{bus}\"]"))?;
    let outside = runtime::outside(&config).map_err(failed)?;
    let mut node = runtime::node_config(&config);
    let watches = seen.clone();
    let factory = Arc::new(move || -> Box<dyn Service> { Box::new(Watch::new(watches.clone())) });
    node.services.push(ServiceSpec { source: member_of(1)?, name: "watch".into(), factory });
    let source = at(1, ServiceId::new(PIRATE).map_err(failed)?)?;
    let (guids, seen) = (guids()?, seen.clone());
    let providers = PROVIDERS.map(guid_of).into_iter().collect::<Result<Vec<_>, _>>()?;
    let factory = Arc::new(move || -> Box<dyn Service> {
        Box::new(watch::Pirate::new(source, guids.clone(), providers.clone(), seen.clone()))
    });
    node.services.push(ServiceSpec { source, name: "pirate".into(), factory });
    Member::start(node, outside)
}
