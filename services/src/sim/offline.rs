//! One node alone in virtual time: what it says to messages that are played to it, as fast as the machine goes.

use crate::event::{Effect, Event};
use crate::node::{Node, NodeConfig};
use crate::registry;
use crate::service::{Input, Outbox, Service, ServiceSpec};
use crate::uxas::machine::Post;
use aldis_envelope::lmcp::Object;
use aldis_envelope::{BootId, EntityId, Fleet, Guids, Monotonic, Now, Prefix, ServiceId, Source, Wall};
use bytes::Bytes;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// The first service id that is given to services.
pub(super) const FIRST_SERVICE: u64 = 100;

/// The id of the service that plays.
pub(super) const PLAYER: u64 = 9000;

/// A message that is played, and when.
pub struct Played {
    /// When, from the start.
    pub at: Duration,
    /// What.
    pub object: Box<dyn Object>,
}

/// A message that was heard.
#[derive(Debug, Clone)]
pub struct Overheard {
    /// When.
    pub at: Monotonic,
    /// Its full type name.
    pub descriptor: String,
    /// Its content, as it was sent.
    pub content: Bytes,
}

/// What is to be played, in the order of its times.
pub(super) type Queue = Arc<Mutex<Vec<Played>>>;

/// Plays messages and hears all others.
pub(super) struct Player {
    pub(super) queue: Queue,
    pub(super) heard: Sender<Overheard>,
}

impl Service for Player {
    fn subscriptions(&self) -> Vec<Prefix> {
        vec![Prefix::all()]
    }

    fn follows_bus(&self) -> bool {
        true
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        if let Input::Message(envelope) = input {
            let message = &envelope.message;
            let overheard = Overheard {
                at: now.monotonic,
                descriptor: message.label.descriptor().to_owned(),
                content: message.content.clone(),
            };
            // Nobody listens any more once the run is over.
            let _ = self.heard.send(overheard);
            return;
        }
        let Ok(mut queue) = self.queue.lock() else { return };
        let mut post = Post::new(now, out);
        while queue.first().is_some_and(|played| Monotonic::since_start(played.at) <= now.monotonic) {
            let played = queue.remove(0);
            post.broadcast(played.object.as_ref());
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        let queue = self.queue.lock().ok()?;
        queue.first().map(|played| Monotonic::since_start(played.at))
    }
}

/// A node alone.
pub struct Offline {
    node: Node,
    now: Monotonic,
    armed: Option<Monotonic>,
    queue: Queue,
    heard: Receiver<Overheard>,
    /// What the node said to people.
    pub notes: Vec<String>,
}

impl Offline {
    /// A node of an entity with these services, numbered in their order from 100 on; messages may come from any service.
    ///
    /// # Errors
    /// Why there is no such node.
    pub fn new(entity: EntityId, services: Vec<(String, registry::Kind)>) -> Result<Self, String> {
        let fleet = Fleet::new("offline").map_err(|why| why.to_string())?;
        let guids = Guids::new(&fleet, aldis_envelope::GuidForm::default());
        let (queue, (sender, heard)) = (Queue::default(), channel());
        let id = |number: u64| ServiceId::new(number).map_err(|why| why.to_string());
        let mut specs = Vec::new();
        for ((name, kind), number) in services.into_iter().zip(FIRST_SERVICE..) {
            specs.push(registry::service(Source::new(entity, id(number)?), &name, kind, &guids));
        }
        let played = queue.clone();
        let player = Source::new(entity, id(PLAYER)?);
        let factory = Arc::new(move || -> Box<dyn Service> {
            Box::new(Player { queue: played.clone(), heard: sender.clone() })
        });
        specs.push(ServiceSpec { source: player, name: "player".to_owned(), factory });
        let node = Node::new(NodeConfig {
            fleet,
            entities: vec![entity],
            boot: BootId(1),
            operators: Vec::new(),
            allow: Vec::new(),
            import: Vec::new(),
            export: Vec::new(),
            topics: Vec::new(),
            reliable: false,
            services: specs,
            bridges: Vec::new(),
            links: Vec::new(),
        })?;
        let mut offline = Self { node, now: Monotonic::START, armed: None, queue, heard, notes: Vec::new() };
        offline.handle(Vec::new());
        Ok(offline)
    }

    /// Has messages played; those whose time is over at once.
    pub fn play(&mut self, mut messages: Vec<Played>) {
        if let Ok(mut queue) = self.queue.lock() {
            queue.append(&mut messages);
            // A stable sort: messages of one time stay in their order.
            queue.sort_by_key(|played| played.at);
        }
        // Any token wakes who follows the bus: the player looks at its queue.
        self.handle(vec![Event::Alive(Source::new(self.node.entity(), ServiceId::NODE), false)]);
    }

    /// The virtual time.
    pub fn now(&self) -> Monotonic {
        self.now
    }

    /// What was heard since it was asked last.
    pub fn heard(&mut self) -> Vec<Overheard> {
        self.heard.try_iter().collect()
    }

    /// Goes on to the next moment at which something happens, but not beyond `until`; whether there is one.
    pub fn step(&mut self, until: Monotonic) -> bool {
        let Some(at) = self.armed.filter(|&at| at <= until) else {
            self.now = self.now.max(until);
            return false;
        };
        self.now = self.now.max(at);
        self.armed = None;
        self.handle(vec![Event::Deadline]);
        true
    }

    /// Handles events, and all that comes of them at once.
    fn handle(&mut self, mut events: Vec<Event>) {
        // The wall clock is that of a machine that started a day after 1970: states without a time count as told then.
        let wall =
            Wall(86_400_000_000_000 + i64::try_from(self.now.elapsed().as_nanos()).unwrap_or(i64::MAX / 2));
        let now = Now { monotonic: self.now, wall };
        let mut effects = Vec::new();
        loop {
            self.node.handle(now, &mut events, &mut effects);
            for effect in effects.drain(..) {
                match effect {
                    Effect::Arm(at) => self.armed = Some(at),
                    Effect::Job(source, number, job) => {
                        let output = catch_unwind(AssertUnwindSafe(job));
                        let output = output.map_err(|panic| crate::host::panic_text(&*panic));
                        events.push(Event::Job(source, number, output));
                    }
                    Effect::Say(note) => self.notes.push(note.text),
                    _ => {}
                }
            }
            if events.is_empty() {
                return;
            }
        }
    }
}

#[cfg(test)]
mod failures;
#[cfg(test)]
mod tests;
