//! The guard of a provider: lets the consumer in control of the provider's resource through, and nobody else (ICD 5.1.3).

use super::super::command::decisions::failure_at_preemption;
use super::super::command::{Admission, Failure, FailureKind, Verdict, is_about};
use super::settings::{believed_for, repeat_every};
use crate::service::{Input, Level, Outbox};
use aldis_envelope::umaa::{
    self, Key, ResourceAllocationConfigReport, ResourceAllocationReport, SourceKey, Topic,
};
use aldis_envelope::{Change, Envelope, Guid, Guids, Monotonic, Now, Prefix, Source, Wall};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// How many arbiters of one resource are told apart. Two are a conflict already.
const ARBITERS_MAX: usize = 8;

/// What a guard has to know.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GuardSettings {
    /// The resource that the provider belongs to.
    pub resource: Guid,
    /// The lease of the arbiter's readers: `reader_lease` of its settings.
    pub reader_lease: Duration,
}

impl GuardSettings {
    /// The guard of a resource whose arbiter has the default lease.
    pub fn new(resource: Guid) -> Self {
        Self { resource, reader_lease: Duration::from_secs(10) }
    }
}

/// How old what an arbiter said is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Age {
    /// It was said before this guard was there, or while it stood still: it is not known when.
    Unknown,
    /// It was news then.
    Since(Monotonic),
    /// Its writer has been out of contact since.
    Lost,
}

/// What an arbiter last said of the resource.
#[derive(Debug, Clone)]
struct Heard {
    writer: Source,
    age: Age,
    /// Who controls the resource, and when that ends on the own clock.
    holder: Option<(Guid, Option<Monotonic>)>,
}

/// Knows who controls a resource.
#[derive(Debug, Clone)]
pub struct Guard {
    source: Source,
    guids: Guids,
    settings: GuardSettings,
    heard: BTreeMap<Guid, Heard>,
    /// The providers of the resource, by the arbiter that says so.
    related: BTreeMap<Guid, BTreeSet<Guid>>,
    /// Whether what is heard now is news.
    is_news: bool,
    /// When it was last given anything. It looks at the clock often enough to know when it has stood still.
    last_seen: Monotonic,
    /// It has stood still, and what has waited for it meanwhile may come until then.
    distrusts_until: Option<Monotonic>,
    /// Until when an arbiter may yet be heard after the start.
    waits_until: Option<Monotonic>,
    is_in_conflict: bool,
}

impl Guard {
    /// The guard of the provider with these ids.
    pub fn new(source: Source, guids: Guids, settings: GuardSettings) -> Self {
        Self {
            source,
            guids,
            settings,
            heard: BTreeMap::new(),
            related: BTreeMap::new(),
            is_news: false,
            last_seen: Monotonic::START,
            distrusts_until: None,
            waits_until: None,
            is_in_conflict: false,
        }
    }

    /// What arbiters say that may be believed now.
    fn believed(&self, now: Now) -> impl Iterator<Item = &Heard> {
        let within = believed_for(self.settings.reader_lease);
        let is_fresh = move |age| matches!(age, Age::Since(at) if now.monotonic - at < within);
        self.heard.values().filter(move |heard| is_fresh(heard.age))
    }

    /// The holder, as far as one arbiter alone says so and its time is not over.
    fn holder(&self, now: Now) -> Option<Guid> {
        only_holder(now, self.believed(now))
    }

    /// Who has to be taken for the holder where it is a matter of ending commands. A guard that has just started has
    /// confirmed what it was told of the past: whoever that names is in control already, and what this provider executed in a
    /// former life for another must not go on until the next repetition.
    fn successor(&self, now: Now) -> Option<Guid> {
        match self.believed(now).next() {
            Some(_) => self.holder(now),
            None => only_holder(now, self.heard.values().filter(|heard| heard.age != Age::Lost)),
        }
    }

