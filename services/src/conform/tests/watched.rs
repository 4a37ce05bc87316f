//! What our own providers of large collections and reports send holds every clause, whatever happens to them.

use crate::conform::*;
use crate::umaa::collection::{ElementChange, ListChange, ListProvider, SetChange, SetProvider, Update};
use crate::umaa::request::{ReportAction, ReportProvider};
use aldis_envelope::umaa::{Key, LargeCollection, LogLevel, LogReport, LongDescription, SourceKey, Topic};
use aldis_envelope::{DateTime, EntityId, Guid, Instance, ServiceId, Source};
use proptest::prelude::*;
use serde::Serialize;
use serde_json::{Value, json};
use std::time::Duration;

/// Large sets and lists of numbers.
#[derive(Debug, Clone, PartialEq)]
struct Numbers;

impl LargeCollection for Numbers {
    type Element = u8;
    const ELEMENT_NAME: &'static str = "UMAA::MM::RouteReport::RouteReportTypeNumbersSetElement";
}

/// A monitor and the time.
struct Watch {
    monitor: Monitor,
    now: Duration,
}

impl Watch {
    fn new() -> Self {
        Self { monitor: Monitor::new(Bounds::default(), []), now: Duration::ZERO }
    }

    fn observe(&mut self, topic: &str, instance: Instance, key: Value, observed: Observed) {
        self.now += Duration::from_millis(1);
        let writer = Source::new(EntityId::new(1).unwrap(), ServiceId::NODE);
        let (at, topic) = (Monotonic::since_start(self.now), topic.to_owned());
        let (instance, key) = (instance.hash, Some(key));
        let type_name = None;
        self.monitor.observe(&Observation {
            at,
            writer,
            topic,
            type_name,
            instance,
            key,
            retained: false,
            observed,
        });
    }

    fn update<S: Topic, M: Serialize>(&mut self, id: fn(Guid) -> S::Key, update: &Update<S, M>) {
        for change in &update.elements {
            match change {
                ElementChange::Put(sample) => {
                    let value = serde_json::to_value(sample).unwrap();
                    let observed = Observed::Put(Content::Sample(value));
                    self.observe(
                        S::NAME,
                        sample.instance(),
                        serde_json::to_value(sample.key()).unwrap(),
                        observed,
                    );
                }
                ElementChange::Dispose(element) => {
                    let key = id(*element);
                    self.observe(
                        S::NAME,
                        key.instance(),
                        serde_json::to_value(key).unwrap(),
                        Observed::Dispose,
                    );
                }
            }
        }
        let report = json!({ "numbers": update.metadata, "timeStamp": update.time_stamp, "source": guid(1) });
        let key = SourceKey { source: guid(1) };
        let observed = Observed::Put(Content::Sample(report));
        self.observe(
            "UMAA::MM::RouteReport::RouteReport",
            key.instance(),
            json!({ "source": guid(1) }),
            observed,
        );
    }

    fn finish(self) -> Result<(), TestCaseError> {
        let later = Monotonic::since_start(self.now + Duration::from_secs(60));
        let report = self.monitor.finish(later);
        prop_assert_eq!(report.count(Verdict::Broken), 0, "{}", report);
        Ok(())
    }
}

fn guid(number: u8) -> Guid {
    let mut bytes = [number; 16];
    bytes[8] = 0x80;
    Guid(bytes)
}

fn element(number: u8) -> Guid {
    guid(1 + number % 5)
}

fn key_of(element_id: Guid) -> aldis_envelope::umaa::ElementKey {
    aldis_envelope::umaa::ElementKey { element_id }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn our_large_sets_hold_every_clause(batches in prop::collection::vec(prop::collection::vec(any::<(bool, u8)>(), 1..4), 1..20)) {
        let mut set = SetProvider::<Numbers>::new(guid(100));
        let mut watch = Watch::new();
        for batch in batches {
            let change = |(put, number): (bool, u8)| {
                let id = element(number);
                if put { SetChange::Put(id, number) } else { SetChange::Remove(id) }
            };
            if let Ok(Some(update)) = set.update(DateTime::default(), batch.into_iter().map(change)) {
                watch.update(key_of, &update);
            }
        }
        watch.finish()?;
    }

    #[test]
    fn our_large_lists_hold_every_clause(changes in prop::collection::vec(any::<(u8, u8, u8)>(), 1..40)) {
        let mut list = ListProvider::<Numbers>::new(guid(100));
        let mut watch = Watch::new();
        for (kind, number, at) in changes {
            let (id, at) = (element(number), usize::from(at) % 5);
            let change = match kind % 4 {
                0 => ListChange::Remove(id),
                1 => ListChange::Move(id, at),
                2 => ListChange::Replace(id, number),
                _ => ListChange::Insert(at, id, number),
            };
            if let Ok(Some(update)) = list.update(DateTime::default(), [change]) {
                watch.update(key_of, &update);
            }
        }
        watch.finish()?;
    }

    #[test]
    fn our_reports_hold_every_clause(acts in prop::collection::vec(0u8..6, 1..30)) {
        let source = guid(1);
        let mut provider = ReportProvider::<LogReport>::new(source, Some(Duration::from_secs(1)));
        let mut watch = Watch::new();
        for (seconds, act) in acts.into_iter().chain([5]).enumerate() {
            let now = Monotonic::since_start(Duration::from_secs(seconds as u64));
            match act {
                0 => provider.start(),
                1 => provider.recovered(now),
                2 => provider.withdraw(SourceKey { source }),
                3 => provider.deadline(now),
                4 => {
                    let (entry, level) = (LongDescription::default(), LogLevel::Warning);
                    let time_stamp = DateTime::new(seconds as i64, 0).unwrap();
                    provider.report(LogReport { entry, level, time_stamp, source }).unwrap();
                }
                _ => provider.shutdown(),
            }
            for action in provider.actions().collect::<Vec<_>>() {
                let observed = match action {
                    ReportAction::Register => continue,
                    ReportAction::Put(report) => Observed::Put(Content::Sample(serde_json::to_value(report).unwrap())),
                    ReportAction::Dispose(_) => Observed::Dispose,
                    ReportAction::Unregister => Observed::Unregister,
                };
                let key = SourceKey { source };
                watch.observe(LogReport::NAME, key.instance(), serde_json::to_value(key).unwrap(), observed);
            }
        }
        watch.finish()?;
    }
}
