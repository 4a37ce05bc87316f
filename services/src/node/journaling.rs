//! The node's part in what outlives the process: it waits for the journal at the start, keeps what persistent topics say
//! before it hands it on, and tells what the journal refuses.

use super::deliver::Kept;
use super::keeping::{Held, OF_LINKS, OF_NODE, SAMPLES};
use super::{Node, Origin, Work};
use crate::dds::{Durability, Record};
use crate::event::{Effect, Event};
use crate::journal::{JournalEvent, Recovered, Refused};
use crate::service::{Component, ComponentHealth, Condition, Input, Level, Note, Unconfirmed};
use aldis_envelope::{BootId, Envelope, Monotonic, Now, Priority, ServiceId, Source, Stamp};
use bytes::Bytes;
use std::collections::BTreeMap;
use std::time::Duration;

/// The record with the wall clock of the journal's beginning.
const BEGUN: &[u8] = b"begun";
/// How long the end of a node waits for the disk.
const END_WITHIN: Duration = Duration::from_secs(3);
/// How many damaged parts are named one by one.
const DAMAGE_NAMED_MAX: usize = 16;

/// How far the journal is.
#[derive(Debug, Default)]
enum Stage {
    /// There is none: what is persistent is kept as long as the node lives.
    #[default]
    None,
    /// It is read back.
    Opening,
    /// It was begun just now: the node starts when that is on disk, in this batch.
    Beginning(u64, Box<Recovered>),
    /// It keeps what it is given.
    Open,
    /// It keeps nothing, for this reason.
    Unusable(Refused),
}

/// What a node knows of its journal.
#[derive(Default)]
pub(super) struct Journaling {
    stage: Stage,
    /// What stands, by number.
    records: BTreeMap<u64, Bytes>,
    /// When the journal was begun, in nanoseconds on the wall clock of that time.
    begun: Option<u64>,
    /// What came before the node could start.
    early: Vec<Event>,
    /// Whether people have been told that it refuses.
    is_failing: bool,
    end_by: Option<Monotonic>,
    has_ended: bool,
}

impl Journaling {
    /// A node that waits for its journal before it starts.
    fn awaited() -> Self {
        Self { stage: Stage::Opening, ..Self::default() }
    }

    /// Whether there is a journal.
    pub(super) fn is_there(&self) -> bool {
        !matches!(self.stage, Stage::None)
    }

    /// Why it keeps nothing, where it cannot be used.
    pub(super) fn unusable(&self) -> Option<&Refused> {
        match &self.stage {
            Stage::Unusable(why) => Some(why),
            _ => None,
        }
    }

    /// Whether the node still waits for it.
    pub(super) fn is_opening(&self) -> bool {
        matches!(self.stage, Stage::Opening | Stage::Beginning(..))
    }

    /// When the end of the node waits for it no longer.
    pub(super) fn end_by(&self) -> Option<Monotonic> {
        self.end_by
    }
}

impl Node {
    /// The node with a journal: it starts when [`Event::Journal`] has told all that stands.
    #[must_use]
    pub fn with_journal(mut self) -> Self {
        self.journaling = Journaling::awaited();
        self
    }

    /// This life of the node. With a journal it is known when that has been read back: the time when the journal was begun
    /// and the number of the start, so that it rises whatever the clock does, and also where another journal, or none,
    /// was there before.
    pub fn boot(&self) -> BootId {
        self.config.boot
    }

    /// Whether what a source says on persistent topics is brought to disk. Health and log tell of the disk's own trouble, and
    /// must not wait for it.
    pub(super) fn journals(&self, source: Source) -> bool {
        !matches!(self.journaling.stage, Stage::None)
            && !matches!(source.service, ServiceId::HEALTH | ServiceId::LOG)
    }

    /// Takes what the journal tells; all else waits until the node has started.
    pub(super) fn before_start(&mut self, now: Now, events: &mut Vec<Event>, effects: &mut Vec<Effect>) {
        for event in events.drain(..) {
            match event {
                _ if self.ending => {}
                Event::Journal(event) => self.journal(now, event, effects),
                Event::Shutdown if self.journaling.is_opening() => {
                    self.ending = true;
                    effects.push(Effect::Exit);
                }
                other => self.journaling.early.push(other),
            }
        }
        if !self.journaling.is_opening() {
            events.append(&mut self.journaling.early);
        }
    }

