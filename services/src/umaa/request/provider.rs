//! The provider's side: publishes reports, takes over those of its former life, clears up when it ends (figures 21, 22, 24).

use aldis_envelope::umaa::Sourced;
use aldis_envelope::{Guid, Monotonic};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// What a provider of reports wants done, in this order.
#[derive(Debug, Clone, PartialEq)]
pub enum ReportAction<T: Sourced> {
    /// Register as a publisher, and read what is on the bus of this source.
    Register,
    /// Publish a report.
    Put(T),
    /// Dispose the report with this key.
    Dispose(T::Key),
    /// Unregister as a publisher.
    Unregister,
}

/// A report names another source than its provider.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a report of {found}, published by {own}: a provider reports in its own name")]
pub struct NotOwn {
    /// The report's source.
    pub found: Guid,
    /// The provider.
    pub own: Guid,
}

/// How far a provider is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    New,
    /// It waits for what is on the bus from its former life.
    Recovering,
    Running,
    Ended,
}

/// Publishes the reports of one source under one topic: one for each key.
#[derive(Debug)]
pub struct ReportProvider<T: Sourced> {
    source: Guid,
    period: Option<Duration>,
    phase: Phase,
    reports: BTreeMap<T::Key, T>,
    former: BTreeSet<T::Key>,
    next: Option<Monotonic>,
    actions: Vec<ReportAction<T>>,
}

impl<T: Sourced> ReportProvider<T> {
    /// A provider that repeats its reports each `period`, or sends them once each.
    pub fn new(source: Guid, period: Option<Duration>) -> Self {
        let (reports, former) = (BTreeMap::new(), BTreeSet::new());
        Self { source, period, phase: Phase::New, reports, former, next: None, actions: Vec::new() }
    }

    /// Starts (4.2.1.1). Nothing is published before [`Self::recovered`].
    pub fn start(&mut self) {
        if self.phase == Phase::New {
            self.phase = Phase::Recovering;
            self.actions.push(ReportAction::Register);
        }
    }

    /// A report of this topic is on the bus that this life of the provider has not published. Those of others are left alone;
    /// an own one that turns up later than the others is held against the reports of now.
    pub fn found(&mut self, source: Guid, key: T::Key) {
        if source != self.source {
            return;
        }
        match self.phase {
            Phase::New | Phase::Recovering => {
                self.former.insert(key);
            }
            Phase::Running => self.take_over(key),
            Phase::Ended => self.actions.push(ReportAction::Dispose(key)),
        }
    }

    /// All that is on the bus has been found: each former report is updated at once, or disposed where nothing is known of it
    /// any longer (4.2.1.1). Then everything else is published.
    pub fn recovered(&mut self, now: Monotonic) {
        if self.phase != Phase::Recovering {
            return;
        }
        self.phase = Phase::Running;
        let former = std::mem::take(&mut self.former);
        former.iter().for_each(|key| self.take_over(*key));
        let new = self.reports.iter().filter(|(key, _)| !former.contains(key));
        self.actions.extend(new.map(|(_, report)| ReportAction::Put(report.clone())));
        self.next = self.period.map(|period| now + period);
    }

    fn take_over(&mut self, key: T::Key) {
        self.actions.push(match self.reports.get(&key) {
            Some(report) => ReportAction::Put(report.clone()),
            None => ReportAction::Dispose(key),
        });
    }

    /// A new or changed report.
    ///
    /// # Errors
    /// [`NotOwn`] when its source is not the provider.
    pub fn report(&mut self, report: T) -> Result<(), NotOwn> {
        if report.source() != self.source {
            return Err(NotOwn { found: report.source(), own: self.source });
        }
        if self.phase == Phase::Running {
            self.actions.push(ReportAction::Put(report.clone()));
        }
        if self.phase != Phase::Ended {
            self.reports.insert(report.key(), report);
        }
        Ok(())
    }

    /// What a report was about is no more.
    pub fn withdraw(&mut self, key: T::Key) {
        if self.reports.remove(&key).is_some() && self.phase == Phase::Running {
            self.actions.push(ReportAction::Dispose(key));
        }
    }

    /// When [`Self::deadline`] is to be called.
    pub fn next_deadline(&self) -> Option<Monotonic> {
        self.next
    }

    /// The period is over: every report is sent again as it is, its timestamp too, because that says when it was true.
    pub fn deadline(&mut self, now: Monotonic) {
        let Some(period) = self.period.filter(|_| self.next.is_some_and(|next| next <= now)) else { return };
        self.actions.extend(self.reports.values().cloned().map(ReportAction::Put));
        self.next = Some(now + period);
    }

