//! Who sends and who handles: consoles that call, and services with a ledger.

use crate::dds::{Durability, Keep, Qos, TopicRule};
use crate::link::export::{Export, Rule};
use crate::link::{CarrierConfig, CarrierId, Class, LinkConfig, LinkSpec};
use crate::node::NodeConfig;
use crate::registry;
use crate::service::{Input, Outbox, Service, ServiceSpec};
use crate::sim::link::Profile;
use crate::sim::observe::{Fact, Facts};
use aldis_envelope::aldis::{self, link as told};
use aldis_envelope::{
    Address, BootId, CallId, ContentType, Descriptor, EntityId, Envelope, Fleet, GuidForm, Guids, Instance,
    Label, Message, Monotonic, Name, Now, Prefix, Role, ServiceId, Source,
};
use bytes::Bytes;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// The service that keeps a ledger, and the one that calls.
const LEDGER: u64 = 100;
const CONSOLE: u64 = 300;
/// What the ledger says of each entry, on a persistent topic.
const HELD: &str = "sim.Held";
/// A call waits so long: longer than any run.
const WITHIN: Duration = Duration::from_secs(36_000);

/// A command: who sent it, and its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Entry {
    pub(super) from: u64,
    pub(super) number: u64,
}

impl Entry {
    fn write(self, times: u64) -> Bytes {
        // As long as a command of the measurements.
        let mut content = [0x5a; 64];
        for (place, value) in [self.from, self.number, times].into_iter().enumerate() {
            content[8 * place..8 * place + 8].copy_from_slice(&value.to_be_bytes());
        }
        Bytes::copy_from_slice(&content)
    }

    /// The entry, and how often it was handled.
    fn read(content: &[u8]) -> Option<(Self, u64)> {
        let value =
            |place: usize| Some(u64::from_be_bytes(content.get(8 * place..8 * place + 8)?.try_into().ok()?));
        Some((Self { from: value(0)?, number: value(1)? }, value(2)?))
    }
}

/// What consoles and ledgers tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LedgerFact {
    /// A console was told that its call is accepted.
    Accepted(Entry),
    /// A ledger has handled a call.
    Handled(Entry),
    /// What stood in a ledger when it was started: how often it has handled the call.
    Held(Entry, u64),
}

impl Fact for LedgerFact {}

/// One side of the link.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side {
    gateway: u64,
    console: u64,
    far: u64,
    far_console: u64,
}

fn source(entity: u64, service: u64) -> Result<Source, String> {
    let entity = EntityId::new(entity).map_err(|why| why.to_string())?;
    Ok(Source::new(entity, ServiceId::new(service).map_err(|why| why.to_string())?))
}

fn entity(number: u64) -> Result<EntityId, String> {
    EntityId::new(number).map_err(|why| why.to_string())
}

impl Side {
    pub(super) const BOTH: [Self; 2] = [
        Self { gateway: 1, console: 9_000, far: 400, far_console: 9_400 },
        Self { gateway: 400, console: 9_400, far: 1, far_console: 9_000 },
    ];

    /// The node that has the link, a journal and a ledger.
    pub(super) fn gateway(self, profile: &Profile, facts: &Facts) -> Result<NodeConfig, String> {
        let (own, facts) = (source(self.gateway, LEDGER)?, facts.clone());
        let ledger = move || -> Box<dyn Service> {
            Box::new(Ledger { source: own, facts: facts.clone(), entries: BTreeMap::new() })
        };
        let spec = ServiceSpec { source: own, name: "ledger".into(), factory: Arc::new(ledger) };
        let mut config = node(self.gateway, vec![spec])?;
        config.operators = vec![entity(self.console)?, entity(self.far_console)?];
        let qos = Qos { durability: Durability::Persistent, keep: Keep::Last(1), samples_max: 1 << 20 };
        let prefix = Prefix::new(HELD).map_err(|why| why.to_string())?;
        config.topics.insert(0, TopicRule { prefix, qos: Some(qos) });
        let Profile { rate, mtu, .. } = *profile;
        let round_trip = profile.round_trip();
        let carrier = CarrierConfig { id: CarrierId(0), rate, mtu, round_trip, loss: 0.1 };
        let rule = |to: u64| Rule {
            address: Prefix::new(&format!("eid{to}")).ok(),
            lifespan: Some(WITHIN),
            ..Rule::new("", Class::Command)
        };
        config.links.push(LinkSpec {
            name: "link".into(),
            link: LinkConfig::new(entity(self.gateway)?, entity(self.far)?, vec![carrier]),
            export: Export {
                behind: [entity(self.far)?, entity(self.far_console)?].into(),
                rules: vec![rule(self.far), rule(self.far_console)],
            },
        });
        Ok(config)
    }

