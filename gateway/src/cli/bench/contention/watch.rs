//! What is seen of the contention from shore.

use super::order::{OrderCommand, order};
use aldis_envelope::umaa::{
    self, Command, CommandAckReport, CommandState, CommandStatus, CommandStatusReason, Key,
    ResourceAllocationCommand, SessionKey, Topic, TopicInfo,
};
use aldis_envelope::{Change, Envelope, Guid, Guids, Monotonic, Now, Prefix, Source};
use aldis_services::conform::{Bounds, Decoder, Monitor, Report, Watcher};
use aldis_services::umaa::command::{Consumer, ConsumerSettings, Outcome, Told};
use aldis_services::{Input, Outbox, Service};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How much later one process is heard than another.
const SLACK: Duration = Duration::from_secs(2);
/// How often the pirate commands.
const PIRACY_EVERY: Duration = Duration::from_millis(40);

/// A command as its provider tells of it.
#[derive(Debug, Clone, Default)]
struct Session {
    state: Option<CommandState>,
    consumer: Option<Guid>,
}

/// What was seen.
#[derive(Default)]
pub(super) struct Seen {
    /// How often control was given, refused, taken from one by another.
    pub(super) given: u64,
    pub(super) refused: u64,
    pub(super) taken_over: u64,
    /// How many commands of consumers were executed.
    pub(super) executed: u64,
    /// How many commands went out without control, and how many of them were executed.
    pub(super) without_control: u64,
    pub(super) pirated: u64,
    /// Two consumers in control at a time.
    pub(super) two_holders: Vec<String>,
    /// All who ask have ended: nobody is to begin anything more.
    pub(super) is_ending: bool,
    allocations: BTreeMap<SessionKey, Session>,
    orders: BTreeMap<SessionKey, Session>,
    watcher: Option<Watcher>,
    now: Option<Monotonic>,
    /// Woken with each message: it waits for what it sees.
    pub(super) tells: Option<std::thread::Thread>,
}

impl Seen {
    /// What the monitor has found.
    pub(super) fn finish(&mut self) -> Option<Report> {
        Some(self.watcher.take()?.finish(self.now?))
    }

    /// What is on the bus that is not to be there when nobody asks any more.
    pub(super) fn left(&self) -> Vec<String> {
        let of = |kind: &str, sessions: &BTreeMap<SessionKey, Session>| {
            let left = sessions.iter().map(|(key, session)| {
                format!("{kind} {} of {:?}: {:?}", key.session_id, session.consumer, session.state)
            });
            left.collect::<Vec<_>>()
        };
        [of("allocation", &self.allocations), of("order", &self.orders)].concat()
    }

    fn message(&mut self, envelope: &Envelope) {
        self.allocation(envelope);
        if let Some((CommandState::Executing, _)) = follow::<OrderCommand>(&mut self.orders, envelope) {
            self.executed += 1;
        }
    }

    fn allocation(&mut self, envelope: &Envelope) {
        if let Some((state, reason)) = follow::<ResourceAllocationCommand>(&mut self.allocations, envelope) {
            self.given += u64::from(state == CommandState::Executing);
            let is = |wanted| u64::from(state == CommandState::Failed && reason == wanted);
            self.refused += is(CommandStatusReason::ResourceRejected);
            self.taken_over += is(CommandStatusReason::Interrupted);
        }
        let executing =
            self.allocations.values().filter(|session| session.state == Some(CommandState::Executing));
        let mut holders: Vec<_> = executing.filter_map(|session| session.consumer).collect();
        holders.sort();
        holders.dedup();
        if holders.len() > 1 {
            let text = format!("{holders:?}");
            if self.two_holders.last() != Some(&text) {
                self.two_holders.push(text);
            }
        }
    }
}