    /// Ends (4.2.1.3): disposes every report, those of its former life too, and unregisters.
    pub fn shutdown(&mut self) {
        if self.phase == Phase::New || self.phase == Phase::Ended {
            return;
        }
        let published = self.reports.keys().filter(|_| self.phase == Phase::Running);
        let keys = published.copied().chain(std::mem::take(&mut self.former));
        self.actions.extend(keys.map(ReportAction::Dispose));
        self.actions.push(ReportAction::Unregister);
        self.reports.clear();
        (self.phase, self.next) = (Phase::Ended, None);
    }

    /// Takes what is to be done.
    pub fn actions(&mut self) -> impl Iterator<Item = ReportAction<T>> + '_ {
        self.actions.drain(..)
    }

    /// The reports of now.
    pub fn reports(&self) -> impl ExactSizeIterator<Item = &T> {
        self.reports.values()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aldis_envelope::DateTime;
    use aldis_envelope::umaa::{ErrorCode, ErrorCondition, HealthKey, HealthReport, LongDescription};

    const OWN: Guid = Guid([1; 16]);

    fn key(resource: u8) -> HealthKey {
        HealthKey { source: OWN, resource_id: Guid([resource; 16]) }
    }

    fn health(resource: u8) -> HealthReport {
        let (log_time, time_stamp, status) =
            (DateTime::default(), DateTime::default(), LongDescription::default());
        let HealthKey { source, resource_id } = key(resource);
        let (code, severity) = (ErrorCode::None, ErrorCondition::None);
        HealthReport { code, log_time, severity, status, time_stamp, source, resource_id }
    }

    fn at(seconds: u64) -> Monotonic {
        Monotonic::since_start(Duration::from_secs(seconds))
    }

    fn started(period: Option<Duration>) -> ReportProvider<HealthReport> {
        let mut provider = ReportProvider::new(OWN, period);
        provider.start();
        assert_eq!(provider.actions().collect::<Vec<_>>(), [ReportAction::Register]);
        provider
    }

    fn actions(provider: &mut ReportProvider<HealthReport>) -> Vec<ReportAction<HealthReport>> {
        provider.actions().collect()
    }

    #[test]
    fn former_reports_are_updated_or_disposed_before_anything_else() {
        let mut provider = started(None);
        provider.report(health(3)).unwrap();
        provider.report(health(2)).unwrap();
        provider.found(OWN, key(3));
        provider.found(OWN, key(9));
        provider.found(Guid([8; 16]), HealthKey { source: Guid([8; 16]), resource_id: OWN });
        assert_eq!(actions(&mut provider), [], "nothing before the history has been read");
        provider.recovered(at(0));
        let wanted =
            [ReportAction::Put(health(3)), ReportAction::Dispose(key(9)), ReportAction::Put(health(2))];
        assert_eq!(actions(&mut provider), wanted);
        provider.found(OWN, key(7));
        assert_eq!(actions(&mut provider), [ReportAction::Dispose(key(7))], "a straggler");
    }

    #[test]
    fn reports_are_repeated_each_period() {
        let mut provider = started(Some(Duration::from_secs(2)));
        provider.recovered(at(10));
        provider.report(health(2)).unwrap();
        assert_eq!(actions(&mut provider), [ReportAction::Put(health(2))]);
        provider.deadline(at(11));
        assert_eq!((actions(&mut provider), provider.next_deadline()), (vec![], Some(at(12))));
        provider.deadline(at(12));
        assert_eq!(actions(&mut provider), [ReportAction::Put(health(2))]);
        provider.withdraw(key(2));
        provider.withdraw(key(2));
        provider.deadline(at(14));
        assert_eq!(actions(&mut provider), [ReportAction::Dispose(key(2))]);
    }

    #[test]
    fn the_end_disposes_everything_then_unregisters() {
        let mut provider = started(None);
        provider.recovered(at(0));
        provider.report(health(2)).unwrap();
        provider.report(health(3)).unwrap();
        actions(&mut provider);
        provider.shutdown();
        let wanted = [ReportAction::Dispose(key(2)), ReportAction::Dispose(key(3)), ReportAction::Unregister];
        assert_eq!(actions(&mut provider), wanted);
        provider.report(health(2)).unwrap();
        provider.shutdown();
        assert_eq!(actions(&mut provider), []);

        let mut early = started(None);
        early.report(health(2)).unwrap();
        early.found(OWN, key(3));
        early.shutdown();
        let wanted = [ReportAction::Dispose(key(3)), ReportAction::Unregister];
        assert_eq!(actions(&mut early), wanted, "what was never published is not disposed");
    }

    #[test]
    fn nobody_reports_in_the_name_of_another() {
        let mut provider = started(None);
        let other = HealthReport { source: Guid([8; 16]), ..health(2) };
        assert_eq!(provider.report(other), Err(NotOwn { found: Guid([8; 16]), own: OWN }));
    }
}