    /// Whether a consumer is a provider of the resource itself, as all say who know of the resource.
    fn is_related(&self, consumer: Guid) -> bool {
        !self.related.is_empty() && self.related.values().all(|related| related.contains(&consumer))
    }

    fn report(&mut self, now: Now, envelope: &Envelope, out: &mut Outbox) {
        let writer = envelope.message.label.source();
        if envelope.message.change != Change::Put {
            // Gone, or out of contact: either way it names nobody any more.
            let key = envelope.message.instance.as_deref().and_then(SourceKey::of_instance);
            if let Some(key) = key
                && self.heard.get(&key.source).is_some_and(|heard| heard.writer == writer)
            {
                self.heard.remove(&key.source);
            }
            return;
        }
        let report = umaa::decode::<ResourceAllocationReport>(&envelope.message.content);
        let Ok(report) = report else { return };
        if !self.is_honest(report.source, writer, out) {
            return;
        }
        let info = report.control_info.iter().find(|info| info.resource_id == self.settings.resource);
        let Some(info) = info else {
            self.heard.remove(&report.source);
            return;
        };
        let holder = info.control_session.map(|session| {
            let left = |end| Wall::from(end).0.saturating_sub(Wall::from(report.time_stamp).0);
            let ends = session
                .end_time
                .map(|end| now.monotonic + Duration::from_nanos(u64::try_from(left(end)).unwrap_or(0)));
            (session.controlling_consumer, ends)
        });
        let is_news = self.is_news && self.distrusts_until.is_none();
        let age = if is_news { Age::Since(now.monotonic) } else { Age::Unknown };
        if self.heard.len() >= ARBITERS_MAX && !self.heard.contains_key(&report.source) {
            let believed: BTreeSet<_> = self.believed(now).map(|heard| heard.writer).collect();
            self.heard.retain(|_, heard| believed.contains(&heard.writer));
        }
        if self.heard.len() < ARBITERS_MAX || self.heard.contains_key(&report.source) {
            self.heard.insert(report.source, Heard { writer, age, holder });
        }
    }

    fn config(&mut self, envelope: &Envelope, out: &mut Outbox) {
        let key = envelope.message.instance.as_deref().and_then(SourceKey::of_instance);
        match envelope.message.change {
            Change::Put => {}
            Change::Dispose => {
                key.map(|key| self.related.remove(&key.source));
                return;
            }
            // What the providers of a resource are does not change because its arbiter is out of contact.
            Change::Unregister => return,
        }
        let report = umaa::decode::<ResourceAllocationConfigReport>(&envelope.message.content);
        let Ok(report) = report else { return };
        if !self.is_honest(report.source, envelope.message.label.source(), out) {
            return;
        }
        let definition = report.resources.iter().find(|known| known.resource_id == self.settings.resource);
        match definition {
            Some(definition)
                if self.related.len() < ARBITERS_MAX || self.related.contains_key(&report.source) =>
            {
                let related = definition.related_sources.iter().copied().collect();
                self.related.insert(report.source, related);
            }
            Some(_) => {}
            None => {
                self.related.remove(&report.source);
            }
        }
    }

    /// Whether a report comes from whom it names.
    fn is_honest(&self, claimed: Guid, writer: Source, out: &mut Outbox) -> bool {
        let honest = self.guids.service(claimed).is_none_or(|claimed| claimed == writer);
        if !honest {
            out.note(Level::Warning, format!("{writer} reports in the name of {claimed}: passed over"));
        }
        honest
    }

    /// Whether it has stood still since the last time: then reports have waited, longer than they are believed maybe, and are no
    /// news when they come. What comes a repetition later is.
    fn look_at_the_clock(&mut self, now: Now) {
        let lease = self.settings.reader_lease;
        if self.is_news && now.monotonic - self.last_seen > repeat_every(lease) {
            self.distrusts_until = Some(now.monotonic + repeat_every(lease));
            self.waits_until = Some(now.monotonic + believed_for(lease));
        }
        self.distrusts_until = self.distrusts_until.filter(|until| now.monotonic < *until);
        self.last_seen = now.monotonic;
    }

