//! The writing side of every domain of a node: what the service says is written on the spot, or waits until readers have confirmed more.

use super::convert;
use aldis_dds::Writer;
use aldis_envelope::{Source, Wall};
use aldis_services::Event;
use aldis_services::service::domain::{DomainCommand, DomainEvent, Opening, RouteId, Sending};
use bytes::Bytes;
use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// How many events of a domain wait for the node at the most; then reliable writers are held up.
const INBOX_MAX: usize = 16_384;
/// The node is told anew how many changes wait whenever so many more do.
const TELL_EVERY: usize = 256;

/// What the thread of a domain has to do.
#[derive(Debug)]
pub(super) enum Work {
    /// Discovery has news.
    Discovered,
    /// Open a reader or a writer.
    Open(Box<Opening>),
    /// Close one.
    Close(RouteId),
    /// A writer can write no more for the moment.
    Blocked(RouteId),
}

type Change = (Sending, Bytes, Wall);

/// A writer, and what waits for it.
pub(super) struct Outlet {
    pub(super) writer: Writer,
    pub(super) pending: Mutex<VecDeque<Change>>,
    pub(super) waiting: Arc<AtomicUsize>,
}

impl Outlet {
    pub(super) fn pending(&self) -> MutexGuard<'_, VecDeque<Change>> {
        self.pending.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes what waits, as far as it is taken. What Cyclone DDS refuses is told and left out.
    pub(super) fn drain(&self, pending: &mut VecDeque<Change>, refused: &mut Vec<String>) {
        while let Some((sending, cdr, at)) = pending.front() {
            match self.writer.write(convert::sending(*sending), cdr, at.0) {
                Ok(false) => break,
                Ok(true) => {}
                Err(why) => refused.push(why.to_string()),
            }
            pending.pop_front();
            self.waiting.fetch_sub(1, Ordering::Relaxed);
        }
        self.writer.flush();
    }
}

/// What a route's writing side is.
enum Route {
    /// It is being opened; what is written waits.
    Opening(VecDeque<Change>),
    Open(Arc<Outlet>),
}

/// Events that wait for the node.
#[derive(Default)]
pub(crate) struct Inbox {
    events: Mutex<VecDeque<Event>>,
}

impl Inbox {
    fn events(&self) -> MutexGuard<'_, VecDeque<Event>> {
        self.events.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.events().is_empty()
    }

    /// Whether there was room, which what must be told is not asked for.
    pub(crate) fn push(&self, event: Event, must: bool) -> bool {
        let mut events = self.events();
        if !must && events.len() >= INBOX_MAX {
            return false;
        }
        events.push_back(event);
        true
    }
}

struct Port {
    work: Sender<Work>,
    inbox: Arc<Inbox>,
    routes: BTreeMap<RouteId, Route>,
    waiting: Arc<AtomicUsize>,
}

/// The domains of a node.
#[derive(Default)]
pub(crate) struct Domains {
    ports: BTreeMap<Source, Port>,
    dirty: Vec<Arc<Outlet>>,
}

impl Domains {
    pub(super) fn add(
        &mut self,
        source: Source,
        work: Sender<Work>,
        inbox: Arc<Inbox>,
        waiting: Arc<AtomicUsize>,
    ) {
        self.ports.insert(source, Port { work, inbox, routes: BTreeMap::new(), waiting });
    }

    pub(crate) fn remove(&mut self, source: Source) {
        self.ports.remove(&source);
        self.dirty.clear();
    }

    /// A writer is there: what waited for it is written.
    pub(super) fn opened(
        &mut self,
        source: Source,
        route: RouteId,
        outlet: Arc<Outlet>,
        events: &mut Vec<Event>,
    ) {
        let Some(port) = self.ports.get_mut(&source) else { return };
        let Some(Route::Opening(waiting)) = port.routes.get_mut(&route) else { return };
        let waiting = std::mem::take(waiting);
        let mut refused = Vec::new();
        {
            let mut pending = outlet.pending();
            port.waiting.fetch_add(waiting.len(), Ordering::Relaxed);
            *pending = waiting;
            outlet.drain(&mut pending, &mut refused);
            if !pending.is_empty() {
                let _ = port.work.send(Work::Blocked(route));
            }
        }
        events.extend(refused.into_iter().map(|why| Event::Domain(source, DomainEvent::Refused(route, why))));
        port.routes.insert(route, Route::Open(outlet));
    }

    /// A route could not be opened.
    pub(super) fn failed(&mut self, source: Source, route: RouteId) {
        if let Some(port) = self.ports.get_mut(&source) {
            port.routes.remove(&route);
        }
    }

    /// Does what the service wants.
    pub(crate) fn carry_out(&mut self, source: Source, command: DomainCommand, events: &mut Vec<Event>) {
        let Some(port) = self.ports.get_mut(&source) else { return };
        match command {
            DomainCommand::Open(opening) => {
                if opening.writes {
                    port.routes.insert(opening.route, Route::Opening(VecDeque::new()));
                }
                let _ = port.work.send(Work::Open(opening));
            }
            DomainCommand::Close(route) => {
                if let Some(Route::Open(outlet)) = port.routes.remove(&route) {
                    port.waiting.fetch_sub(outlet.pending().len(), Ordering::Relaxed);
                    // The last to hold a writer is the thread that closes it.
                    self.dirty.retain(|dirty| !Arc::ptr_eq(dirty, &outlet));
                }
                let _ = port.work.send(Work::Close(route));
            }
            DomainCommand::Write(route, sending, cdr, at) => match port.routes.get_mut(&route) {
                Some(Route::Opening(waiting)) => waiting.push_back((sending, cdr, at)),
                Some(Route::Open(outlet)) => {
                    let outlet = outlet.clone();
                    match write(port, route, &outlet, (sending, cdr, at)) {
                        Ok(None) => self.dirty.push(outlet),
                        Ok(Some(waiting)) => events.push(Event::Domain(source, waiting)),
                        Err(why) => events.push(Event::Domain(source, DomainEvent::Refused(route, why))),
                    }
                }
                None => {}
            },
        }
    }

    /// What has arrived while nobody had time.
    pub(crate) fn take_arrivals(&mut self, events: &mut Vec<Event>) {
        for port in self.ports.values() {
            events.extend(port.inbox.events().drain(..));
        }
    }

    /// Whether something is held back to be sent together.
    pub(crate) fn has_output(&self) -> bool {
        !self.dirty.is_empty()
    }

    /// Sends what is held back.
    pub(crate) fn flush(&mut self) {
        self.dirty.dedup_by(|a, b| Arc::ptr_eq(a, b));
        for outlet in self.dirty.drain(..) {
            outlet.writer.flush();
        }
    }
}

/// Writes a change, or puts it behind what waits already. What the node is to be told of that.
fn write(
    port: &Port,
    route: RouteId,
    outlet: &Outlet,
    change: Change,
) -> Result<Option<DomainEvent>, String> {
    let mut pending = outlet.pending();
    let (sending, cdr, at) = &change;
    if pending.is_empty() {
        if outlet.writer.write(convert::sending(*sending), cdr, at.0).map_err(|why| why.to_string())? {
            return Ok(None);
        }
        let _ = port.work.send(Work::Blocked(route));
    }
    pending.push_back(change);
    let waiting = port.waiting.fetch_add(1, Ordering::Relaxed) + 1;
    Ok((waiting.is_multiple_of(TELL_EVERY)).then_some(DomainEvent::Waiting(waiting)))
}
