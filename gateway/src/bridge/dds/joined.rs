//! A domain that is joined: its thread opens and closes readers and writers, and follows who is there.

use super::ports::{Inbox, Outlet, Work};
use super::{Endpoint, LOOK_EVERY, convert};
use crate::runtime::Shared;
use aldis_dds::{
    Change, DdsError, Discovery, Incoming, Mismatch, Participant, Reader, Topic, TypeInformation, TypeSource,
    Writer,
};
use aldis_envelope::description::Extensibility;
use aldis_services::Event;
use aldis_services::service::domain::{DomainEvent, DomainGuid, Opening, RouteId, Xcdr};
use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// How long a blocked writer's readers are waited for at a time.
const CONFIRM_WITHIN: Duration = Duration::from_millis(5);

/// Own participants differ in how the types of their topics may grow: one name stands for one type in each. The last is true where peers
/// are told nothing of types.
type Kind = (Extensibility, bool);

/// What the thread of a domain holds.
pub(super) struct Joined<'a> {
    core: &'a Shared,
    endpoint: &'a Endpoint,
    // Readers, writers and discovery go before the participants that they are of.
    readers: BTreeMap<RouteId, Reader>,
    outlets: BTreeMap<RouteId, (Arc<Outlet>, Option<Instant>)>,
    discovery: Discovery,
    participants: BTreeMap<Kind, Participant>,
    told: BTreeMap<DomainGuid, TypeInformation>,
    news: Arc<AtomicBool>,
    work: Receiver<Work>,
    sender: Sender<Work>,
    inbox: Arc<Inbox>,
    waiting: Arc<AtomicUsize>,
}

impl<'a> Joined<'a> {
    pub(super) fn open(core: &'a Shared, endpoint: &'a Endpoint) -> Result<Self, DdsError> {
        let (sender, work) = channel();
        let participant = Participant::open(&endpoint.participant)?;
        let news = Arc::new(AtomicBool::new(false));
        let (tell, has_news) = (Mutex::new(sender.clone()), news.clone());
        let discovered = Box::new(move || {
            if !has_news.swap(true, Ordering::AcqRel)
                && let Ok(tell) = tell.lock()
            {
                let _ = tell.send(Work::Discovered);
            }
        });
        let discovery = Discovery::new(&participant, discovered)?;
        let (inbox, waiting) = (Arc::new(Inbox::default()), Arc::new(AtomicUsize::new(0)));
        let joined = Self {
            core,
            endpoint,
            readers: BTreeMap::new(),
            outlets: BTreeMap::new(),
            discovery,
            participants: BTreeMap::from([((Extensibility::Appendable, false), participant)]),
            told: BTreeMap::new(),
            news,
            work,
            sender,
            inbox,
            waiting,
        };
        core.lock().domains().add(
            endpoint.source,
            joined.sender.clone(),
            joined.inbox.clone(),
            joined.waiting.clone(),
        );
        Ok(joined)
    }

    /// Works until the node ends.
    pub(super) fn run(&mut self, ended: &impl Fn() -> bool) {
        let _ = self.sender.send(Work::Discovered);
        while !ended() {
            let blocked = self.outlets.values().any(|(_, since)| since.is_some());
            let work = match (blocked, self.work.try_recv()) {
                (_, Ok(work)) => Ok(work),
                (true, Err(_)) => Err(RecvTimeoutError::Timeout),
                (false, Err(_)) => self.work.recv_timeout(LOOK_EVERY),
            };
            match work {
                Ok(Work::Discovered) => self.discovered(),
                Ok(Work::Open(opening)) => self.open_route(&opening),
                Ok(Work::Close(route)) => {
                    self.readers.remove(&route);
                    self.outlets.remove(&route);
                }
                Ok(Work::Blocked(route)) => {
                    if let Some((_, since)) = self.outlets.get_mut(&route) {
                        since.get_or_insert_with(Instant::now);
                    }
                }
                Err(_) => self.unblock(),
            }
        }
    }

    fn tell(&self, event: DomainEvent) {
        self.core.lock().handle(&mut vec![Event::Domain(self.endpoint.source, event)]);
    }

    fn main(&self) -> Result<&Participant, DdsError> {
        self.participants.values().next().ok_or_else(|| DdsError {
            call: "dds_create_participant",
            what: "the bridge".into(),
            cause: "there is none".into(),
        })
    }

    fn discovered(&mut self) {
        self.news.store(false, Ordering::Release);
        let changes = match self.discovery.changes() {
            Ok(changes) => changes,
            Err(why) => {
                tracing::warn!("{why}");
                return;
            }
        };
        for change in changes {
            let event = match change {
                Change::Participant(guid, data) => DomainEvent::Participant(convert::guid(guid), data),
                Change::ParticipantGone(guid) => DomainEvent::ParticipantGone(convert::guid(guid)),
                Change::EndpointGone(guid) => {
                    self.told.remove(&convert::guid(guid));
                    DomainEvent::EndpointGone(convert::guid(guid))
                }
                Change::Endpoint(found) => {
                    let mut endpoint = convert::endpoint(&found);
                    if let (Some(information), Ok(participant)) = (found.type_information, self.main()) {
                        match information.extensibility(participant) {
                            Ok(extensibility) => endpoint.extensibility = Some(extensibility),
                            Err(why) => tracing::debug!("{}: {why}", endpoint.topic),
                        }
                        self.told.insert(endpoint.guid, information);
                    }
                    DomainEvent::Endpoint(Box::new(endpoint))
                }
            };
            self.tell(event);
        }
    }