    /// What the journal tells.
    pub(super) fn journal(&mut self, now: Now, event: JournalEvent, effects: &mut Vec<Effect>) {
        match event {
            JournalEvent::Recovered { space, key, value } => self.read_back(now, space, key, value),
            JournalEvent::RecoveredAll(recovered) => self.all_read_back(now, recovered, effects),
            JournalEvent::Written { up_to } => {
                self.keeping.written(up_to);
                self.links_written(up_to);
                self.begun(now, up_to, effects);
                self.hand_on_kept(now, effects);
                self.journal_works(now);
            }
            JournalEvent::Refused { from, to, reason } => self.refused(now, from, to, &reason, effects),
            JournalEvent::Resumed => self.journal_works(now),
            JournalEvent::Unusable(why) => {
                let why = Refused::Unusable(why);
                let was_opening = self.journaling.is_opening();
                self.journaling.stage = Stage::Unusable(why.clone());
                if was_opening {
                    self.start(now, effects);
                }
                self.journal_fails(now, &why, effects);
            }
        }
    }

    fn read_back(&mut self, now: Now, space: u8, key: Bytes, value: Bytes) {
        match (space, key[..].try_into()) {
            (OF_LINKS, _) => self.link_read_back(now, key, value),
            (SAMPLES, Ok(number)) => drop(self.journaling.records.insert(u64::from_be_bytes(number), value)),
            (OF_NODE, _) if key[..] == *BEGUN => {
                self.journaling.begun = value[..].try_into().ok().map(u64::from_be_bytes);
            }
            _ => {}
        }
    }

    fn all_read_back(&mut self, now: Now, recovered: Recovered, effects: &mut Vec<Effect>) {
        let begun = self.journaling.begun.unwrap_or_else(|| u64::try_from(now.wall.0).unwrap_or(0));
        self.config.boot = BootId(begun.saturating_add(recovered.start));
        if self.journaling.begun.is_some() {
            return self.open(now, &recovered, effects);
        }
        let batch = self.keeping.keep_of_node(BEGUN, begun.to_be_bytes().to_vec());
        self.journaling.stage = Stage::Beginning(batch, Box::new(recovered));
    }

    /// The batch that begins the journal is on disk, or refused: it is as good as it gets.
    fn begun(&mut self, now: Now, up_to: u64, effects: &mut Vec<Effect>) {
        match std::mem::take(&mut self.journaling.stage) {
            Stage::Beginning(batch, recovered) if batch <= up_to => self.open(now, &recovered, effects),
            other => self.journaling.stage = other,
        }
    }

    /// The journal is read back: the node starts, with what former lives retained.
    fn open(&mut self, now: Now, recovered: &Recovered, effects: &mut Vec<Effect>) {
        self.journaling.stage = Stage::Open;
        let records = std::mem::take(&mut self.journaling.records);
        self.keeping.begin_after(records.last_key_value().map_or(0, |(&number, _)| number));
        let mut unread = Vec::new();
        for (number, value) in records {
            match Record::decode(&value) {
                Ok(record) => self.retain_again(now, number, record),
                Err(why) => unread.push(format!("record {number} of the journal is not read: {why}")),
            }
        }
        let retained = self.sharing.writers.histories().map(|(_, history)| history.len() as u64);
        self.counters.recovered = retained.sum();
        self.start(now, effects);
        let status = format!("start {}, {} samples retained again", recovered.start, self.counters.recovered);
        let damaged = !recovered.damage.is_empty() || !unread.is_empty();
        let condition = if damaged || !recovered.is_kept { Condition::Degraded } else { Condition::Well };
        let status = match (damaged, recovered.is_kept) {
            (true, _) => format!("{status}; parts of it were damaged, the log names them"),
            (false, false) => format!("{status}; the disk cannot be written"),
            (false, true) => status,
        };
        self.journal_health(now, condition, status);
        let damage = recovered.damage.iter().map(|damage| format!("the journal is damaged: {damage}"));
        let all: Vec<String> = damage.chain(unread).collect();
        for text in all.iter().take(DAMAGE_NAMED_MAX) {
            self.note(now, Note { level: Level::Error, text: text.clone() }, effects);
        }
        if let Some(more @ 1..) = all.len().checked_sub(DAMAGE_NAMED_MAX) {
            let text = format!("the journal is damaged in {more} more places");
            self.note(now, Note { level: Level::Error, text }, effects);
        }
    }

