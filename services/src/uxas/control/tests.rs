//! A mission without anybody who could give control.

use super::{Control, ControlledMissions, GuardedVehicle};
use crate::service::{Action, Input, Outbox, Service};
use crate::uxas::kinematic::KinematicConfig;
use crate::uxas::waypoint_manager::WaypointConfig;
use aldis_envelope::lmcp::cmasi::{MissionCommand, ServiceStatus, Waypoint};
use aldis_envelope::lmcp::{Object, Ref, Struct, decode, encode};
use aldis_envelope::umaa::{ResourceAllocationCommand, Topic};
use aldis_envelope::{
    BootId, ContentType, EntityId, Envelope, Fleet, GuidForm, Guids, Label, Message, Monotonic, Name, Now,
    Priority, ServiceId, Source, Stamp, Wall,
};
use std::sync::Arc;
use std::time::Duration;

fn source(entity: u64, service: u64) -> Source {
    Source::new(EntityId::new(entity).unwrap(), ServiceId::new(service).unwrap())
}

fn guids() -> Guids {
    Guids::new(&Fleet::new("blue").unwrap(), GuidForm::Readable)
}

fn control() -> Control {
    Control::of(EntityId::new(400).unwrap(), "autopilot")
}

fn mission(from: Source) -> Envelope {
    let mut mission = MissionCommand { first_waypoint: 1, ..MissionCommand::default() };
    (mission.vehicle_id, mission.command_id) = (400, 7);
    mission.waypoint_list = vec![Ref::new(Waypoint { number: 1, next_waypoint: 1, ..Waypoint::default() })];
    let name = Name::new(MissionCommand::TYPE.full_name).unwrap();
    let label = Label::broadcast(ContentType::Lmcp, name, from);
    let stamp = Stamp {
        node: from.entity,
        boot: BootId(1),
        sequence: 1,
        source_time: Wall(0),
        lifespan_left_ms: None,
        priority: Priority::Data,
        skipped: 0,
        via: Default::default(),
    };
    let content = encode(&mission as &dyn Object).unwrap();
    Envelope { message: Message::new(Arc::new(label), content.into()), stamp }
}

/// What a service sends at an input after so many seconds: the descriptor, and what a status says.
fn give(service: &mut dyn Service, seconds: u64, input: Input<'_>) -> Vec<(String, String)> {
    let mut out = Outbox::new(source(1, 100));
    let now = Now { monotonic: Monotonic::since_start(Duration::from_secs(seconds)), wall: Wall(0) };
    service.handle(now, input, &mut out);
    let sent = out.drain().filter_map(|action| match action {
        Action::Send(message) => Some(message),
        _ => None,
    });
    sent.map(|message| {
        let object = decode(&message.content).ok();
        let status = object.as_ref().and_then(|object| object.get::<ServiceStatus>());
        let said = status.and_then(|status| Some(status.info.first()?.get()?.value.to_string()));
        (message.label.descriptor().to_owned(), said.unwrap_or_default())
    })
    .collect()
}

#[test]
fn no_mission_goes_out_where_nobody_gives_control_and_the_cause_is_told_in_time() {
    let mut missions = ControlledMissions::new(source(1, 100), &guids(), WaypointConfig::of(400), control());
    let sent = give(&mut missions, 1, Input::Message(&mission(source(1, 101))));
    let names: Vec<&str> = sent.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, [ResourceAllocationCommand::NAME], "control first");
    assert_eq!(missions.next_deadline(), Some(Monotonic::since_start(Duration::from_secs(31))));
    let sent = give(&mut missions, 31, Input::Deadline);
    assert!(sent.iter().all(|(name, _)| name != MissionCommand::TYPE.full_name), "{sent:?}");
    let why = "mission 7 of vehicle 400 ends: control is not given of `autopilot`: the arbiter eid400sid10 does not answer";
    assert!(sent.iter().any(|(_, said)| said == why), "{sent:?}");
}

#[test]
fn missions_of_another_shore_are_not_its_own_to_serve() {
    let mut missions = ControlledMissions::new(source(1, 100), &guids(), WaypointConfig::of(400), control());
    assert_eq!(give(&mut missions, 1, Input::Message(&mission(source(2, 100)))), []);
}

#[test]
fn a_vehicle_without_an_arbiter_follows_nobody() {
    let config = KinematicConfig::of(400, Duration::from_secs(1));
    let mut vehicle = GuardedVehicle::new(source(400, 100), &guids(), config, control());
    give(&mut vehicle, 0, Input::HistoryComplete(true));
    let early = give(&mut vehicle, 1, Input::Message(&mission(source(1, 100))));
    assert_eq!(early, [], "an arbiter may yet be heard");
    let sent: Vec<_> = (2..=12).flat_map(|second| give(&mut vehicle, second, Input::Deadline)).collect();
    assert_eq!(sent.len(), 1, "{sent:?}");
    assert!(
        sent[0].1.contains("mission 7 of eid1sid100 is refused: no arbiter of `autopilot` is heard"),
        "{sent:?}"
    );
}
