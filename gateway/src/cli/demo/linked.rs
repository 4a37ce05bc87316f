//! The demo over bad links: every boat has a bus of its own, and a relay stands between it and shore.

use super::board::{BOATS, Board};
use crate::cli::exit::Failure;
use crate::cli::link::relay::{Relay, Running};
use crate::cli::member::{Desk, desk_service};
use aldis_envelope::{
    Address, ContentType, Descriptor, EntityId, Label, Message, Monotonic, Now, ServiceId, Source,
};
use aldis_services::sim::link::Profile;
use aldis_services::{Input, Outbox, ServiceSpec};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::net::{SocketAddr, UdpSocket};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// How long the nodes may take to tell their status over bad links: what a node counts is a long text.
pub(super) const STATUS_WITHIN: Duration = Duration::from_secs(60);

/// What orders are.
const ORDER: &str = "demo.Order";
/// Who takes orders on a boat, and who gives them on shore.
const TAKER: u64 = 110;
const ORDERER: u64 = 110;
/// How often each boat gets an order.
const ORDER_EVERY: Duration = Duration::from_secs(2);
/// The bytes of an order.
const ORDER_BYTES: usize = 64;
/// How long orders that are under way at the end are waited for.
const DRAIN: Duration = Duration::from_secs(60);

/// What is known of bad links.
#[derive(Debug, Clone, Default)]
pub(super) struct Linked {
    /// No orders are given any more.
    closing: bool,
    given: BTreeMap<EntityId, u64>,
    taken: BTreeMap<EntityId, BTreeMap<u64, u64>>,
    /// Orders that were taken after a later one.
    out_of_order: u64,
    /// Ages of states when they arrived, in milliseconds.
    ages: BTreeMap<EntityId, Vec<f64>>,
}

impl Linked {
    /// A state arrived, so many nanoseconds old: all clocks of the demo are one.
    pub(super) fn heard(&mut self, boat: EntityId, age: i64) {
        self.ages.entry(boat).or_default().push(age.max(0) as f64 / 1e6);
    }

    fn take(&mut self, boat: EntityId, number: u64) {
        let taken = self.taken.entry(boat).or_default();
        self.out_of_order += u64::from(taken.last_key_value().is_some_and(|(last, _)| *last > number));
        *taken.entry(number).or_default() += 1;
    }

    /// Orders given, those that nobody took, and those that were taken again.
    fn count(&self) -> (u64, u64, u64) {
        let given: u64 = self.given.values().sum();
        let taken = |boat: &EntityId| self.taken.get(boat).map_or(0, |taken| taken.len() as u64);
        let lost = self.given.iter().map(|(boat, given)| given.saturating_sub(taken(boat))).sum();
        let twice = self.taken.values().flat_map(BTreeMap::values).map(|times| times - 1).sum();
        (given, lost, twice)
    }

    /// What the result says of it.
    pub(super) fn object(&self) -> Map<String, Value> {
        let (given, lost, twice) = self.count();
        let age = |ages: &Vec<f64>| {
            let mut sorted = ages.clone();
            sorted.sort_by(f64::total_cmp);
            let at = |part: f64| sorted.get(((sorted.len() as f64 * part) as usize).min(sorted.len() - 1));
            let mean = sorted.iter().sum::<f64>() / sorted.len() as f64;
            json!({ "states": sorted.len(), "mean": mean.round(), "p99": at(0.99).map(|age| age.round()) })
        };
        let ages: Map<String, Value> =
            self.ages.iter().map(|(boat, ages)| (boat.to_string(), age(ages))).collect();
        let fields = [
            ("commands_sent", json!(given)),
            ("commands_lost", json!(lost)),
            ("commands_twice", json!(twice)),
            ("commands_out_of_order", json!(self.out_of_order)),
            ("state_age_ms", Value::Object(ages)),
        ];
        fields.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
    }

    /// Whether all orders were taken, once each.
    pub(super) fn judge(&self) -> Result<(), Failure> {
        let (given, lost, twice) = self.count();
        if lost + twice + self.out_of_order == 0 {
            return Ok(());
        }
        let order = self.out_of_order;
        Err(Failure::Failed(format!(
            "of {given} orders {lost} were lost, {twice} came twice, {order} out of order"
        )))
    }
}

fn lock(board: &Mutex<Board>) -> MutexGuard<'_, Board> {
    board.lock().unwrap_or_else(PoisonError::into_inner)
}

/// No more orders; those under way are waited for.
pub(super) fn drain(board: &Mutex<Board>) {
    lock(board).linked.closing = true;
    let end = Instant::now() + DRAIN;
    while lock(board).linked.count().1 > 0 && Instant::now() < end {
        std::thread::park_timeout(Duration::from_millis(50));
    }
}

struct Orderer {
    board: Arc<Mutex<Board>>,
    next: Option<Monotonic>,
}

