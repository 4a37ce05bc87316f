//! The nodes of the demo.

use super::board::{BOATS, Board, CONTENDED, CRASHING, SILENCED};
use super::control::{self, Contender, Habit};
use super::crashing::crashing;
use super::linked;
use super::missions::{self, Plan};
use super::shore::ShoreDesk;
use crate::cli::exit::Failure;
use crate::cli::link::relay::Running;
use crate::cli::member::{Member, desk_service};
use crate::config::Config;
use crate::runtime::{self, Control};
use aldis_envelope::aldis::NodeStatus;
use aldis_envelope::umaa::{HealthReport, ResourceAllocationReport, Topic};
use aldis_envelope::{EntityId, GuidForm, Guids, Prefix, ServiceId, Source};
use aldis_services::sim::link::Profile;
use aldis_services::{ServiceSpec, track};
use std::net::TcpListener;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::Duration;

/// The name of the fleet.
const FLEET: &str = "demo";

/// The running fleet.
pub(super) struct Fleet {
    shore: Member,
    boats: Vec<Member>,
    finish: Arc<AtomicBool>,
    statuses: mpsc::Receiver<Vec<NodeStatus>>,
    /// The bad links, one a boat, where there are any.
    relays: Vec<Running>,
}

fn failed<E: std::fmt::Display>(why: E) -> Failure {
    Failure::Failed(why.to_string())
}

impl Fleet {
    /// Starts shore, then the boats.
    pub(super) fn start(
        board: &Arc<Mutex<Board>>,
        link: Option<&Profile>,
        plan: &Plan,
    ) -> Result<Self, Failure> {
        let port = TcpListener::bind("127.0.0.1:0")
            .and_then(|listener| listener.local_addr())
            .map_err(failed)?
            .port();
        let (tell, statuses) = mpsc::channel();
        let finish = Arc::new(AtomicBool::new(false));
        let boats = BOATS.map(EntityId::new).into_iter().collect::<Result<Vec<_>, _>>().map_err(failed)?;
        let guids = Guids::new(&aldis_envelope::Fleet::new(FLEET).map_err(failed)?, GuidForm::Readable);
        let desk = ShoreDesk::new(board.clone(), guids.clone(), boats, finish.clone(), tell).over(link);
        let entity = EntityId::new(1).map_err(failed)?;
        let source = Source::new(entity, ServiceId::new(100).map_err(failed)?);
        let prefixes =
            [track::DESCRIPTOR, HealthReport::NAME, ResourceAllocationReport::NAME].map(Prefix::new);
        let prefixes = prefixes.into_iter().collect::<Result<Vec<_>, _>>().map_err(failed)?;
        let mut services = vec![desk_service(source, prefixes, desk)];
        services.extend(contenders(board, &guids, entity)?);
        services.extend(missions::ashore(plan, board, &guids, entity)?);
        let Some(profile) = link else {
            let shore = start(&shore_text(port), services)?;
            let crashes = board.lock().unwrap_or_else(PoisonError::into_inner).crashes.clone();
            let boats = BOATS
                .iter()
                .map(|&boat| start_boat(boat, port, &crashes, missions::afloat(plan, &guids, boat)?));
            return Ok(Self {
                shore,
                boats: boats.collect::<Result<_, _>>()?,
                finish,
                statuses,
                relays: Vec::new(),
            });
        };
        services.push(linked::orderer(board, entity)?);
        let (relays, texts) = linked::links(profile)?;
        let shore = start(&(shore_text(port) + &texts.shore), services)?;
        let boats = BOATS.iter().zip(&texts.boats).map(|(&boat, text)| {
            let alone = boat_text(boat, port).replace("mode = \"client\"", "mode = \"peer\"");
            let alone: Vec<_> = alone.lines().filter(|line| !line.starts_with("connect")).collect();
            let mut services = missions::afloat(plan, &guids, boat)?;
            services.push(linked::taker(board, boat)?);
            start(&(alone.join("\n") + "\n" + text), services)
        });
        Ok(Self { shore, boats: boats.collect::<Result<_, _>>()?, finish, statuses, relays })
    }

