use super::*;
use crate::service::Action;
use aldis_envelope::lmcp::cmasi::{AirVehicleState, Location3D};
use aldis_envelope::lmcp::{Object, Ref, Struct};
use aldis_envelope::{Address, BootId, Call, CallId, Label, Message, Priority, Role, ServiceId, Stamp};
use std::sync::Arc;

fn source(entity: u64) -> Source {
    Source::new(EntityId::new(entity).unwrap(), ServiceId::new(100).unwrap())
}

fn now(ms: u64) -> Now {
    let wall = Wall(i64::try_from(ms).unwrap() * 1_000_000);
    Now { monotonic: Monotonic::since_start(Duration::from_millis(ms)), wall }
}

fn envelope(message: Message, sent_ms: i64) -> Envelope {
    let stamp = Stamp {
        node: message.label.source().entity,
        boot: BootId(1),
        sequence: 1,
        source_time: Wall(sent_ms * 1_000_000),
        lifespan_left_ms: None,
        priority: Priority::Data,
        skipped: 0,
        via: Default::default(),
    };
    Envelope { message, stamp }
}

fn state(vehicle: i64, heading: f32, sent_ms: i64) -> Envelope {
    let mut state = AirVehicleState::default();
    let base = (&mut state as &mut dyn Object).get_mut::<EntityState>().unwrap();
    base.id = vehicle;
    base.heading = heading;
    base.location = Ref::new(Location3D { latitude: 45.5, longitude: -121.0, ..Default::default() });
    let name = Name::new(AirVehicleState::TYPE.full_name).unwrap();
    let label = Label::broadcast(ContentType::Lmcp, name, source(400));
    let content = lmcp::encode(&state).unwrap();
    envelope(Message::new(Arc::new(label), content.into()), sent_ms)
}

fn asked(entities: &mut Entities, at: Now) -> Vec<EntityStates> {
    let label = Label::limitedcast(
        Address::Service(source(1)),
        ContentType::Aldis,
        aldis_envelope::Descriptor::new(STATES_QUERY).unwrap(),
        source(9_000),
    );
    let call = Some(Box::new(Call { id: CallId(7), role: Role::Request { time_left_ms: 1_000 } }));
    let query = envelope(Message { call, ..Message::new(Arc::new(label), Vec::new().into()) }, 0);
    let mut out = Outbox::new(source(1));
    entities.handle(at, Input::Message(&query), &mut out);
    let replies = out.drain().map(|action| match action {
        Action::Send(message) => aldis::decode(&message.content).expect("states"),
        _ => panic!("replies alone"),
    });
    replies.collect()
}

fn with(states: &[(Envelope, Now)]) -> Entities {
    let (mut entities, mut out) = (Entities::default(), Outbox::new(source(1)));
    for (state, at) in states {
        entities.handle(*at, Input::Message(state), &mut out);
    }
    assert!(out.is_empty());
    entities
}

#[test]
fn the_latest_state_of_each_vehicle_is_told_with_its_ages() {
    let states = [
        (state(400, 10.0, 900), now(1_000)),
        (state(500, 20.0, 5_000), now(1_500)),
        (state(400, 30.0, 1_800), now(2_000)),
    ];
    let told = asked(&mut with(&states), now(2_500));
    assert_eq!((told.len(), told[0].held_by), (1, source(1).entity));
    let told: Vec<_> =
        told[0].states.iter().map(|s| (s.vehicle, s.heading_deg, s.heard_ms, s.age_ms)).collect();
    // The clock of 500 is ahead: its state is as old as it has been here.
    assert_eq!(told, [(400, 30.0, 500, 700), (500, 20.0, 1_000, 1_000)]);
}

#[test]
fn an_older_state_that_comes_later_is_not_taken() {
    let states = [(state(400, 30.0, 1_800), now(2_000)), (state(400, 10.0, 900), now(2_001))];
    let told = asked(&mut with(&states), now(2_002));
    assert_eq!(told[0].states[0].heading_deg, 30.0);
    assert_eq!(told[0].states[0].latitude_deg, Some(45.5));
    assert_eq!(told[0].states[0].descriptor, "afrl.cmasi.AirVehicleState");
}

#[test]
fn many_states_come_in_several_answers() {
    let states: Vec<_> = (1..=600).map(|vehicle| (state(vehicle, 0.0, 0), now(1))).collect();
    let told = asked(&mut with(&states), now(2));
    assert_eq!(told.iter().map(|told| told.states.len()).collect::<Vec<_>>(), [256, 256, 88]);
}

#[test]
fn states_of_every_kind_of_vehicle_are_heard() {
    let heard: Vec<_> = Entities::default().subscriptions().iter().map(ToString::to_string).collect();
    for name in ["afrl.cmasi.AirVehicleState", "afrl.vehicles.SurfaceVehicleState", STATES_QUERY] {
        assert!(heard.iter().any(|prefix| prefix == name), "{name} of {heard:?}");
    }
}