/// Follows the commands of a family as their providers tell of them. A state that is news, with its reason.
fn follow<C: Command>(
    sessions: &mut BTreeMap<SessionKey, Session>,
    envelope: &Envelope,
) -> Option<(CommandState, CommandStatusReason)> {
    let (message, name) = (&envelope.message, envelope.message.label.descriptor());
    if name != C::STATUS_NAME && name != C::ACK_REPORT_NAME {
        return None;
    }
    if message.change == Change::Dispose {
        if let Some(key) = message.instance.as_deref().and_then(SessionKey::of_instance) {
            sessions.remove(&key);
        }
        return None;
    }
    if message.change != Change::Put {
        return None;
    }
    if name == C::ACK_REPORT_NAME {
        let ack = umaa::decode::<CommandAckReport<C>>(&message.content).ok()?;
        sessions.entry(ack.key()).or_default().consumer = Some(ack.command.header().source);
        return None;
    }
    let status = umaa::decode::<CommandStatus<C>>(&message.content).ok()?;
    let session = sessions.entry(status.key()).or_default();
    let is_news = session.state.replace(status.command_status) != Some(status.command_status);
    is_news.then_some((status.command_status, status.command_status_reason))
}

fn lock(seen: &Mutex<Seen>) -> MutexGuard<'_, Seen> {
    seen.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Hears everything.
pub(super) struct Watch(Arc<Mutex<Seen>>);

impl Watch {
    pub(super) fn new(seen: Arc<Mutex<Seen>>) -> Self {
        let monitor = Monitor::new(Bounds { slack: SLACK, ..Bounds::default() }, []);
        let topics = [
            TopicInfo::of::<OrderCommand>(),
            TopicInfo::of::<CommandStatus<OrderCommand>>(),
            TopicInfo::of::<CommandAckReport<OrderCommand>>(),
        ];
        lock(&seen).watcher = Some(Watcher::joining(monitor, Decoder::new(topics)));
        Self(seen)
    }
}

impl Service for Watch {
    fn subscriptions(&self) -> Vec<Prefix> {
        Prefix::new("UMAA::").into_iter().collect()
    }

    fn follows_bus(&self) -> bool {
        true
    }

    fn handle(&mut self, now: Now, input: Input<'_>, _: &mut Outbox) {
        let mut seen = lock(&self.0);
        seen.now = Some(now.monotonic);
        if let Input::Message(envelope) = &input
            && envelope.message.call.is_none()
        {
            seen.message(envelope);
            seen.tells.iter().for_each(std::thread::Thread::unpark);
        }
        let Some(watcher) = &mut seen.watcher else { return };
        match input {
            Input::HistoryComplete(_) => watcher.history_complete(now.monotonic),
            Input::Message(envelope) if envelope.message.call.is_none() => {
                watcher.message(now.monotonic, envelope);
            }
            Input::Token(writer, false) => watcher.vanished(now.monotonic, writer),
            _ => {}
        }
    }
}

/// Commands the providers without ever asking for control.
pub(super) struct Pirate {
    consumer: Consumer<OrderCommand>,
    providers: Vec<Guid>,
    seen: Arc<Mutex<Seen>>,
    next: Option<Monotonic>,
    sent: usize,
}

impl Pirate {
    pub(super) fn new(source: Source, guids: Guids, providers: Vec<Guid>, seen: Arc<Mutex<Seen>>) -> Self {
        let settings =
            ConsumerSettings { answer_within: Duration::from_secs(3), ..ConsumerSettings::default() };
        Self { consumer: Consumer::new(source, guids, settings), providers, seen, next: None, sent: 0 }
    }

    fn command(&mut self, now: Now, out: &mut Outbox) {
        self.next = Some(now.monotonic + PIRACY_EVERY);
        let provider = self.providers[self.sent % self.providers.len()];
        if !lock(&self.seen).is_ending && self.consumer.start(now, provider, order(5), out).is_ok() {
            self.sent += 1;
            lock(&self.seen).without_control += 1;
        }
    }
}

impl Service for Pirate {
    fn subscriptions(&self) -> Vec<Prefix> {
        self.consumer.subscriptions()
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        for told in self.consumer.handle(now, &input, out) {
            let is_executed = matches!(
                told,
                Told::State { state: CommandState::Executing, .. }
                    | Told::Ended { outcome: Outcome::Completed, .. }
            );
            lock(&self.seen).pirated += u64::from(is_executed);
        }
        match input {
            Input::HistoryComplete(_) => self.next = Some(now.monotonic + PIRACY_EVERY),
            Input::Shutdown => self.next = None,
            Input::Deadline if self.next.is_some_and(|at| at <= now.monotonic) => self.command(now, out),
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        [self.consumer.next_deadline(), self.next].into_iter().flatten().min()
    }
}
