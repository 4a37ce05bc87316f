//! The consumer's side: subscribes, holds the latest of each report, unsubscribes (figures 21, 23, 25).

use aldis_envelope::umaa::Sourced;
use aldis_envelope::{Guid, Monotonic};
use std::collections::BTreeMap;
use std::time::Duration;

/// What a consumer of reports is told.
#[derive(Debug, Clone, PartialEq)]
pub enum ReportTold<T: Sourced> {
    /// A report is new or has changed.
    Report(T),
    /// Its provider has disposed the report.
    Gone(T::Key),
    /// Nobody speaks for the report any longer: contact is lost, and what is held may be out of date.
    LostContact(T::Key),
    /// The limit on reports is reached: this one is not held.
    Shed(T::Key),
}

/// A report as it is held.
#[derive(Debug)]
struct Held<T> {
    report: T,
    received: Monotonic,
    in_contact: bool,
}

/// Holds the latest reports of a topic, of all providers or of one.
#[derive(Debug)]
pub struct ReportConsumer<T: Sourced> {
    provider: Option<Guid>,
    limit: usize,
    subscribed: bool,
    held: BTreeMap<T::Key, Held<T>>,
    told: Vec<ReportTold<T>>,
}

impl<T: Sourced> ReportConsumer<T> {
    /// A consumer of the reports of one provider, or of all; at most `limit` are held.
    pub fn new(provider: Option<Guid>, limit: usize) -> Self {
        Self { provider, limit, subscribed: false, held: BTreeMap::new(), told: Vec::new() }
    }

    /// Whether it is to be subscribed: the request is outstanding as long as it is (4.2.1.2).
    pub fn is_subscribed(&self) -> bool {
        self.subscribed
    }

    /// Asks for the reports: subscribe to the topic.
    pub fn start(&mut self) {
        self.subscribed = true;
    }

    /// Asks no longer (4.2.1.4): unsubscribe from the topic. What is held is let go, because nobody keeps it true.
    pub fn stop(&mut self) {
        self.subscribed = false;
        self.held.clear();
    }

    /// A sample. One that is older than what is held comes late, and is left out.
    pub fn sample(&mut self, now: Monotonic, report: T) {
        let wanted = self.provider.is_none_or(|provider| report.source() == provider);
        if !self.subscribed || !wanted {
            return;
        }
        let (key, full) = (report.key(), self.held.len() >= self.limit);
        match self.held.get_mut(&key) {
            Some(held) if report.time_stamp() < held.report.time_stamp() => return,
            Some(held) if held.in_contact && held.report == report => {
                held.received = now;
                return;
            }
            None if full => {
                self.told.push(ReportTold::Shed(key));
                return;
            }
            _ => {}
        }
        self.told.push(ReportTold::Report(report.clone()));
        self.held.insert(key, Held { report, received: now, in_contact: true });
    }

    /// The report with this key is disposed.
    pub fn disposed(&mut self, key: T::Key) {
        if self.held.remove(&key).is_some() {
            self.told.push(ReportTold::Gone(key));
        }
    }

    /// Nobody writes the report with this key any longer. It is held on, and known to be out of contact.
    pub fn no_writers(&mut self, key: T::Key) {
        if let Some(held) = self.held.get_mut(&key).filter(|held| held.in_contact) {
            held.in_contact = false;
            self.told.push(ReportTold::LostContact(key));
        }
    }

    /// The report with this key, and how long ago it came; none where there is none.
    pub fn latest(&self, now: Monotonic, key: T::Key) -> Option<(&T, Duration)> {
        self.held.get(&key).map(|held| (&held.report, now - held.received))
    }

    /// The reports that somebody speaks for.
    pub fn in_contact(&self) -> impl Iterator<Item = &T> {
        self.held.values().filter(|held| held.in_contact).map(|held| &held.report)
    }

    /// Takes what there is to say.
    pub fn told(&mut self) -> impl Iterator<Item = ReportTold<T>> + '_ {
        self.told.drain(..)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aldis_envelope::DateTime;
    use aldis_envelope::umaa::{LogLevel, LogReport, LongDescription, SourceKey};

    fn log(source: u8, seconds: i64) -> LogReport {
        let (entry, level) = (LongDescription::default(), LogLevel::Information);
        let time_stamp = DateTime::new(seconds, 0).unwrap();
        LogReport { entry, level, time_stamp, source: Guid([source; 16]) }
    }

    fn at(seconds: u64) -> Monotonic {
        Monotonic::since_start(Duration::from_secs(seconds))
    }

    fn key(source: u8) -> SourceKey {
        SourceKey { source: Guid([source; 16]) }
    }

    #[test]
    fn the_latest_report_counts() {
        let mut consumer = ReportConsumer::new(None, 10);
        consumer.sample(at(0), log(1, 1));
        assert_eq!(consumer.told().count(), 0, "it has not asked");
        consumer.start();
        for seconds in [5, 5, 4, 6] {
            consumer.sample(at(seconds), log(1, seconds as i64));
        }
        let told: Vec<_> = consumer.told().collect();
        assert_eq!(told, [ReportTold::Report(log(1, 5)), ReportTold::Report(log(1, 6))]);
        assert_eq!(consumer.latest(at(9), key(1)), Some((&log(1, 6), Duration::from_secs(3))));
        consumer.stop();
        assert_eq!(consumer.latest(at(9), key(1)), None);
    }

    #[test]
    fn lost_contact_is_not_a_disposal() {
        let mut consumer = ReportConsumer::new(None, 10);
        consumer.start();
        consumer.sample(at(0), log(1, 1));
        consumer.no_writers(key(1));
        consumer.no_writers(key(1));
        assert_eq!(consumer.in_contact().count(), 0);
        assert!(consumer.latest(at(1), key(1)).is_some());
        consumer.sample(at(2), log(1, 1));
        consumer.disposed(key(1));
        consumer.disposed(key(1));
        let told: Vec<_> = consumer.told().skip(1).collect();
        let wanted =
            [ReportTold::LostContact(key(1)), ReportTold::Report(log(1, 1)), ReportTold::Gone(key(1))];
        assert_eq!(told, wanted, "back in contact is news, even with the same report");
    }

    #[test]
    fn a_consumer_of_one_provider_hears_no_other() {
        let mut consumer = ReportConsumer::new(Some(Guid([1; 16])), 1);
        consumer.start();
        consumer.sample(at(0), log(2, 1));
        consumer.sample(at(0), log(1, 1));
        assert_eq!(consumer.told().collect::<Vec<_>>(), [ReportTold::Report(log(1, 1))]);
        let mut all = ReportConsumer::new(None, 1);
        all.start();
        all.sample(at(0), log(1, 1));
        all.sample(at(0), log(2, 1));
        assert_eq!(all.told().last(), Some(ReportTold::Shed(key(2))));
    }
}
