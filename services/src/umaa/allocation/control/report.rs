//! The report of who controls what: told at each change, repeated, confirmed where a consumer waits for it.

use super::super::super::command::is_about;
use super::{Confirmation, Control, Stage};
use crate::service::{Level, Outbox};
use aldis_envelope::umaa::{
    self, Key, ResourceAllocationControlInfo, ResourceAllocationControlSession, ResourceAllocationReport,
    Sequence, SourceKey,
};
use aldis_envelope::{Change, Envelope, Now};

/// How many other arbiters are told apart in the log.
const RIVALS_MAX: usize = 16;

impl Control {
    /// The report of a former life: what it says counts where its commands are still there. One under another GUID is
    /// disposed, because nobody else will ever do it (ICD 4.2.1.1).
    pub(super) fn recovered(&mut self, envelope: &Envelope, out: &mut Outbox) {
        if !is_about::<ResourceAllocationReport>(envelope) || envelope.message.change != Change::Put {
            return;
        }
        let report = umaa::decode::<ResourceAllocationReport>(&envelope.message.content);
        match report {
            Ok(report) if report.source == self.guid => {
                let sessions = report.control_info.iter();
                self.former =
                    sessions.filter_map(|info| Some((info.resource_id, info.control_session?))).collect();
            }
            _ => {
                let key = envelope.message.instance.as_deref().and_then(SourceKey::of_instance);
                if let Some(key) = key.filter(|key| key.source != self.guid) {
                    self.reports.dispose(key, out);
                }
            }
        }
    }

    /// Another arbiter's report: where it lists a resource of this one, guards refuse both, and people have to know.
    pub(super) fn rival(&mut self, envelope: &Envelope, out: &mut Outbox) {
        if !is_about::<ResourceAllocationReport>(envelope) {
            return;
        }
        let key = envelope.message.instance.as_deref().and_then(SourceKey::of_instance);
        if envelope.message.change != Change::Put {
            key.map(|key| self.rivals.remove(&key.source));
            return;
        }
        let report = umaa::decode::<ResourceAllocationReport>(&envelope.message.content);
        let Ok(report) = report else { return };
        let shared = report.control_info.iter().find_map(|info| self.resources.get(&info.resource_id));
        if let Some(shared) = shared
            && report.source != self.guid
            && self.rivals.len() < RIVALS_MAX
            && self.rivals.insert(report.source)
        {
            let (rival, name, writer) = (report.source, &shared.name, envelope.message.label.source());
            let text = format!(
                "{rival} ({writer}) allocates {name} too: providers refuse the consumers of both until one of them ends"
            );
            out.note(Level::Error, text);
        }
    }

    /// Sends the report where it has to be sent.
    pub(super) fn tell(&mut self, now: Now, out: &mut Outbox) {
        let key = SourceKey { source: self.guid };
        match self.stage {
            Stage::Listening | Stage::Closed => {}
            Stage::Closing => {
                self.reports.dispose(key, out);
                self.reports.unregister(key, out);
                (self.stage, self.next_repeat) = (Stage::Closed, None);
            }
            Stage::Reporting => {
                if self.changed || self.next_repeat.is_none_or(|at| at <= now.monotonic) {
                    self.send(now, out);
                }
            }
        }
    }

    fn send(&mut self, now: Now, out: &mut Outbox) {
        let number = self.next_number;
        let mut waits = false;
        let holds = self.resources.values_mut().filter_map(|managed| managed.hold.as_mut());
        for hold in holds.filter(|hold| hold.confirmation == Confirmation::Unsent) {
            hold.confirmation = Confirmation::Sent(number);
            waits = true;
        }
        let report = self.report(now);
        if waits {
            self.next_number += 1;
            self.reports.put_confirmed(&report, number, self.acknowledge_within, out);
        } else {
            self.reports.put(&report, out);
        }
        (self.changed, self.next_repeat) = (false, Some(now.monotonic + self.repeat_every));
    }

    fn report(&self, now: Now) -> ResourceAllocationReport {
        let infos = self.resources.iter().map(|(&resource_id, managed)| {
            let session = |hold: &super::Hold| ResourceAllocationControlSession {
                controlling_consumer: hold.session.source,
                end_time: hold.ends.map(|(_, end)| end),
            };
            let control_session = managed.hold.as_ref().map(session);
            ResourceAllocationControlInfo { control_session, resource_id }
        });
        // The settings hold no more resources than fit.
        let control_info = Sequence::new(infos.collect()).unwrap_or_default();
        ResourceAllocationReport { control_info, time_stamp: now.wall.into(), source: self.guid }
    }
}
