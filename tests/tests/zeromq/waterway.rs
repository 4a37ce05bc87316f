//! A client as those of OpenUxAS are gets a plan through a ZeroMQ bridge; its waypoints stand beside those that OpenUxAS gave.

use super::Stage;
use aldis_envelope::codec::delimited;
use aldis_envelope::codec::stream::{Item, Reader};
use aldis_envelope::lmcp::cmasi::{AutomationResponse, Location3D, Waypoint};
use aldis_envelope::lmcp::{self, Object};
use aldis_tests::shared;
use serde_json::json;

/// The services that answer the request, with the costs of the reference or the true ones.
fn services(compat: bool) -> String {
    let mut text = "[[service]]\nkind = \"automation-request-validator\"\nservice = 100\n\
                    [[service]]\nkind = \"assignment-tree-branch-bound\"\nservice = 101\n"
        .to_owned();
    let kinds = [
        ("task-manager", ""),
        ("route-planner-visibility", ""),
        ("route-aggregator", ""),
        ("plan-builder", "assignment_start_point_lead_m = 0.0\n"),
    ];
    for (place, (kind, more)) in kinds.into_iter().enumerate() {
        text += &format!(
            "[[service]]\nkind = \"{kind}\"\nservice = {}\ncompat_cost = {compat}\n{more}",
            102 + place
        );
    }
    text
}

/// The messages of a recording in delimited form.
fn recorded(name: &str) -> Option<Vec<Vec<u8>>> {
    let bytes =
        std::fs::read(shared("uxas/captures/waterway")?.join(name)).expect("the recording can be read");
    let mut reader = Reader::new(1 << 20);
    reader.buffer().extend_from_slice(&bytes);
    let mut messages = Vec::new();
    while let Some(item) = reader.next_item() {
        let Item::Message(message) = item else { panic!("{item:?}") };
        messages.push(message.to_vec());
    }
    Some(messages)
}

fn payload(message: &[u8]) -> &[u8] {
    &message[delimited::payload_offset(message).expect("it has a head")..]
}

/// Whose mission it is, and where it leads.
fn missions(content: &[u8]) -> Vec<(i64, Vec<Waypoint>)> {
    let response = lmcp::decode_as::<AutomationResponse>(content).expect("an AutomationResponse");
    let missions = response.mission_command_list.iter().filter_map(|mission| mission.get());
    let waypoints = |mission: &lmcp::cmasi::MissionCommand| {
        mission.waypoint_list.iter().filter_map(|waypoint| waypoint.get().cloned()).collect()
    };
    missions.map(|mission| (mission.vehicle_id, waypoints(mission))).collect()
}

fn place(waypoint: &Waypoint) -> &Location3D {
    (waypoint as &dyn Object).get::<Location3D>().expect("a waypoint is a place")
}

/// Metres east and north of a first point, on a sphere: they are near each other.
fn plane(from: &Waypoint, to: &Waypoint) -> (f64, f64) {
    let (from, to) = (place(from), place(to));
    let east = (to.longitude - from.longitude).to_radians() * from.latitude.to_radians().cos();
    (east * 6_371_000.0, (to.latitude - from.latitude).to_radians() * 6_371_000.0)
}

/// Metres between two waypoints.
fn apart(one: &Waypoint, other: &Waypoint) -> f64 {
    let (east, north) = plane(one, other);
    east.hypot(north)
}

/// Metres from a waypoint to a way.
fn off(way: &[Waypoint], waypoint: &Waypoint) -> f64 {
    let leg = |pair: &[Waypoint]| {
        let ((ax, ay), (bx, by)) = (plane(waypoint, &pair[0]), plane(waypoint, &pair[1]));
        let (dx, dy) = (bx - ax, by - ay);
        let along = (-(ax * dx + ay * dy) / (dx * dx + dy * dy).max(1e-12)).clamp(0.0, 1.0);
        (ax + along * dx).hypot(ay + along * dy)
    };
    way.windows(2).map(leg).fold(f64::INFINITY, f64::min)
}