    /// A sample of a former life is retained again, as the first of this one.
    fn retain_again(&mut self, now: Now, number: u64, record: Record) {
        let Record { message, source_time } = record;
        let place = self.label(&message.label);
        let entry = self.labels.entry(place);
        let qos = entry.qos.filter(|qos| qos.durability == Durability::Persistent);
        let source = message.label.source().entity;
        let is_ours = self.config.entities.contains(&source) || self.links.is_behind(source);
        let Some(qos) = qos.filter(|_| is_ours) else {
            // The configuration has changed: it is not to be kept any more.
            self.keeping.forgotten.push(number);
            return;
        };
        let publish = entry.publish;
        let (outgoing, _) = self.outgoing(place);
        let (sequence, skipped) = self.outbound.next(outgoing);
        let stamp = Stamp {
            node: self.entity(),
            boot: self.config.boot,
            sequence,
            source_time,
            lifespan_left_ms: None,
            priority: Priority::Data,
            skipped,
            via: Default::default(),
        };
        let envelope = Envelope { message, stamp };
        self.counters.shed_retained += self.sharing.writers.wrote(now.monotonic, qos, publish, &envelope);
        self.sharing.writers.recorded(&envelope, number);
    }

    /// What is retained of what a service said in a former life, in its order.
    pub(super) fn former(&self, place: usize) -> Vec<Envelope> {
        let own = self.services[place].spec.source;
        let of_own = self.sharing.writers.histories_of(own);
        of_own.flat_map(crate::dds::History::living).cloned().collect()
    }

    /// A message of a persistent topic, or one that comes behind such that wait.
    pub(super) fn keep(&mut self, now: Now, place: usize, work: Work, effects: &mut Vec<Effect>) {
        if !self.labels.entry(place).persistent {
            if !self.keeping.holds(work.origin) {
                return self.hand_on(now, place, work, None, effects);
            }
            if self.keeping.is_full() {
                self.counters.shed_inside += 1;
                let text = "too much waits for the disk: messages behind it are dropped".to_owned();
                return self.say(now, Level::Error, "shed behind journal", text, effects);
            }
            return self.keeping.hold(Held::new(now, work));
        }
        let Some(value) = Record::encode(&work.message, now.wall) else {
            return self.hand_on(now, place, work, None, effects);
        };
        let mut held = Held::new(now, work);
        // With its record the message is this node's own: the link is answered in the same batch. But a service here is to get it again
        // after a crash, so that the link is answered with what the service says of it.
        let is_for_services = !self.labels.entry(place).services.is_empty();
        let passed = held.work.passed.as_mut().filter(|_| !is_for_services);
        let delivery = passed.and_then(|passed| passed.delivery.take());
        let origin = held.work.origin;
        let kept = match &self.journaling.stage {
            Stage::Unusable(why) => Err(Box::new((held, why.clone()))),
            _ => self.keeping.keep(held, value),
        };
        match kept {
            Ok(()) => self.done_for_link(origin, delivery),
            Err(not_kept) => {
                let (held, why) = *not_kept;
                let is_of_journal = !matches!(why, Refused::Batch(_));
                self.not_kept(now, held, &why, effects);
                self.start_anew(now, origin, &why, effects);
                if is_of_journal {
                    self.journal_fails(now, &why, effects);
                }
            }
        }
    }

