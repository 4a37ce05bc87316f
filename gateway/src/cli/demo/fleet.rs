//! The nodes of the demo.

use super::board::{BOATS, Board, CONTENDED, SILENCED};
use super::control::{self, Contender, Habit};
use super::linked;
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
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, mpsc};
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
    pub(super) fn start(board: &Arc<Mutex<Board>>, link: Option<&Profile>) -> Result<Self, Failure> {
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
        let Some(profile) = link else {
            let shore = start(&shore_text(port), services)?;
            let boats = BOATS.iter().map(|&boat| start(&boat_text(boat, port), Vec::new()));
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
            start(&(alone.join("\n") + "\n" + text), vec![linked::taker(board, boat)?])
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

/// The planner wants the autopilot most of the time; the operator goes before it, now and then.
fn contenders(
    board: &Arc<Mutex<Board>>,
    guids: &Guids,
    shore: EntityId,
) -> Result<Vec<ServiceSpec>, Failure> {
    let boat = EntityId::new(CONTENDED).map_err(failed)?;
    let seconds = Duration::from_secs_f64;
    let habits = [
        (control::PLANNER, Habit { span: seconds(2.0), pause: seconds(0.5) }),
        (control::OPERATOR, Habit { span: seconds(1.5), pause: seconds(3.7) }),
    ];
    let contender = |(service, habit): (u64, Habit)| {
        let source = Source::new(shore, ServiceId::new(service).map_err(failed)?);
        let contender = Contender::new(board.clone(), guids, source, boat, habit);
        Ok(desk_service(source, contender.subscriptions(), contender))
    };
    habits.into_iter().map(contender).collect()
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

/// Boats go round in circles of different size and speed, off Narragansett Bay.
fn boat_text(boat: u64, port: u16) -> String {
    let place = (boat - 400) as f64;
    format!(
        "name = \"boat-{boat}\"\nfleet = \"demo\"\nentities = [{boat}]\noperators = [1]\n\
         [bus]\nmode = \"client\"\nconnect = [\"tcp/127.0.0.1:{port}\"]\n[health]\nreport_period_ms = 1000\n\
         [[service]]\nkind = \"track\"\nservice = 100\nlatitude_deg = {:.4}\nlongitude_deg = -71.35\n\
         speed_m_per_s = {:.1}\nturn_rate_deg_per_s = {:.1}\nrate_hz = 10.0\n\
         [[resource]]\nname = \"{}\"\npriorities = [\"eid1sid{}\", \"eid1sid{}\"]\n",
        41.40 + place * 0.02,
        4.0 + place * 2.0,
        place - 2.0,
        control::RESOURCE,
        control::PLANNER,
        control::OPERATOR,
    )
}