    /// Silences the boat, or lets it come back.
    pub(super) fn silence(&self, silent: bool) {
        let boat = BOATS.iter().position(|&boat| boat == SILENCED);
        if let Some(relay) = boat.and_then(|boat| self.relays.get(boat)) {
            return relay.cut(silent);
        }
        if let Some(member) = boat.and_then(|boat| self.boats.get(boat)) {
            // A node that has ended is as silent as can be.
            let _ = member.control().send(Control::Silence(silent));
        }
    }

    /// What every node says of itself at the end.
    pub(super) fn statuses(&self, within: Duration) -> Result<Vec<NodeStatus>, Failure> {
        self.finish.store(true, Ordering::Relaxed);
        self.statuses
            .recv_timeout(within)
            .map_err(|_| Failure::Failed("the nodes do not tell their status".into()))
    }

    /// Ends all nodes, the boats first.
    pub(super) fn leave(self) -> Result<(), Failure> {
        self.boats.into_iter().try_for_each(Member::leave)?;
        self.shore.leave()
    }
}

/// The planner wants the autopilot most of the time; the operator goes before it, now and then. The surveyor has a boat to itself.
fn contenders(
    board: &Arc<Mutex<Board>>,
    guids: &Guids,
    shore: EntityId,
) -> Result<Vec<ServiceSpec>, Failure> {
    let seconds = Duration::from_secs_f64;
    let habits = [
        (control::PLANNER, CONTENDED, Habit { span: seconds(2.0), pause: seconds(0.5) }),
        (control::OPERATOR, CONTENDED, Habit { span: seconds(1.5), pause: seconds(3.7) }),
        // It has control nearly always, so that a crash of the arbiter finds a command.
        (control::SURVEYOR, CRASHING, Habit { span: seconds(5.0), pause: seconds(0.2) }),
    ];
    let contender = |(service, boat, habit): (u64, u64, Habit)| {
        let boat = EntityId::new(boat).map_err(failed)?;
        let source = Source::new(shore, ServiceId::new(service).map_err(failed)?);
        let contender = Contender::new(board.clone(), guids, source, boat, habit);
        Ok(desk_service(source, contender.subscriptions(), contender))
    };
    habits.into_iter().map(contender).collect()
}

/// A boat; the arbiter of one of them crashes.
fn start_boat(
    boat: u64,
    port: u16,
    crashes: &Arc<AtomicU64>,
    services: Vec<ServiceSpec>,
) -> Result<Member, Failure> {
    let config = Config::parse("demo", &boat_text(boat, port))?;
    let outside = runtime::outside(&config).map_err(failed)?;
    let mut node = runtime::node_config(&config);
    let arbiters = node
        .services
        .iter_mut()
        .filter(|spec| boat == CRASHING && spec.source.service == ServiceId::ALLOCATION);
    arbiters.for_each(|spec| *spec = crashing(spec.clone(), crashes));
    node.services.extend(services);
    Member::start(node, outside)
}

fn start(text: &str, services: Vec<ServiceSpec>) -> Result<Member, Failure> {
    let config = Config::parse("demo", text)?;
    let outside = runtime::outside(&config).map_err(failed)?;
    let mut node = runtime::node_config(&config);
    node.services.extend(services);
    Member::start(node, outside)
}

fn shore_text(port: u16) -> String {
    format!(
        "name = \"shore\"\nfleet = \"demo\"\nentities = [1]\n[bus]\nmode = \"router\"\n\
         listen = [\"tcp/127.0.0.1:{port}\"]\n[health]\nreport_period_ms = 1000\n"
    )
}

/// A boat gives control of its autopilot, and of its missions.
fn boat_text(boat: u64, port: u16) -> String {
    format!(
        "name = \"boat-{boat}\"\nfleet = \"demo\"\nentities = [{boat}]\noperators = [1]\n\
         [bus]\nmode = \"client\"\nconnect = [\"tcp/127.0.0.1:{port}\"]\n[health]\nreport_period_ms = 1000\n\
         [[resource]]\nname = \"{}\"\npriorities = [\"eid1sid{}\", \"eid1sid{}\", \"eid1sid{}\"]\n\
         [[resource]]\nname = \"{}\"\npriorities = [\"eid1sid{}\"]\n",
        control::RESOURCE,
        control::PLANNER,
        control::OPERATOR,
        control::SURVEYOR,
        missions::RESOURCE,
        missions::server(boat),
    )
}
