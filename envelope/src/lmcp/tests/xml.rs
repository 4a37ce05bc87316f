//! The XML form: the reference's scenario files, and what reading tolerates.

use std::path::Path;

use super::{files, golden_messages, read, shared};
use crate::lmcp::cmasi::{AirVehicleState, AltitudeType, AutomationRequest, KeyValuePair, Location3D};
use crate::lmcp::impact::CommRelayTask;
use crate::lmcp::{Object, Ref, Text, WarningKind, XmlFault, decode, encode, read_xml, to_xml, types};

/// The one object of a document without anything to warn of.
fn read_one(xml: &str) -> Box<dyn Object> {
    let mut document = read_xml(xml.as_bytes()).unwrap();
    assert_eq!(document.warnings, [], "{xml}");
    assert_eq!(document.objects.len(), 1, "{xml}");
    document.objects.remove(0).object
}

/// Object, LMCP, object, XML, object: all the same.
fn assert_stable(object: &dyn Object, path: &Path) {
    let message = encode(object).unwrap();
    let decoded = decode(&message).unwrap();
    let xml = to_xml(decoded.as_ref()).unwrap();
    let again = read_one(&xml);
    assert_eq!(encode(again.as_ref()).unwrap(), message, "{}", path.display());
    assert_eq!(to_xml(again.as_ref()).unwrap(), xml, "{}", path.display());
}

#[test]
fn scenario_files_are_read_stably_and_ill_formed_ones_named() {
    let Some(folder) = shared("scenarios") else { return };
    let mut ill_formed = Vec::new();
    let (mut messages, mut scenarios, mut timed) = (0, 0, 0);
    let paths = files(&folder, "xml");
    assert_eq!(paths.len(), 202);
    for path in &paths {
        let name = path.file_name().unwrap().to_str().unwrap();
        let text = read(path);
        match read_xml(&text) {
            Ok(document) => {
                for warning in &document.warnings {
                    let passed = matches!(warning.kind, WarningKind::UnknownField { .. });
                    assert!(passed, "{}: {warning}", path.display());
                }
                document.objects.iter().for_each(|placed| assert_stable(placed.object.as_ref(), path));
                let text = String::from_utf8_lossy(&text);
                if text.contains("<AMASE") {
                    scenarios += 1;
                    timed += document.objects.iter().filter(|placed| placed.time.is_some()).count();
                } else if !text.contains("<UxAS") {
                    messages += 1;
                    assert_eq!(document.objects.len(), 1, "{}", path.display());
                }
            }
            Err(error) => ill_formed.push((name, error.line)),
        }
    }
    ill_formed.sort_unstable();
    let expected = [
        ("AirVehicleConfiguration_V103.xml", 73),
        ("AirVehicleConfiguration_V103.xml", 73),
        ("AirVehicleConfiguration_V103.xml", 73),
        ("PointSearchTask_100.xml", 60),
        ("cfg_MultiVehicleWatchTask.xml", 11),
    ];
    assert_eq!(ill_formed, expected);
    assert_eq!((messages, scenarios, timed), (162, 16, 46));
}

#[test]
fn a_recorded_mission_is_read_stably() {
    let Some(folder) = shared("waterway-trace") else { return };
    let paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert_eq!(paths.len(), 17);
    for path in paths {
        let document = read_xml(&read(&path)).unwrap();
        assert_eq!(document.objects.len(), 1);
        assert_stable(document.objects[0].object.as_ref(), &path);
    }
}

#[test]
fn every_type_goes_through_xml() {
    for message in golden_messages() {
        let object = decode(message).unwrap();
        let again = read_one(&to_xml(object.as_ref()).unwrap());
        assert_eq!(encode(again.as_ref()).unwrap(), *message);
    }
}

#[test]
fn what_is_not_known_is_passed_over_and_told() {
    let xml = r#"<AirVehicleState Series="CMASI">
        <ID>400</ID>
        <GroundTrack>0</GroundTrack>
        <Heading>north</Heading>
        <Location><Location3D Series="CMASI"><Latitude>45.5</Latitude></Location3D><Wedge/></Location>
        <PayloadStateList><Teapot Series="TEA"/><GimbalState Series="CMASI"/></PayloadStateList>
        <AssociatedTasks><int64>1.0</int64><int64>x</int64><uint32>3</uint32></AssociatedTasks>
        <Info><Location3D Series="CMASI"/></Info>
    </AirVehicleState>"#;
    let document = read_xml(xml.as_bytes()).unwrap();
    let warnings: Vec<_> = document.warnings.iter().map(ToString::to_string).collect();
    let expected = [
        "line 3: afrl.cmasi.AirVehicleState has no field GroundTrack",
        "line 4: \"north\" is not a value of Heading",
        "line 5: Location has no room for another Wedge",
        "line 6: type Teapot of series TEA is not known",
        "line 7: \"x\" is not a value of AssociatedTasks",
        "line 8: Info does not hold afrl.cmasi.Location3D",
    ];
    assert_eq!(warnings, expected);
    let state: &AirVehicleState = document.objects[0].object.get().unwrap();
    assert_eq!((state.id, state.heading, state.payload_state_list.len(), state.info.len()), (400, 0.0, 1, 0));
    assert_eq!(state.associated_tasks, [1, 3]);
    assert_eq!(state.location.get().unwrap().latitude, 45.5);
}

