//! A bus of 6.0 beside a fleet of 5.2.1.

use super::*;
use crate::service::Level;
use aldis_envelope::codec::cdr::{Representation, Schema, Value};
use aldis_envelope::umaa::{self, ErrorCode, ErrorCondition, HealthReport, LongDescription, v6_0};
use aldis_envelope::{DateTime, Guid};

const HEALTH: &str = "UMAA::SO::HealthReport::HealthReportType";
const CONFIG: &str = "UMAA::SO::ResourceAllocation::ResourceAllocationConfigReportType";

fn newer() -> Stage {
    let exact = v6_0::topics().into_iter().map(|topic| topic.type_name).collect();
    let types = Arc::new(v6_0::library().unwrap());
    Stage::with(DomainConfig { types, exact: Arc::new(exact), translates: true, ..config() })
}

fn of_umaa(guid: DomainGuid, writes: bool, topic: &str) -> DomainEvent {
    let DomainEvent::Endpoint(found) = endpoint(guid, writes, topic) else { unreachable!() };
    let extensibility = Some(Extensibility::Appendable);
    DomainEvent::Endpoint(Box::new(Endpoint { type_name: topic.into(), extensibility, ..*found }))
}

fn identifier(id: u8, parent: u8) -> Value {
    Value::Structure(vec![Some(Value::Octets(vec![id; 16])), Some(Value::Octets(vec![parent; 16]))])
}

fn time(seconds: i64) -> Value {
    Value::Structure(vec![Some(Value::Signed(seconds)), Some(Value::Signed(5))])
}

fn health(status: Option<&str>) -> Bytes {
    let schema = Schema::new(&v6_0::library().unwrap(), HEALTH).unwrap();
    let value = Value::Structure(vec![
        Some(time(1)),
        Some(Value::Enumeration(4)),
        status.map(|status| Value::Text(status.into())),
        Some(time(2)),
        Some(identifier(1, 9)),
        Some(Value::Enumeration(7)),
        Some(identifier(2, 0)),
    ]);
    schema.write(&value, Representation::xcdr2(Extensibility::Appendable)).unwrap().into()
}

fn fleet_health(code: ErrorCode) -> HealthReport {
    HealthReport {
        code,
        log_time: DateTime::new(1, 5).unwrap(),
        severity: ErrorCondition::Warn,
        status: LongDescription::new("").unwrap(),
        time_stamp: DateTime::new(2, 5).unwrap(),
        source: Guid([1; 16]),
        resource_id: Guid([2; 16]),
    }
}

fn said(actions: Vec<Action>) -> (Vec<Message>, Vec<String>) {
    let (mut messages, mut notes) = (Vec::new(), Vec::new());
    for action in actions {
        match action {
            Action::SendAt(message, _) => messages.push(message),
            Action::Note(note) if note.level == Level::Warning => notes.push(note.text),
            _ => {}
        }
    }
    (messages, notes)
}

#[test]
fn health_of_a_newer_bus_is_health_of_the_fleet_and_what_is_lost_is_told_once() {
    let mut stage = newer();
    let route = stage.opens(of_umaa(guid(1, 1), true, HEALTH))[0].route;
    let mut arrive = |cdr, at| said(stage.give(DomainEvent::Arrived(route, written(guid(1, 1), at, cdr))));
    let (messages, notes) = arrive(health(None), 10);
    let own = umaa::label::<HealthReport>(source(5, 30)).unwrap();
    assert_eq!((messages.len(), &messages[0].label), (1, &own));
    let told: HealthReport = umaa::decode(&messages[0].content).unwrap();
    assert_eq!(told, fleet_health(ErrorCode::Sensor));
    assert_eq!(notes, [format!("{HEALTH}: the parents of identifiers are not carried")]);
    assert_eq!(arrive(health(Some("x")), 20).1, [""; 0], "each kind is told once");
    let left = said(stage.give(DomainEvent::WriterGone(route, guid(1, 1), true))).0;
    assert_eq!((left[0].change, &left[0].label), (Change::Dispose, &own));
    assert_eq!(stage.domain.counters.untranslatable, 1);
}