impl Desk for Orderer {
    fn take(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        if !matches!(input, Input::Started | Input::Deadline) {
            return;
        }
        self.next = Some(now.monotonic + ORDER_EVERY);
        if lock(&self.board).linked.closing {
            self.next = None;
            return;
        }
        for boat in BOATS {
            let (Ok(entity), Ok(taker), Ok(order)) =
                (EntityId::new(boat), ServiceId::new(TAKER), Descriptor::new(ORDER))
            else {
                continue;
            };
            let mut board = lock(&self.board);
            let number = board.linked.given.entry(entity).or_default();
            *number += 1;
            let mut content = vec![0; ORDER_BYTES];
            content[..8].copy_from_slice(&number.to_be_bytes());
            let to = Address::Service(Source::new(entity, taker));
            let label = Label::limitedcast(to, ContentType::Aldis, order, out.source());
            out.send(Message::new(Arc::new(label), content.into()));
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.next
    }
}

struct Taker {
    board: Arc<Mutex<Board>>,
    boat: EntityId,
}

impl Desk for Taker {
    fn take(&mut self, _: Now, input: Input<'_>, _: &mut Outbox) {
        if let Input::Message(envelope) = input
            && envelope.message.label.descriptor() == ORDER
            && let Some(number) = envelope.message.content.first_chunk::<8>()
        {
            lock(&self.board).linked.take(self.boat, u64::from_be_bytes(*number));
        }
    }
}

fn failed<E: std::fmt::Display>(why: E) -> Failure {
    Failure::Failed(why.to_string())
}

/// Who gives orders on shore.
pub(super) fn orderer(board: &Arc<Mutex<Board>>, shore: EntityId) -> Result<ServiceSpec, Failure> {
    let source = Source::new(shore, ServiceId::new(ORDERER).map_err(failed)?);
    Ok(desk_service(source, Vec::new(), Orderer { board: board.clone(), next: None }))
}

/// Who takes orders on a boat.
pub(super) fn taker(board: &Arc<Mutex<Board>>, boat: u64) -> Result<ServiceSpec, Failure> {
    let boat = EntityId::new(boat).map_err(failed)?;
    let source = Source::new(boat, ServiceId::new(TAKER).map_err(failed)?);
    Ok(desk_service(source, Vec::new(), Taker { board: board.clone(), boat }))
}

/// The `[[link]]` tables of shore and of each boat.
pub(super) struct Texts {
    pub(super) shore: String,
    pub(super) boats: Vec<String>,
}

/// What crosses towards a boat. What other boats say is none of its business, and would cost its link's bytes.
fn from_shore(boat: u64) -> String {
    format!(
        "[[link.rule]]\naddress = \"eid{boat}\"\nclass = \"command\"\nlifespan_s = 600\n\
         [[link.rule]]\ndescriptor = \"UMAA::SO::ResourceAllocation::ResourceAllocationCommand\"\nclass = \"command\"\nlifespan_s = 30\n\
         [[link.rule]]\ndescriptor = \"afrl.cmasi.MissionCommand\"\nclass = \"command\"\nlifespan_s = 600\n"
    )
}

/// What crosses from a boat.
const FROM_BOAT: &str = "[[link.rule]]\naddress = \"eid1\"\nclass = \"command\"\nlifespan_s = 60\n\
    [[link.rule]]\ndescriptor = \"UMAA::SO::ResourceAllocation::ResourceAllocationReport\"\nclass = \"state\"\n\
    [[link.rule]]\ndescriptor = \"UMAA::SO::ResourceAllocation\"\nclass = \"command\"\nlifespan_s = 30\n\
    [[link.rule]]\ndescriptor = \"UMAA::SO::HealthReport\"\nclass = \"state\"\nrate_hz = 0.1\n\
    [[link.rule]]\ndescriptor = \"afrl.vehicles.SurfaceVehicleState\"\nclass = \"state\"\n";

fn carrier(profile: &Profile, listen: SocketAddr, peer: SocketAddr) -> String {
    let (rate, mtu) = (profile.rate, profile.mtu);
    let (round_trip, loss) = (profile.round_trip().as_millis(), profile.loss * 100.0);
    format!(
        "[[link.carrier]]\nkind = \"udp\"\nlisten = \"{listen}\"\npeer = \"{peer}\"\nrate_bytes_per_s = {rate}\nmtu = {mtu}\n\
         round_trip_ms = {round_trip}\nloss_percent = {loss:.0}\n"
    )
}

/// A relay for each boat, and the tables of both its ends.
pub(super) fn links(profile: &Profile) -> Result<(Vec<Running>, Texts), Failure> {
    let here: SocketAddr = SocketAddr::from(([127, 0, 0, 1], 0));
    let shore = UdpSocket::bind(here).and_then(|socket| socket.local_addr()).map_err(failed)?;
    let (mut relays, mut texts) = (Vec::new(), Texts { shore: String::new(), boats: Vec::new() });
    for boat in BOATS {
        let relay = Relay::new(profile, boat, here, (shore, None)).and_then(Relay::spawn).map_err(failed)?;
        // Writing to a String cannot fail.
        let _ = write!(
            texts.shore,
            "[[link]]\nname = \"boat-{boat}\"\npeer = {boat}\n{}{}",
            carrier(profile, shore, relay.address),
            from_shore(boat)
        );
        let own = carrier(profile, here, relay.address);
        texts.boats.push(format!("[[link]]\nname = \"shore\"\npeer = 1\n{own}{FROM_BOAT}"));
        relays.push(relay);
    }
    Ok((relays, texts))
}
