//! Service 3: a bounded log of the fleet. The node's own warnings go out as LogReports.

use crate::service::{Input, Level, Note, Outbox, Service};
use aldis_envelope::aldis::LogQuery;
use aldis_envelope::umaa::{self, LogLevel, LogReport, LongDescription, Topic};
use aldis_envelope::{
    Change, ContentType, EntityId, Envelope, Guids, Label, Name, Now, Prefix, Refusal, ServiceId, Source,
    aldis,
};
use std::collections::VecDeque;
use std::sync::Arc;

/// How many entries are kept; the oldest go first. At 200 bytes each this is 2 MB.
const ENTRIES_MAX: usize = 10_000;

/// The log service of a node.
pub struct Log {
    guid: aldis_envelope::Guid,
    label: Option<Arc<Label>>,
    entries: VecDeque<LogReport>,
}

impl Log {
    /// The log service of an entity.
    pub fn new(entity: EntityId, guids: &Guids) -> Self {
        let source = Source::new(entity, ServiceId::LOG);
        let label = umaa::label::<LogReport>(source).ok();
        Self { guid: guids.of_service(source), label, entries: VecDeque::new() }
    }

    fn keep(&mut self, entry: LogReport) {
        if self.entries.len() >= ENTRIES_MAX {
            self.entries.pop_front();
        }
        self.entries.push_back(entry);
    }

    /// The node has something to say: kept, and from a warning on told to the fleet.
    fn note(&mut self, now: Now, note: &Note, out: &mut Outbox) {
        let level = match note.level {
            Level::Information => LogLevel::Information,
            Level::Warning => LogLevel::Warning,
            Level::Error => LogLevel::Error,
        };
        let entry = LongDescription::shortened(&note.text);
        let report = LogReport { entry, level, time_stamp: now.wall.into(), source: self.guid };
        if let (Some(label), Level::Warning | Level::Error) = (&self.label, note.level) {
            out.send(umaa::put(label.clone(), &report));
        }
        self.keep(report);
    }

    fn answer(&self, request: &Envelope, out: &mut Outbox) {
        let Ok(name) = Name::new(LogReport::NAME) else { return };
        let query = match request.message.content.is_empty() {
            true => Some(LogQuery::all()),
            false => aldis::decode::<LogQuery>(&request.message.content),
        };
        let Some(query) = query else {
            out.refuse(request, Refusal::NotUnderstood(format!("the content of {}", aldis::LOG_QUERY)));
            return;
        };
        let wanted: Vec<_> = self.entries.iter().filter(|entry| query.wants(entry)).collect();
        let first = wanted.len().saturating_sub(query.last as usize);
        for entry in &wanted[first..] {
            out.reply(request, ContentType::Umaa, name.clone(), umaa::encode(*entry), false);
        }
        out.reply(request, ContentType::Umaa, name, Default::default(), true);
    }
}

impl Service for Log {
    fn subscriptions(&self) -> Vec<Prefix> {
        Prefix::new(LogReport::NAME).into_iter().collect()
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            Input::Note(note) => self.note(now, note, out),
            Input::Message(envelope) if envelope.message.label.descriptor() == aldis::LOG_QUERY => {
                self.answer(envelope, out);
            }
            Input::Message(envelope) if envelope.message.call.is_some() => {
                let what = envelope.message.label.descriptor().to_owned();
                out.refuse(envelope, Refusal::NotUnderstood(what));
            }
            Input::Message(envelope) if envelope.message.change == Change::Put => {
                // An unreadable entry is dropped silently: a note about it would be the next entry.
                if let Ok(entry) = umaa::decode(&envelope.message.content) {
                    self.keep(entry);
                }
            }
            _ => {}
        }
    }
}