#[test]
fn health_of_the_fleet_is_written_as_the_newer_bus_has_it_and_again_for_who_comes_late() {
    let mut stage = newer();
    let first = stage.give(of_umaa(guid(1, 1), false, HEALTH));
    let subscribes = |action: &Action| match action {
        Action::Subscribe(prefixes) => prefixes.iter().map(ToString::to_string).collect(),
        _ => Vec::new(),
    };
    let subscribed: Vec<String> = first.iter().flat_map(subscribes).collect();
    assert_eq!(subscribed, ["UMAA::SO::HealthReport::HealthReport"]);
    let far = source(400, 2);
    let label = umaa::label::<HealthReport>(far).unwrap();
    let mut envelope = from_fleet(far, Change::Put, 7, Bytes::new(), 5);
    envelope.message = umaa::put(label, &fleet_health(ErrorCode::Sensor));
    let written = stage.writes(&envelope);
    assert_eq!(written, [(Sending::Sample, without_parents(), 5)]);
    // Another code ends the instance of the one before, which here is another instance.
    envelope.message.content = umaa::encode(&fleet_health(ErrorCode::Power));
    let written: Vec<_> = stage.writes(&envelope).into_iter().map(|(sending, _, _)| sending).collect();
    assert_eq!(written, [Sending::Dispose, Sending::Sample]);
    let DomainEvent::Endpoint(mut late) = of_umaa(guid(2, 1), false, HEALTH) else { unreachable!() };
    late.extensibility = Some(Extensibility::Final);
    let came = stage.give(DomainEvent::Endpoint(late));
    assert!(came.iter().any(|action| matches!(action, Action::TellAgain(_))));
    stage.domain.handle(Default::default(), Input::Again(&envelope), &mut stage.out);
    let again: Vec<_> = stage.written().into_iter().map(|(sending, cdr, _)| (sending, cdr[1])).collect();
    assert_eq!(again, [(Sending::Sample, 7)], "who had it does not get it again");
}

fn without_parents() -> Bytes {
    let schema = Schema::new(&v6_0::library().unwrap(), HEALTH).unwrap();
    let value = Value::Structure(vec![
        Some(time(1)),
        Some(Value::Enumeration(4)),
        Some(Value::Text(String::new())),
        Some(time(2)),
        Some(identifier(1, 0)),
        Some(Value::Enumeration(7)),
        Some(identifier(2, 0)),
    ]);
    schema.write(&value, Representation::xcdr2(Extensibility::Appendable)).unwrap().into()
}

#[test]
fn a_configuration_is_read_and_written_as_a_set_of_its_resources() {
    let mut stage = newer();
    stage.opens(of_umaa(guid(1, 1), false, CONFIG));
    let more = stage.give(of_umaa(guid(1, 2), false, v6_0::RESOURCES_ELEMENT));
    let is_again = |action: &Action| matches!(action, Action::TellAgain(prefixes) if prefixes.len() == 1);
    assert!(more.iter().any(is_again), "what is retained was written for the report alone");
    let mut envelope = from_fleet(source(400, 10), Change::Put, 7, Bytes::new(), 5);
    let report = umaa::ResourceAllocationConfigReport {
        resources: vec![umaa::ResourceAllocationDefinition {
            related_sources: Vec::new().try_into().unwrap(),
            resource_id: Guid([3; 16]),
        }]
        .try_into()
        .unwrap(),
        time_stamp: DateTime::new(1, 2).unwrap(),
        source: Guid([1; 16]),
    };
    envelope.message =
        umaa::put(umaa::label::<umaa::ResourceAllocationConfigReport>(source(400, 10)).unwrap(), &report);
    let written: Vec<_> = stage.writes(&envelope).into_iter().map(|(sending, _, _)| sending).collect();
    assert_eq!(written, [Sending::Sample; 2], "an element, and the report");
    assert_eq!(stage.writes(&envelope).len(), 1, "what has not changed is not said again");
}
