//! LMCP on the command line: files there and back, and messages from files over the bus.

use aldis_tests::{Directory, Done, Site, aldis, shared};
use serde_json::Value;
use std::path::{Path, PathBuf};

const SCENARIO: &str = "\
<AMASE>
  <ScenarioEventList>
    <AirVehicleState Time=\"0.2\" Series=\"CMASI\"><ID>400</ID><Heading>90</Heading></AirVehicleState>
    <RemoveTasks Series=\"CMASI\"><TaskList><int64>7</int64></TaskList></RemoveTasks>
    <KeyValuePair Time=\"0.1\" Series=\"CMASI\"><Key>colour</Key><Value>red</Value><Colour/></KeyValuePair>
  </ScenarioEventList>
</AMASE>
";

/// A folder with a scenario and the messages in it.
struct Folder(Directory);

impl Folder {
    fn new() -> Self {
        let folder = Self(Directory::new());
        folder.0.write("scenario.xml", SCENARIO);
        let (from, to) = (folder.file("scenario.xml"), folder.file("scenario.lmcp"));
        let done = aldis(["lmcp", "encode", &from, "-o", &to, "--json"]);
        assert_eq!(done.code, Some(0), "{done:?}");
        assert_eq!(done.json()[0]["messages"], 3);
        assert!(done.stderr.contains("scenario.xml: line 5: afrl.cmasi.KeyValuePair has no field Colour"));
        folder
    }

    fn file(&self, name: &str) -> String {
        self.0.path().join(name).display().to_string()
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.file(name)).unwrap()
    }

    fn put(&self, name: &str, bytes: &[u8]) -> String {
        let file = self.file(name);
        std::fs::write(&file, bytes).unwrap();
        file
    }
}

fn types(done: &Done) -> Vec<String> {
    done.json().iter().map(|object| object["_type"].as_str().unwrap_or_default().to_owned()).collect()
}

#[test]
fn a_file_goes_to_json_and_back_to_the_same_bytes() {
    let folder = Folder::new();
    let decoded = aldis(["lmcp", "decode", &folder.file("scenario.lmcp"), "--json"]);
    assert_eq!(decoded.code, Some(0), "{decoded:?}");
    assert_eq!(
        types(&decoded),
        ["afrl.cmasi.AirVehicleState", "afrl.cmasi.RemoveTasks", "afrl.cmasi.KeyValuePair"]
    );
    assert_eq!(decoded.json()[0]["fields"]["Heading"], 90.0);
    let json = folder.put("again.json", decoded.stdout.as_bytes());
    let again = aldis(["lmcp", "encode", &json, "-o", &folder.file("again.lmcp")]);
    assert_eq!(again.code, Some(0), "{again:?}");
    assert_eq!(folder.bytes("again.lmcp"), folder.bytes("scenario.lmcp"));
}

#[test]
fn a_wrong_message_is_named_and_the_others_are_shown() {
    let folder = Folder::new();
    let mut bytes = folder.bytes("scenario.lmcp");
    let first = 12 + u32::from_be_bytes([bytes[4], bytes[5], bytes[6], bytes[7]]) as usize;
    bytes[first + 22] = 9;
    let file = folder.put("wrong.lmcp", &bytes);
    let done = aldis(["lmcp", "decode", &file, "--json"]);
    assert_eq!(done.code, Some(1), "{done:?}");
    assert_eq!(types(&done), ["afrl.cmasi.AirVehicleState", "afrl.cmasi.KeyValuePair"]);
    assert!(done.stderr.contains("wrong.lmcp: message 2: checksum"), "{}", done.stderr);
    assert!(done.stderr.contains("1 of 3 messages were not read"), "{}", done.stderr);
    let cut = folder.put("cut.lmcp", &bytes[..first + 10]);
    let done = aldis(["lmcp", "decode", &cut]);
    assert!(done.code == Some(1) && done.stderr.contains("message 2: "), "{done:?}");
}