    fn open_route(&mut self, opening: &Opening) {
        let source = self.endpoint.source;
        let opened = if opening.writes { self.open_writer(opening) } else { self.open_reader(opening) };
        let result = opened.map_err(|why| why.to_string());
        let mut events = Vec::new();
        let mut core = self.core.lock();
        match (&result, self.outlets.get(&opening.route)) {
            (Ok(()), Some((outlet, _))) => {
                core.domains().opened(source, opening.route, outlet.clone(), &mut events);
            }
            (Err(_), _) => core.domains().failed(source, opening.route),
            _ => {}
        }
        events.push(Event::Domain(source, DomainEvent::Opened(opening.route, result)));
        core.handle(&mut events);
    }

    /// The topic of a route. Where a type that may grow is written in XCDR1, a final twin of it, of which peers are told nothing, has
    /// the same bytes: Cyclone DDS refuses the type itself.
    fn topic(&mut self, opening: &Opening) -> Result<Topic, DdsError> {
        let first = opening.quality.xcdr.first();
        let twin =
            opening.writes && first == Some(&Xcdr::V1) && opening.extensibility != Extensibility::Final;
        let extensibility = if twin { Extensibility::Final } else { opening.extensibility };
        let participant = self.participant((extensibility, twin))?;
        let told = opening.like.and_then(|like| self.told.get(&like)).filter(|_| !twin);
        if let Some(information) = told {
            return Topic::new(&participant, &opening.topic, TypeSource::Discovered(information));
        }
        let source = TypeSource::Described {
            library: &self.endpoint.types,
            type_name: &opening.type_name,
            extensibility: Some(extensibility),
            told: !twin,
        };
        Topic::new(&participant, &opening.topic, source)
    }

    fn participant(&mut self, kind: Kind) -> Result<Participant, DdsError> {
        if let Some(known) = self.participants.get(&kind) {
            return Ok(known.clone());
        }
        let participant = Participant::open(&self.endpoint.participant)?;
        self.participants.insert(kind, participant.clone());
        Ok(participant)
    }

    fn open_reader(&mut self, opening: &Opening) -> Result<(), DdsError> {
        let topic = self.topic(opening)?;
        let (core, inbox) = (self.core.clone(), self.inbox.clone());
        let (source, route) = (self.endpoint.source, opening.route);
        let receive = move |incoming: Incoming| {
            let (event, must) = match incoming {
                Incoming::Change(change) => (DomainEvent::Arrived(route, convert::arrival(change)), false),
                Incoming::WriterGone { writer, autodispose } => {
                    (DomainEvent::WriterGone(route, convert::guid(writer), autodispose), true)
                }
            };
            core.domain_event(&inbox, Event::Domain(source, event), must)
        };
        let qos = convert::qos(&opening.quality, false);
        let reader = Reader::new(&topic, &qos, Box::new(receive), self.on_mismatch(route))?;
        self.readers.insert(route, reader);
        Ok(())
    }

    fn open_writer(&mut self, opening: &Opening) -> Result<(), DdsError> {
        let topic = self.topic(opening)?;
        let qos = convert::qos(&opening.quality, true);
        let writer = Writer::new(&topic, &qos, self.on_mismatch(opening.route))?;
        let (pending, waiting) = (Mutex::new(VecDeque::new()), self.waiting.clone());
        self.outlets.insert(opening.route, (Arc::new(Outlet { writer, pending, waiting }), None));
        Ok(())
    }

    fn on_mismatch(&self, route: RouteId) -> Box<dyn Fn(Mismatch) + Send + Sync> {
        let (core, inbox, source) = (self.core.clone(), self.inbox.clone(), self.endpoint.source);
        Box::new(move |mismatch| {
            let event = DomainEvent::Mismatch(route, mismatch.policy.to_string());
            core.domain_event(&inbox, Event::Domain(source, event), true);
        })
    }

    /// Goes on with what waits for readers' confirmations; what waits too long is dropped.
    fn unblock(&mut self) {
        let mut events = Vec::new();
        let source = self.endpoint.source;
        for (route, (outlet, since)) in &mut self.outlets {
            let Some(blocked) = since else { continue };
            let _ = outlet.writer.wait_for_acknowledgments(CONFIRM_WITHIN);
            let mut refused = Vec::new();
            let mut pending = outlet.pending();
            let before = pending.len();
            outlet.drain(&mut pending, &mut refused);
            if pending.len() < before {
                *blocked = Instant::now();
            } else if blocked.elapsed() > self.endpoint.stall_timeout {
                let shed = pending.len();
                pending.clear();
                self.waiting.fetch_sub(shed, Ordering::Relaxed);
                events.push(Event::Domain(source, DomainEvent::Shed(*route, shed as u64)));
            }
            if pending.is_empty() {
                *since = None;
            }
            drop(pending);
            let refused = refused.into_iter().map(|why| DomainEvent::Refused(*route, why));
            events.extend(refused.map(|event| Event::Domain(source, event)));
        }
        events.push(Event::Domain(source, DomainEvent::Waiting(self.waiting.load(Ordering::Relaxed))));
        self.core.lock().handle(&mut events);
    }
}
