//! Hands a monitor what a reader of the bus hears: history first, then news, and who has vanished.

use super::{Decoder, FOLLOWED_MAX, Monitor, Observation, Observed, Report};
use aldis_envelope::{Envelope, KeyHash, Monotonic, Source};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// How long after the history is complete what comes is still taken for history. Topics are repaired each on its own, so that
/// what one of them said before the watcher came may reach it after what another said later.
const SETTLING: Duration = Duration::from_secs(1);

/// A monitor on a bus.
#[derive(Debug)]
pub struct Watcher {
    monitor: Monitor,
    decoder: Decoder,
    /// What comes before this is history.
    judges_from: Option<Monotonic>,
    /// The instances that are there, by writer.
    written: BTreeMap<Source, BTreeSet<(String, KeyHash)>>,
    instances: usize,
}

impl Watcher {
    /// A watcher that joins late: until it is told that the history is complete, all is history.
    pub fn joining(monitor: Monitor, decoder: Decoder) -> Self {
        Self { monitor, decoder, judges_from: None, written: BTreeMap::new(), instances: 0 }
    }

    /// A watcher that was there before everybody: it judges from the first observation on.
    pub fn from_the_start(monitor: Monitor, decoder: Decoder) -> Self {
        Self { judges_from: Some(Monotonic::START), ..Self::joining(monitor, decoder) }
    }

    /// All that is retained has come, but for what is on its way.
    pub fn history_complete(&mut self, now: Monotonic) {
        self.judges_from = Some(now + SETTLING);
    }

    /// From when what comes is news, and judged; none while the history is not complete.
    pub fn judges_from(&self) -> Option<Monotonic> {
        self.judges_from
    }

    /// An envelope has come.
    pub fn message(&mut self, now: Monotonic, envelope: &Envelope) {
        let Some(observation) = self.decoder.observation(now, envelope) else { return };
        let retained = self.judges_from.is_none_or(|from| now < from);
        let observation = Observation { retained, ..observation };
        let of_writer = self.written.entry(observation.writer).or_default();
        let id = (observation.topic.clone(), observation.instance);
        match observation.observed {
            Observed::Put(_) if self.instances < FOLLOWED_MAX && of_writer.insert(id.clone()) => {
                self.instances += 1;
            }
            Observed::Dispose | Observed::Unregister if of_writer.remove(&id) => self.instances -= 1,
            _ => {}
        }
        self.monitor.observe(&observation);
    }

    /// A writer has vanished: nobody speaks for what it wrote.
    pub fn vanished(&mut self, now: Monotonic, writer: Source) {
        let written = self.written.remove(&writer).unwrap_or_default();
        self.instances -= written.len();
        for (topic, instance) in written {
            self.monitor.observe(&Observation {
                at: now,
                writer,
                topic,
                type_name: None,
                instance,
                key: None,
                retained: false,
                observed: Observed::NoWriters,
            });
        }
    }

    /// Those who have written what is there.
    pub fn writers(&self) -> impl Iterator<Item = Source> + '_ {
        self.written.keys().copied()
    }

    /// Ends the watch.
    pub fn finish(self, now: Monotonic) -> Report {
        self.monitor.finish(now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{Bounds, Clause};
    use aldis_envelope::umaa::{
        self, CommandState, CommandStatus, CommandStatusReason, LongDescription, ResourceAllocationCommand,
        SessionKey,
    };
    use aldis_envelope::{BootId, DateTime, EntityId, Guid, Message, Priority, ServiceId, Stamp, Wall};

    type Status = CommandStatus<ResourceAllocationCommand>;

    fn at(seconds: u64) -> Monotonic {
        Monotonic::since_start(Duration::from_secs(seconds))
    }

    fn arbiter() -> Source {
        Source::new(EntityId::new(400).unwrap(), ServiceId::ALLOCATION)
    }

    fn envelope(message: Message) -> Envelope {
        let stamp = Stamp {
            node: arbiter().entity,
            boot: BootId(1),
            sequence: 1,
            source_time: Wall(0),
            lifespan_left_ms: None,
            priority: Priority::Data,
            skipped: 0,
            via: Default::default(),
        };
        Envelope { message, stamp }
    }

    fn command() -> Envelope {
        let command = ResourceAllocationCommand {
            duration: None,
            resource_id: Guid([0x81; 16]),
            time_stamp: DateTime::default(),
            source: Guid([0x82; 16]),
            session_id: Guid([0x83; 16]),
            destination: Guid([0x84; 16]),
        };
        let consumer = Source::new(EntityId::new(1).unwrap(), ServiceId::ALLOCATION);
        envelope(umaa::put(umaa::label::<ResourceAllocationCommand>(consumer).unwrap(), &command))
    }

    fn status(state: CommandState, seconds: i64) -> Envelope {
        let key = SessionKey { source: Guid([0x84; 16]), session_id: Guid([0x83; 16]) };
        let (time, text) = (DateTime::new(seconds, 0).unwrap(), LongDescription::default());
        let status = Status::new(time, key, state, CommandStatusReason::Succeeded, text);
        envelope(umaa::put(umaa::label::<Status>(arbiter()).unwrap(), &status))
    }

    fn watcher() -> Watcher {
        Watcher::joining(Monitor::new(Bounds::default(), []), Decoder::new([]))
    }

    fn broken(watcher: Watcher, seconds: u64) -> Vec<Clause> {
        watcher.finish(at(seconds)).broken().map(|found| found.clause).collect()
    }

    #[test]
    fn history_is_judged_only_when_it_has_settled() {
        let mut history = watcher();
        history.message(at(1), &status(CommandState::Commanded, 1));
        history.history_complete(at(2));
        history.message(at(2), &status(CommandState::Completed, 2));
        assert_eq!(broken(history, 3), []);

        let mut news = watcher();
        news.history_complete(at(2));
        news.message(at(4), &command());
        news.message(at(4), &status(CommandState::Commanded, 1));
        assert_eq!(broken(news, 5), [Clause::FirstStatus]);

        let mut first = Watcher::from_the_start(Monitor::new(Bounds::default(), []), Decoder::new([]));
        first.message(at(0), &command());
        first.message(at(0), &status(CommandState::Commanded, 1));
        assert_eq!(broken(first, 1), [Clause::FirstStatus]);
    }

    #[test]
    fn who_has_vanished_owes_nothing() {
        for (vanishes, wanted) in [(false, vec![Clause::CancelAnswered]), (true, vec![])] {
            let mut watcher = watcher();
            watcher.history_complete(at(0));
            watcher.message(at(2), &command());
            watcher.message(at(2), &status(CommandState::Issued, 1));
            let disposed = Envelope {
                message: Message { change: aldis_envelope::Change::Dispose, ..command().message },
                ..command()
            };
            watcher.message(at(3), &disposed);
            assert_eq!(watcher.writers().count(), 2);
            if vanishes {
                watcher.vanished(at(4), arbiter());
            }
            assert_eq!(broken(watcher, 20), wanted);
        }
    }
}