#[test]
fn frames_of_a_stream_are_told_with_address_and_source() {
    let folder = Folder::new();
    let message = aldis_envelope::lmcp::encode(&aldis_envelope::lmcp::cmasi::Task::default()).unwrap();
    let delimited = [b"eid400.sid37$lmcp|afrl.cmasi.Task||1|61$", &message[..]].concat();
    let frames = [aldis_tests::frame(&delimited), aldis_tests::frame(b"junk")].concat();
    let done = aldis(["lmcp", "decode", &folder.put("frames.bin", &frames), "--json"]);
    assert_eq!(done.code, Some(1), "{done:?}");
    let told = &done.json()[0];
    assert_eq!(told["address"], "eid400sid37");
    assert_eq!((&told["source_entity"], &told["source_service"]), (&Value::from(1), &Value::from(61)));
    assert_eq!(told["object"]["_type"], "afrl.cmasi.Task");
    assert!(done.stderr.contains("message 2: no `$` after the address"), "{}", done.stderr);
}

#[test]
fn what_cannot_be_encoded_is_said_with_its_place() {
    let folder = Folder::new();
    let wrong =
        r#"{"_type":"afrl.cmasi.Task","fields":{}} {"_type":"afrl.cmasi.Task","fields":{"TaskID":"x"}}"#;
    for (name, text, why) in [
        ("field.json", wrong, "object 2: a 64-bit integer expected in TaskID"),
        ("syntax.json", "{", "object 1: line 1: a key expected"),
        ("open.xml", "<a>\n<b>", "open.xml: line 2: the document ends within the element b"),
        ("none.xml", "<a/>", "no LMCP object"),
    ] {
        let done = aldis(["lmcp", "encode", &folder.put(name, text.as_bytes())]);
        assert!(done.code == Some(1) && done.stderr.contains(why), "{name}: {done:?}");
        assert!(done.stdout.is_empty());
    }
    assert_eq!(aldis(["lmcp", "encode", &folder.file("absent.json")]).code, Some(2));
}

#[test]
fn verification_counts_and_names_what_differs() {
    let folder = Folder::new();
    let task = r#"{"_type":"afrl.cmasi.RemoveTasks","fields":{"TaskList":[7]}}"#;
    let (json, lmcp) = (folder.put("a.json", task.as_bytes()), folder.file("a.lmcp"));
    assert_eq!(aldis(["lmcp", "encode", &json, "-o", &lmcp]).code, Some(0));
    let full = aldis(["lmcp", "decode", &lmcp, "--json"]).stdout;
    folder.put("a.json", full.as_bytes());
    let verify = || aldis(["lmcp", "verify", &folder.0.path().display().to_string(), "--json"]);
    let done = verify();
    assert_eq!(done.code, Some(0), "{done:?}");
    let told = &done.json()[0];
    assert_eq!(
        (&told["files"], &told["identical"], &told["fields_equal"]),
        (&2.into(), &2.into(), &1.into())
    );
    assert_eq!((&told["without_json"], &told["xml"]["stable"]), (&1.into(), &3.into()));
    folder.put("a.json", full.replace("[7]", "[8]").as_bytes());
    let mut bytes = folder.bytes("scenario.lmcp");
    let end = bytes.len();
    bytes[end - 4..].fill(0);
    folder.put("scenario.lmcp", &bytes);
    folder.put("ill.xml", b"<a>\n</b>");
    let done = verify();
    assert_eq!(done.code, Some(1), "{done:?}");
    let failures = done.json()[0]["failures"].clone();
    let named: Vec<_> = failures.as_array().unwrap().iter().map(|it| name_of(&it["file"])).collect();
    assert_eq!(named, ["a.lmcp", "ill.xml", "scenario.lmcp"], "{failures:#}");
    assert_eq!(failures[1]["line"], 2);
}

fn name_of(file: &Value) -> String {
    PathBuf::from(file.as_str().unwrap()).file_name().unwrap().to_str().unwrap().to_owned()
}

#[test]
fn the_reference_s_messages_come_back_as_they_were() {
    let Some(messages) = shared("uxas/lmcp") else { return };
    let done = aldis(["lmcp".as_ref(), "verify".as_ref(), messages.as_os_str(), "--json".as_ref()]);
    let told = &done.json()[0];
    for counted in ["files", "identical", "fields_equal"] {
        assert_eq!(told[counted], 164, "{told:#}");
    }
    assert_eq!(done.code, Some(0));
}