/// What the node answers to the client's messages.
fn planned(compat: bool) -> Option<(Vec<u8>, Vec<u8>)> {
    let recorded = recorded("tcp_raw.bin")?;
    let is = |message: &[u8], name: &str| message.starts_with(name.as_bytes());
    let from_client = |message: &&Vec<u8>| {
        let head = &message[..delimited::payload_offset(message).expect("it has a head")];
        head.ends_with(b"|100|61$")
    };
    let stage = Stage::of_entity(100, ["pull", "publish"], "single", &services(compat))?;
    let mut uxas = stage.connected("single", "");
    super::warm_up(&mut uxas);
    for message in recorded.iter().filter(from_client) {
        uxas.tell(&json!(["send", [message.iter().map(|&byte| char::from(byte)).collect::<String>()]]));
    }
    loop {
        let received = uxas.receive()[0].as_str().expect("text").to_owned();
        if received.starts_with("afrl.cmasi.AutomationResponse$") {
            let bytes: Vec<u8> = received.chars().map(|byte| byte as u8).collect();
            let theirs = recorded.iter().find(|message| is(message, "afrl.cmasi.AutomationResponse$"));
            return Some((payload(&bytes).to_vec(), payload(theirs.expect("it was answered")).to_vec()));
        }
    }
}

/// The one mission of an answer, the waypoints on the way to the task and those of the task.
fn split(content: &[u8]) -> (i64, Vec<Waypoint>, Vec<Waypoint>) {
    let missions = missions(content);
    assert_eq!(missions.len(), 1, "one vehicle has something to do");
    let (vehicle, mut waypoints) = missions.into_iter().next().expect("one mission");
    let numbers = waypoints.iter().zip(1..).all(|(waypoint, number)| waypoint.number == number);
    assert!(numbers, "waypoints are numbered from 1");
    let first = waypoints.iter().position(|waypoint| !waypoint.associated_tasks.is_empty());
    let of_task = waypoints.split_off(first.expect("the task has waypoints"));
    (vehicle, waypoints, of_task)
}

/// With the costs of the reference, the search itself is the same to the millimetre. The way there is not: a leg is straight
/// where OpenUxAS, which reckons with a straight leg too, then flies two turns, in 14 waypoints.
#[test]
fn a_foreign_client_gets_the_search_that_openuxas_gave() {
    let Some((ours, theirs)) = planned(true) else { return };
    let ((vehicle, way, search), (their_vehicle, their_way, their_search)) = (split(&ours), split(&theirs));
    assert_eq!((vehicle, search.len()), (their_vehicle, their_search.len()));
    assert_eq!((way.len(), their_way.len()), (0, 14));
    for (ours, theirs) in search.iter().zip(&their_search) {
        assert!(apart(ours, theirs) < 1e-3, "{ours:?} and {theirs:?}");
        assert_eq!((ours.speed, &ours.associated_tasks), (theirs.speed, &theirs.associated_tasks));
        assert_eq!(place(ours).altitude, place(theirs).altitude);
    }
}

/// With true costs the vehicle turns as it can, as OpenUxAS has it turn, in finer steps; the search differs by what a flat earth is off.
#[test]
fn a_foreign_client_gets_the_way_that_openuxas_gave() {
    let Some((ours, theirs)) = planned(false) else { return };
    let ((vehicle, way, search), (their_vehicle, their_way, their_search)) = (split(&ours), split(&theirs));
    assert_eq!((vehicle, search.len()), (their_vehicle, their_search.len()));
    assert!(way.len() > their_way.len());
    let whole = [&way[..], &search[..1]].concat();
    let farthest = their_way.iter().map(|waypoint| off(&whole, waypoint)).fold(0.0, f64::max);
    let shifted =
        search.iter().zip(&their_search).map(|(ours, theirs)| apart(ours, theirs)).fold(0.0, f64::max);
    eprintln!("the ways differ by at most {farthest:.1} m, the searches by {shifted:.1} m");
    assert!(farthest < 2.0 && shifted < 1.0, "{farthest} {shifted}");
}