#[test]
fn a_document_that_is_not_well_formed_tells_the_line() {
    let fault = |xml: &[u8]| {
        let error = read_xml(xml).unwrap_err();
        (error.line, error.fault)
    };
    assert_eq!(fault(b"<a>\n<b>"), (2, XmlFault::Unclosed("b".into())));
    assert_eq!(fault(b"<a/>\n\n<b/>"), (3, XmlFault::Junk));
    assert_eq!(fault(b"<a/>\n\nb"), (3, XmlFault::Junk));
    assert_eq!(fault(b"\n<!-- a\n<!-- b --><a/>"), (3, XmlFault::Comment));
    assert_eq!(fault(b"<!-- a\n---><a/>"), (2, XmlFault::Comment));
    assert_eq!(fault(b"<a>\n&b;</a>"), (2, XmlFault::Entity("b".into())));
    assert_eq!(fault(b"<a>\n\xff</a>"), (2, XmlFault::Encoding));
    assert_eq!(fault(b"\n"), (2, XmlFault::NoRoot));
    assert_eq!(fault("<a>".repeat(100).as_bytes()), (1, XmlFault::Depth));
    assert!(matches!(fault(b"<a>\n\n</b>"), (3, XmlFault::Syntax(_))));
    assert!(matches!(fault(b"<a>\n<b c=1/></a>"), (2, XmlFault::Syntax(_))));
    assert!(read_xml("\u{feff}<a/>".as_bytes()).is_ok());
}

#[test]
fn texts_come_back_with_blanks_and_markup() {
    for text in ["", " ", " a ", "a\r\nb", "\n<&>\t\"'", "]]>", "é\u{1f600}", "&amp;"] {
        let pair = KeyValuePair { key: text.into(), value: "v".into() };
        assert_eq!(read_one(&to_xml(&pair).unwrap()).get(), Some(&pair), "{text:?}");
    }
    let pair = KeyValuePair { key: "a\0".into(), value: Text::default() };
    assert_eq!(to_xml(&pair).unwrap_err().to_string(), "XML cannot hold '\\0' in Key");
}

#[test]
fn blanks_around_a_text_are_no_part_of_it() {
    let request = read_one(
        "<AutomationRequest Series='CMASI'><TaskRelationships>\n  p(1 <!-- or --> 2)&#32;\n\
         </TaskRelationships></AutomationRequest>",
    );
    let request: &AutomationRequest = request.get().unwrap();
    assert_eq!(request.task_relationships, "p(1  2) ");
}

#[test]
fn nulls_are_written_where_they_are_not_the_default() {
    let task = CommRelayTask::default();
    assert!(!to_xml(&task).unwrap().contains("DestinationLocation"));
    let state = AirVehicleState::default();
    let mut base = state.base.clone();
    base.location = Ref::NULL;
    base.info = vec![Ref::NULL];
    let state = AirVehicleState { base, ..state };
    let xml = to_xml(&state).unwrap();
    assert_eq!(xml.matches("<null/>").count(), 2);
    assert_eq!(read_one(&xml).get::<AirVehicleState>(), Some(&state));
}

#[test]
fn numbers_come_back_to_the_last_bit() {
    let place = Location3D {
        latitude: 0.1 + 0.2,
        longitude: -f64::MIN_POSITIVE,
        altitude: f32::INFINITY,
        altitude_type: AltitudeType(-7),
    };
    assert_eq!(read_one(&to_xml(&place).unwrap()).get(), Some(&place));
}

#[test]
fn an_object_of_each_type_with_nothing_said_of_it_is_read() {
    for info in types() {
        let xml = format!("<{} Series=\"{}\"/>", info.name, info.series.text);
        assert_eq!(read_one(&xml).type_info(), info);
    }
}

#[test]
fn nulls_do_not_multiply_memory() {
    let nulls = |count: usize| {
        let list = "<null/>".repeat(count);
        read_xml(format!("<Task Series='CMASI'><Parameters>{list}</Parameters></Task>").as_bytes())
    };
    assert!(nulls(4).is_ok());
    assert_eq!(nulls(10_000).unwrap_err().fault, XmlFault::Memory);
}

#[test]
fn what_is_passed_over_is_counted_where_there_is_no_room_to_note_it() {
    let xml = format!("<Task Series='CMASI'>{}</Task>", "<a/>".repeat(1000));
    let document = read_xml(xml.as_bytes()).unwrap();
    assert!(!document.warnings.is_empty() && document.more_warnings > 0);
    assert_eq!(document.warnings.len() + document.more_warnings, 1000);
}