    /// A node on the bus of the gateway that calls the far ledger.
    pub(super) fn console(self, gap: Duration, until: Duration, facts: &Facts) -> Result<NodeConfig, String> {
        let (own, to, facts) = (source(self.console, CONSOLE)?, source(self.far, LEDGER)?, facts.clone());
        let until = Monotonic::since_start(until);
        let console = move || -> Box<dyn Service> {
            let (facts, calls) = (facts.clone(), BTreeMap::new());
            Box::new(Console { source: own, to, gap, until, facts, calls, number: 0, next: None })
        };
        let spec = ServiceSpec { source: own, name: "console".into(), factory: Arc::new(console) };
        node(self.console, vec![spec])
    }
}

fn node(own: u64, services: Vec<ServiceSpec>) -> Result<NodeConfig, String> {
    let fleet = Fleet::new("sim").map_err(|why| why.to_string())?;
    let own = entity(own)?;
    let guids = Guids::new(&fleet, GuidForm::Readable);
    let mut all = registry::built_in(own, &guids, Duration::from_secs(5));
    all.extend(services);
    Ok(NodeConfig {
        fleet,
        entities: vec![own],
        boot: BootId(0),
        topics: vec![TopicRule { prefix: Prefix::all(), qos: None }],
        reliable: true,
        operators: Vec::new(),
        allow: Vec::new(),
        import: vec![Prefix::all()],
        export: vec![Prefix::all()],
        services: all,
        bridges: Vec::new(),
        links: Vec::new(),
    })
}

/// Calls the far ledger again and again.
struct Console {
    source: Source,
    to: Source,
    gap: Duration,
    until: Monotonic,
    facts: Facts,
    calls: BTreeMap<CallId, Entry>,
    number: u64,
    next: Option<Monotonic>,
}

impl Console {
    fn call(&mut self, now: Now, out: &mut Outbox) {
        self.next = (now.monotonic < self.until).then(|| now.monotonic + self.gap);
        let Ok(descriptor) = Descriptor::new("sim.Enter") else { return };
        self.number += 1;
        let entry = Entry { from: self.source.entity.get(), number: self.number };
        let to = Address::Service(self.to);
        let id = out.call(to, ContentType::Aldis, descriptor, entry.write(0), WITHIN);
        self.calls.insert(id, entry);
    }

    fn told(&self, envelope: &Envelope) {
        if envelope.message.label.descriptor() == told::TICKET
            && let Some(ticket) = aldis::decode::<told::CallTicket>(&envelope.message.content)
            && let told::CallState::Accepted(_) = ticket.state
            && let Some(entry) = self.calls.get(&ticket.call)
        {
            self.facts.tell(LedgerFact::Accepted(*entry));
        }
    }
}

impl Service for Console {
    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            Input::Started | Input::Deadline => self.call(now, out),
            Input::Message(envelope) => self.told(envelope),
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.next
    }
}

/// Counts how often it has handled each call. What it counts is on disk together with the word that it is done.
struct Ledger {
    source: Source,
    facts: Facts,
    entries: BTreeMap<Entry, u64>,
}

impl Ledger {
    fn enter(&mut self, request: &Envelope, out: &mut Outbox) {
        let (Some((entry, _)), Ok(held)) = (Entry::read(&request.message.content), Name::new(HELD)) else {
            return;
        };
        let times = self.entries.entry(entry).or_default();
        *times += 1;
        let label = Label::broadcast(ContentType::Aldis, held.clone(), self.source);
        let number = (entry.from << 32 | entry.number) as i64;
        let sample = Message::new(Arc::new(label), entry.write(*times));
        out.send(sample.of_instance(Instance::of_number(number)));
        out.reply(request, ContentType::Aldis, held, Bytes::new(), true);
        self.facts.tell(LedgerFact::Handled(entry));
    }
}

impl Service for Ledger {
    fn handle(&mut self, _: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            Input::Message(request) => {
                let call = request.message.call.as_deref();
                if call.is_some_and(|call| matches!(call.role, Role::Request { .. })) {
                    self.enter(request, out);
                }
            }
            Input::Recovered(own) => {
                if let Some((entry, times)) = Entry::read(&own.message.content) {
                    self.entries.insert(entry, times);
                    self.facts.tell(LedgerFact::Held(entry, times));
                }
            }
            _ => {}
        }
    }
}
