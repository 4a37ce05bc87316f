//! A run in which every clause is held, and runs in which one of them is broken.

mod clean;
mod crossing;
mod planted;
mod scene;
mod watched;

use super::*;
use aldis_envelope::umaa::{self, ErrorCode, ErrorCondition, HealthReport, LongDescription};
use aldis_envelope::{BootId, DateTime, EntityId, Envelope, Guid, Priority, ServiceId, Source, Stamp, Wall};

/// What the gateway and the simulator hand in.
#[test]
fn envelopes_are_read_as_observations() {
    let writer = Source::new(EntityId::new(400).unwrap(), ServiceId::HEALTH);
    let guid: Guid = "04000000-0000-4000-8000-000000000000".parse().unwrap();
    let report = HealthReport {
        code: ErrorCode::Software,
        log_time: DateTime::default(),
        severity: ErrorCondition::Warn,
        status: LongDescription::new("late").unwrap(),
        time_stamp: DateTime::default(),
        source: guid,
        resource_id: guid,
    };
    let label = umaa::label::<HealthReport>(writer).unwrap();
    let stamp = Stamp {
        node: writer.entity,
        boot: BootId(1),
        sequence: 1,
        source_time: Wall(0),
        lifespan_left_ms: None,
        priority: Priority::Data,
        skipped: 0,
        via: Default::default(),
    };
    let envelope = |message| Envelope { message, stamp: stamp.clone() };
    let decoder = Decoder::new([]);

    let put = decoder.observation(Monotonic::START, &envelope(umaa::put(label.clone(), &report))).unwrap();
    let Observed::Put(Content::Sample(value)) = &put.observed else { panic!("{put:?}") };
    assert_eq!((&value["severity"], &value["status"]), (&"WARN".into(), &"late".into()));

    let gone =
        decoder.observation(Monotonic::START, &envelope(umaa::dispose(label.clone(), &report))).unwrap();
    assert_eq!((gone.observed.clone(), gone.instance), (Observed::Dispose, put.instance));
    assert_eq!(gone.key.as_ref().unwrap()["resourceID"], guid.to_string());

    let mut broken = umaa::put(label, &report);
    broken.content = broken.content.slice(1..);
    let broken = decoder.observation(Monotonic::START, &envelope(broken)).unwrap();
    assert!(matches!(&broken.observed, Observed::Put(Content::Unreadable(_))), "{broken:?}");

    let mut monitor = Monitor::new(Bounds::default(), []);
    [put, gone, broken].iter().for_each(|observation| monitor.observe(observation));
    let found: Vec<_> = monitor.finish(Monotonic::START).broken().map(|found| found.clause).collect();
    assert_eq!(found, [Clause::Range]);
}