    /// Nothing is heard of a writer any more: until it is heard again, it names nobody.
    fn lost(&mut self, is_lost: impl Fn(Source) -> bool) {
        for heard in self.heard.values_mut().filter(|heard| is_lost(heard.writer)) {
            heard.age = Age::Lost;
        }
    }

    /// Says once when arbiters begin to contradict each other.
    fn tell_conflict(&mut self, now: Now, out: &mut Outbox) {
        let arbiters = self.believed(now).count();
        let was_in_conflict = std::mem::replace(&mut self.is_in_conflict, arbiters > 1);
        if self.is_in_conflict && !was_in_conflict {
            let resource = self.settings.resource;
            let text = format!("{arbiters} arbiters report {resource}: the consumers of all are refused");
            out.note(Level::Error, text);
        }
    }
}

impl Admission for Guard {
    fn subscriptions(&self) -> Vec<Prefix> {
        let names = [ResourceAllocationReport::NAME, ResourceAllocationConfigReport::NAME];
        names.into_iter().filter_map(|name| Prefix::new(name).ok()).collect()
    }

    fn observe(&mut self, now: Now, input: &Input<'_>, out: &mut Outbox) {
        self.look_at_the_clock(now);
        match input {
            Input::Message(envelope) if is_about::<ResourceAllocationReport>(envelope) => {
                self.report(now, envelope, out);
                self.tell_conflict(now, out);
            }
            Input::Message(envelope) if is_about::<ResourceAllocationConfigReport>(envelope) => {
                self.config(envelope, out);
            }
            Input::HistoryComplete(_) => {
                self.is_news = true;
                self.waits_until = Some(now.monotonic + believed_for(self.settings.reader_lease));
            }
            Input::Token(writer, false) => self.lost(|of| of == *writer),
            // What is on the own entity is heard without a bus.
            Input::Bus(false) => {
                let own = self.source.entity;
                self.lost(|of| of.entity != own);
            }
            _ => {}
        }
        self.waits_until = self.waits_until.filter(|until| now.monotonic < *until);
    }

    fn admits(&self, now: Now, consumer: Guid) -> Verdict {
        if self.is_related(consumer) {
            return Verdict::Valid;
        }
        let resource = self.settings.resource;
        let text = match (self.believed(now).count(), self.holder(now)) {
            (0, _) if self.waits_until.is_some() => return Verdict::Later,
            (0, _) => format!("no arbiter of {resource} is heard"),
            (1, Some(holder)) if holder == consumer => return Verdict::Valid,
            (1, Some(holder)) => format!("{holder} controls {resource}, not {consumer}"),
            (1, None) => format!("nobody controls {resource}: allocate it first"),
            (arbiters, _) => {
                format!("{arbiters} arbiters report {resource}: it is not known who controls it")
            }
        };
        Verdict::Failed(Failure::new(FailureKind::Rejected, text))
    }

    fn ends(&self, now: Now, consumer: Guid) -> Option<Failure> {
        let holder = self.successor(now).filter(|holder| *holder != consumer)?;
        let text = || format!("{holder} controls {} now", self.settings.resource);
        (!self.is_related(consumer)).then(|| failure_at_preemption(text()))
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        let clock = self.last_seen + repeat_every(self.settings.reader_lease) / 2;
        Some(self.waits_until.map_or(clock, |until| until.min(clock)))
    }
}

/// The holder that the one arbiter names which there is, while its time is not over.
fn only_holder<'a>(now: Now, mut heard: impl Iterator<Item = &'a Heard>) -> Option<Guid> {
    let (only, other) = (heard.next()?, heard.next());
    let (holder, ends) = only.holder?;
    (other.is_none() && ends.is_none_or(|ends| now.monotonic < ends)).then_some(holder)
}

#[cfg(test)]
mod tests;
