//! The node: from the outbox of a service in one process to the handler of a service in another.

use super::super::service_node::{label, member, source};
use super::{LAST, PATIENCE, Side, content, ended};
use crate::cli::exit::Failure;
use crate::cli::member::Member;
use aldis_envelope::{Label, Message, Monotonic, Now, Prefix};
use aldis_services::{Input, Outbox, Service};
use bytes::Bytes;
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::{Duration, Instant};

/// How many messages the sending service puts into its outbox at once.
const BATCH: u64 = 256;
/// How often the sending service looks for something to do.
const LOOK_EVERY: Duration = Duration::from_millis(1);

/// What the sending service is to do.
enum Task {
    Load(Bytes, Bytes, u64),
    Trips(Bytes, u64),
}

enum Told {
    Done(u64),
    Trips(Vec<Duration>),
}

/// The sending service.
struct Sending {
    load: Arc<Label>,
    ping: Arc<Label>,
    tasks: Arc<Mutex<Option<Task>>>,
    tell: mpsc::Sender<Told>,
    task: Option<Task>,
    trips: Vec<Duration>,
    started: Instant,
    next: Option<Monotonic>,
}

impl Service for Sending {
    fn subscriptions(&self) -> Vec<Prefix> {
        Prefix::new("bench.to.1").into_iter().collect()
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            Input::Started => self.next = Some(now.monotonic + LOOK_EVERY),
            Input::Deadline => self.work(now, out),
            Input::Message(envelope) if envelope.message.label.descriptor() == "bench.to.1.Pong" => {
                self.pong(now, out)
            }
            Input::Message(envelope) => {
                let seen = envelope.message.content.as_ref().try_into().map(u64::from_le_bytes);
                let _ = self.tell.send(Told::Done(seen.unwrap_or_default()));
            }
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.next
    }
}

impl Sending {
    fn work(&mut self, now: Now, out: &mut Outbox) {
        self.next = Some(now.monotonic + LOOK_EVERY);
        if self.task.is_none() {
            self.task = self.tasks.lock().unwrap_or_else(PoisonError::into_inner).take();
            if let Some(Task::Trips(content, _)) = &self.task {
                self.started = Instant::now();
                out.send(Message::new(self.ping.clone(), content.clone()));
                self.next = None;
                return;
            }
        }
        let Some(Task::Load(usual, last, left)) = &mut self.task else { return };
        let batch = BATCH.min(*left);
        *left -= batch;
        for _ in 1..batch {
            out.send(Message::new(self.load.clone(), usual.clone()));
        }
        let end = if *left == 0 { last } else { usual };
        out.send(Message::new(self.load.clone(), end.clone()));
        self.next = Some(now.monotonic);
        if *left == 0 {
            self.task = None;
            self.next = Some(now.monotonic + LOOK_EVERY);
        }
    }

    fn pong(&mut self, now: Now, out: &mut Outbox) {
        let Some(Task::Trips(content, left)) = &mut self.task else { return };
        self.trips.push(self.started.elapsed());
        *left -= 1;
        if *left > 0 {
            self.started = Instant::now();
            out.send(Message::new(self.ping.clone(), content.clone()));
        } else {
            self.task = None;
            self.next = Some(now.monotonic + LOOK_EVERY);
            let _ = self.tell.send(Told::Trips(std::mem::take(&mut self.trips)));
        }
    }
}

/// The sending side.
pub(super) struct Sender {
    member: Option<Member>,
    tasks: Arc<Mutex<Option<Task>>>,
    told: mpsc::Receiver<Told>,
}

impl Sender {
    pub(super) fn listen(locator: &str) -> Result<Self, Failure> {
        let (tell, told) = mpsc::channel();
        let tasks = Arc::new(Mutex::new(None));
        let (load, ping) = (label("bench.to.2.Load", source(1)?)?, label("bench.to.2.Ping", source(1)?)?);
        let for_service = tasks.clone();
        let make = move || -> Box<dyn Service> {
            Box::new(Sending {
                load: load.clone(),
                ping: ping.clone(),
                tasks: for_service.clone(),
                tell: tell.clone(),
                task: None,
                trips: Vec::new(),
                started: Instant::now(),
                next: None,
            })
        };
        let member = member(1, &format!("listen = [\"{locator}\"]"), make)?;
        Ok(Self { member: Some(member), tasks, told })
    }

    /// Sends pings until one is answered.
    pub(super) fn wait_for_peer(&mut self) -> Result<(), Failure> {
        let until = Instant::now() + PATIENCE;
        while Instant::now() < until {
            self.ask(Task::Load(content(100, true), content(100, true), 1));
            if self.told.recv_timeout(Duration::from_millis(100)).is_ok() {
                while self.told.recv_timeout(Duration::from_millis(100)).is_ok() {}
                return Ok(());
            }
        }
        Err(ended(()))
    }

    fn ask(&self, task: Task) {
        *self.tasks.lock().unwrap_or_else(PoisonError::into_inner) = Some(task);
    }

    pub(super) fn leave(mut self) -> Result<(), Failure> {
        self.member.take().map_or(Ok(()), Member::leave)
    }
}

impl Side for Sender {
    fn load(&mut self, size: usize, messages: u64) -> Result<(Duration, u64), Failure> {
        let start = Instant::now();
        self.ask(Task::Load(content(size, false), content(size, true), messages));
        match self.told.recv_timeout(PATIENCE).map_err(ended)? {
            Told::Done(seen) => Ok((start.elapsed(), seen)),
            Told::Trips(_) => Err(ended(())),
        }
    }

    fn round_trips(&mut self, size: usize, count: u64) -> Result<Vec<Duration>, Failure> {
        self.ask(Task::Trips(content(size, false), count));
        match self.told.recv_timeout(PATIENCE).map_err(ended)? {
            Told::Trips(trips) => Ok(trips),
            Told::Done(_) => Err(ended(())),
        }
    }
}

/// The far service: counts, and answers.
struct Sink {
    done: Arc<Label>,
    pong: Arc<Label>,
    seen: u64,
}

impl Service for Sink {
    fn subscriptions(&self) -> Vec<Prefix> {
        Prefix::new("bench.to.2").into_iter().collect()
    }

    fn handle(&mut self, _: Now, input: Input<'_>, out: &mut Outbox) {
        let Input::Message(envelope) = input else { return };
        let message = &envelope.message;
        if message.label.descriptor() == "bench.to.2.Ping" {
            out.send(Message::new(self.pong.clone(), message.content.clone()));
            return;
        }
        self.seen += 1;
        if message.content.first() == Some(&LAST) {
            let seen = std::mem::take(&mut self.seen).to_le_bytes();
            out.send(Message::new(self.done.clone(), Bytes::copy_from_slice(&seen)));
        }
    }
}

/// The far side, until it is killed.
pub(super) fn serve(connect: &str) -> Result<(), Failure> {
    let (done, pong) = (label("bench.to.1.Done", source(2)?)?, label("bench.to.1.Pong", source(2)?)?);
    let make =
        move || -> Box<dyn Service> { Box::new(Sink { done: done.clone(), pong: pong.clone(), seen: 0 }) };
    let _member = member(2, &format!("connect = [\"{connect}\"]"), make)?;
    crate::cli::bench::serve_until_killed()
}