    /// Hands on what is on disk.
    fn hand_on_kept(&mut self, now: Now, effects: &mut Vec<Effect>) {
        while let Some(held) = self.keeping.next_kept() {
            let record = held.record();
            let kept = Kept { source_time: held.source_time, record };
            let Held { mut work, until, .. } = held;
            work.confirm =
                work.confirm.zip(until).map(|((number, _), until)| (number, until - now.monotonic));
            self.counters.kept += u64::from(record.is_some());
            let place = self.label(&work.message.label);
            self.hand_on(now, place, work, Some(kept), effects);
        }
        if self.ending {
            self.end_when_kept(now, effects);
        }
    }

    fn refused(&mut self, now: Now, from: u64, to: u64, why: &Refused, effects: &mut Vec<Effect>) {
        for held in self.keeping.refused(from, to) {
            let origin = held.work.origin;
            self.not_kept(now, held, why, effects);
            self.start_anew(now, origin, why, effects);
        }
        self.links_refused(from, to, why);
        self.begun(now, to, effects);
        self.hand_on_kept(now, effects);
        self.journal_fails(now, why, effects);
    }

    /// A sample that the journal does not keep goes nowhere, and its sender is told where it asked.
    fn not_kept(&mut self, now: Now, held: Held, why: &Refused, effects: &mut Vec<Effect>) {
        self.counters.not_kept += 1;
        let label = &held.work.message.label;
        let text = format!("a sample of {} from {} is refused: {why}", label.address, label.source());
        self.say(now, Level::Error, "not kept", text, effects);
        if let (Some((number, _)), Origin::Service(place)) = (held.work.confirm, held.work.origin) {
            let outcome = Err(Unconfirmed::NotKept(why.to_string()));
            self.run(now, place, Input::Confirmed(number, outcome), effects);
        }
    }

    /// A service whose word is not kept, and that goes by what it has said, begins a new life with what is kept. What it said
    /// behind goes nowhere either.
    fn start_anew(&mut self, now: Now, origin: Origin, why: &Refused, effects: &mut Vec<Effect>) {
        let Origin::Service(place) = origin else { return };
        if self.services[place].goes_by_what_is_kept() {
            self.keeping.drop_all_of(origin);
            self.work.retain(|work| work.origin != origin);
            let ran = self.services[place].refuse(now, format!("what it says is not kept: {why}"));
            self.after(now, place, ran, effects);
        }
    }

    /// Gives the journal what this turn brings to disk, as one batch.
    pub(super) fn append(&mut self, effects: &mut Vec<Effect>) {
        if !matches!(self.journaling.stage, Stage::Open | Stage::Beginning(..)) {
            return;
        }
        self.sharing.writers.take_forgotten(&mut self.keeping.forgotten);
        if self.keeping.has_batches() {
            let batches = self.keeping.take_batches(false);
            effects.extend(batches.into_iter().map(|(number, batch)| Effect::Append(number, batch)));
        }
    }

    fn journal_works(&mut self, now: Now) {
        if std::mem::take(&mut self.journaling.is_failing) {
            self.journal_health(now, Condition::Well, "the disk takes what is to be kept again".into());
        }
    }

    fn journal_fails(&mut self, now: Now, why: &Refused, effects: &mut Vec<Effect>) {
        if !std::mem::replace(&mut self.journaling.is_failing, true) {
            self.journal_health(now, Condition::Failed, why.to_string());
            self.say(now, Level::Error, "journal", format!("the journal keeps nothing: {why}"), effects);
        }
    }

    fn journal_health(&mut self, now: Now, condition: Condition, status: String) {
        self.component(
            now,
            &ComponentHealth { component: Component::Resource("journal"), condition, status },
        );
    }

    /// Ends the node once its last words are on disk, or the disk takes too long.
    pub(super) fn end_when_kept(&mut self, now: Now, effects: &mut Vec<Effect>) {
        let end_by = *self.journaling.end_by.get_or_insert(now.monotonic + END_WITHIN);
        if self.journaling.has_ended || self.keeping.is_waiting() && now.monotonic < end_by {
            return;
        }
        self.journaling.has_ended = true;
        self.sharing.writers.take_forgotten(&mut self.keeping.forgotten);
        let batches = self.keeping.take_batches(true);
        effects.extend(batches.into_iter().map(|(number, batch)| Effect::Append(number, batch)));
        self.end(now, effects);
    }
}
