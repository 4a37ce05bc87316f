//! The command line as a member of the fleet: a small node with one service, joined as a Zenoh client.

use super::exit::Failure;
use crate::clock;
use crate::config::Config;
use crate::runtime::{self, Control};
use aldis_envelope::{EntityId, Fleet, Guids, Monotonic, Now, Prefix, ServiceId, Source};
use aldis_services::{Input, NodeConfig, Outbox, Service, ServiceSpec};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use tokio::sync::mpsc;

/// How the command line joins the fleet.
#[derive(clap::Args, Debug, Clone)]
pub(crate) struct Join {
    /// The Zenoh locator of a node or router.
    #[arg(long, default_value = "tcp/127.0.0.1:7447", value_name = "LOCATOR")]
    connect: String,
    /// The entity to join as.
    #[arg(long = "as", default_value = "9000", value_name = "EID")]
    entity: EntityId,
    /// The fleet.
    #[arg(long, default_value = "fleet")]
    fleet: String,
    /// A configuration to take fleet, user, password and certificates from; `--connect` and `--as` do not apply.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["connect", "entity", "fleet"])]
    config: Option<PathBuf>,
}

impl Join {
    /// What to say when the bus does not answer.
    pub(crate) fn unreachable(&self) -> Failure {
        let whom = match &self.config {
            Some(config) => format!("those that {} connects to", config.display()),
            None => self.connect.clone(),
        };
        Failure::Unreachable(format!(
            "{whom} does not answer within {:?}; is a node running there?",
            super::JOIN_WITHIN
        ))
    }

    /// How the GUIDs of the fleet's services are made.
    pub(crate) fn guids(&self) -> Result<Guids, Failure> {
        let config = self.load()?;
        Ok(Guids::new(&config.fleet, config.guid))
    }

    /// The entity that it joins as.
    pub(crate) fn own(&self) -> Result<EntityId, Failure> {
        Ok(self.load()?.entities.own())
    }

    /// The fleet that it joins.
    pub(crate) fn fleet(&self) -> Result<Fleet, Failure> {
        Ok(self.load()?.fleet)
    }

    /// The configuration that it joins with.
    pub(crate) fn load(&self) -> Result<Config, Failure> {
        if let Some(path) = &self.config {
            return Ok(Config::load(path)?);
        }
        let text = format!(
            "name = \"command-line\"\nfleet = {:?}\nentities = [{}]\n[bus]\nmode = \"client\"\nconnect = [{:?}]\n",
            self.fleet, self.entity, self.connect
        );
        Config::parse("command line", &text)
            .map_err(|e| Failure::Usage(format!("{} ({})", e.message(), e.cure())))
    }
}

/// What a member's service does with an input.
pub(crate) trait Desk: Send {
    /// Takes one input.
    fn take(&mut self, now: Now, input: Input<'_>, out: &mut Outbox);
    /// When it wants a deadline.
    fn next_deadline(&self) -> Option<Monotonic> {
        None
    }
}

/// Lends a desk to its node. A node makes its services anew after a crash; this one is lent once.
struct Lent<D> {
    desk: Arc<Mutex<D>>,
    prefixes: Vec<Prefix>,
}

impl<D: Desk> Service for Lent<D> {
    fn subscriptions(&self) -> Vec<Prefix> {
        self.prefixes.clone()
    }
    fn follows_bus(&self) -> bool {
        true
    }
    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner).take(now, input, out);
    }
    fn next_deadline(&self) -> Option<Monotonic> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner).next_deadline()
    }
}

/// A service that lends a desk.
pub(crate) fn desk_service<D: Desk + 'static>(source: Source, prefixes: Vec<Prefix>, desk: D) -> ServiceSpec {
    let desk = Arc::new(Mutex::new(desk));
    let factory = Arc::new(move || -> Box<dyn Service> {
        Box::new(Lent { desk: desk.clone(), prefixes: prefixes.clone() })
    });
    ServiceSpec { source, name: "desk".into(), factory }
}

/// A running member.
pub(crate) struct Member {
    control: mpsc::UnboundedSender<Control>,
    thread: JoinHandle<Result<(), runtime::RuntimeError>>,
}

impl Member {
    /// Joins the fleet with a desk, as a service that nobody else is.
    pub(crate) fn join<D: Desk + 'static>(
        join: &Join,
        prefixes: Vec<Prefix>,
        desk: D,
    ) -> Result<Self, Failure> {
        Self::join_as(join, free_service(), prefixes, desk)
    }

    /// Joins the fleet with a desk, as a service that others know by its id.
    pub(crate) fn join_as<D: Desk + 'static>(
        join: &Join,
        service: ServiceId,
        prefixes: Vec<Prefix>,
        desk: D,
    ) -> Result<Self, Failure> {
        let config = join.load()?;
        let outside = runtime::outside(&config).map_err(|why| Failure::Usage(why.to_string()))?;
        let mut node = runtime::node_config(&config);
        node.services = vec![desk_service(Source::new(config.entities.own(), service), prefixes, desk)];
        node.bridges.clear();
        node.links.clear();
        // A command comes and goes: nobody is to wait for it.
        node.reliable = false;
        Self::start(node, outside)
    }

    /// Runs a node on a thread of its own.
    pub(crate) fn start(node: NodeConfig, outside: runtime::Outside) -> Result<Self, Failure> {
        let (control, controlled) = mpsc::unbounded_channel();
        let name = format!("node {}", node.entities.first().map_or(0, |entity| entity.get()));
        let thread = std::thread::Builder::new()
            .name(name)
            .spawn(move || runtime::run(node, outside, controlled))
            .map_err(|why| Failure::Failed(format!("no thread for the node: {why}")))?;
        Ok(Self { control, thread })
    }

    /// What asks the node for something.
    pub(crate) fn control(&self) -> mpsc::UnboundedSender<Control> {
        self.control.clone()
    }

    /// Ends the node in order and waits for it.
    pub(crate) fn leave(self) -> Result<(), Failure> {
        let _ = self.control.send(Control::Shutdown);
        match self.thread.join() {
            Ok(Ok(())) => Ok(()),
            Ok(Err(why)) => Err(Failure::Failed(why.to_string())),
            Err(_) => Err(Failure::Failed("the node's thread panicked".into())),
        }
    }
}

/// A service id that no other command of this entity has: drawn from process and time, among two billion.
fn free_service() -> ServiceId {
    let mixed = clock::boot_id().0 ^ (u64::from(std::process::id()) << 32);
    let drawn = mixed.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 33;
    ServiceId::new(drawn | 1 << 30).unwrap_or(ServiceId::NODE)
}