#[test]
fn of_the_reference_s_scenarios_only_ill_formed_ones_are_named_with_their_line() {
    let Some(scenarios) = shared("uxas/scenarios") else { return };
    let done = aldis(["lmcp".as_ref(), "verify".as_ref(), scenarios.as_os_str(), "--json".as_ref()]);
    let told = &done.json()[0];
    assert_eq!(told["xml"]["files"], 202);
    assert_eq!(told["xml"]["well_formed"], 197);
    assert_eq!(told["xml"]["objects"], told["xml"]["stable"]);
    let failures = told["failures"].as_array().unwrap();
    assert!(failures.len() == 5 && failures.iter().all(|it| it["line"].is_u64()), "{failures:#?}");
    assert_eq!(done.code, Some(1));
}

/// Publishes by these arguments while somebody listens, and gives what came, decoded.
fn heard(args: &[&str], count: &str) -> Vec<Value> {
    let site = Site::new();
    let _shore = site.start_shore();
    site.wait_for(1);
    std::thread::scope(|scope| {
        let listener = scope.spawn(|| {
            site.aldis(&[
                "sub",
                "afrl.cmasi",
                "eid400",
                "--decode",
                "--json",
                "--for",
                "20s",
                "--count",
                count,
            ])
        });
        // The listener is there once a node's status counts its service; publishing again until it ends is as good.
        while !listener.is_finished() {
            let published = site.aldis(&[&["pub"], args].concat());
            assert_eq!(published.code, Some(0), "{published:?}");
        }
        let listened = listener.join().unwrap();
        assert_eq!(listened.code, Some(0), "{listened:?}");
        listened.json()
    })
}

#[test]
fn a_scenario_is_published_object_by_object_when_it_says() {
    let folder = Folder::new();
    let came = heard(&["--lmcp-xml", &folder.file("scenario.xml"), "--timed"], "5");
    let text = |it: &Value, field: &str| it[field].as_str().unwrap_or_default().to_owned();
    let order = ["afrl.cmasi.RemoveTasks", "afrl.cmasi.KeyValuePair", "afrl.cmasi.AirVehicleState"];
    let first = came.iter().position(|it| text(it, "descriptor") == order[0]).expect("three of five");
    for (it, name) in came[first..].iter().zip(order) {
        assert_eq!((text(it, "address"), text(it, "descriptor")), (name.into(), name.into()));
        assert_eq!(it["content"]["_type"], name);
        let keyed = name.ends_with("State");
        assert_eq!(it["instance"].is_string(), keyed, "the vehicle's number is its instance: {it:#}");
    }
    assert!(came.len() - first >= 3, "{came:#?}");
}

#[test]
fn objects_of_json_go_to_a_service() {
    let folder = Folder::new();
    let task = r#"{"_type":"afrl.cmasi.RemoveTasks","fields":{"TaskList":[7]}}"#;
    let came = heard(&["eid400sid37", "--lmcp-json", &folder.put("a.json", task.as_bytes())], "1");
    assert_eq!(came[0]["address"], "eid400sid37");
    assert_eq!(came[0]["descriptor"], "afrl.cmasi.RemoveTasks");
    assert_eq!(came[0]["content"]["fields"]["TaskList"][0], 7);
}

#[test]
fn what_to_publish_must_be_clear() {
    let folder = Folder::new();
    let xml = folder.file("scenario.xml");
    for args in [
        &["pub"][..],
        &["pub", "--text", "x"],
        &["pub", "a", "--lmcp-xml", &xml, "--text", "x"],
        &["pub", "--lmcp-xml", &xml, "--descriptor", "a"],
        &["pub", "a", "--text", "x", "--timed"],
        &["pub", "--lmcp-xml", Path::new("absent.xml").to_str().unwrap()],
    ] {
        let done = aldis(args);
        assert!(done.code == Some(2) && !done.stderr.is_empty(), "{args:?}: {done:?}");
    }
}
