//! Aldis and a peer in Python, which knows nothing of it but the written format, over real Zenoh.

mod figures;
mod harness;
mod vectors;

use aldis_envelope::umaa::{self, HealthReport, Topic};
use aldis_tests::python;
use harness::Fleet;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::PathBuf;

/// Zenoh for Python, of the same version as the Rust one.
fn zenoh() -> Option<PathBuf> {
    python::with_packages(&["eclipse-zenoh==1.10.2"])
}

fn unhex(text: &Value) -> Vec<u8> {
    let text = text.as_str().expect("hexadecimal digits");
    let digit = |at: usize| u8::from_str_radix(&text[at..at + 2], 16).expect("hexadecimal digits");
    (0..text.len()).step_by(2).map(digit).collect()
}

#[test]
fn python_reads_what_aldis_sends() {
    let Some(python) = zenoh() else { return };
    let fleet = Fleet::start();
    let sub = fleet.start_peer(&python, &["sub", HealthReport::NAME]);
    let mut statuses = BTreeSet::new();
    let mut last: Option<(u64, u64)> = None;
    while statuses.len() < 4 {
        let heard = sub.next().expect("the node repeats its reports");
        for (field, value) in [
            ("source", json!([400, 2])),
            ("address", json!(HealthReport::NAME)),
            ("descriptor", json!(HealthReport::NAME)),
            ("content_type", json!("umaa")),
            ("node", json!(400)),
            ("priority", json!(5)),
            ("change", json!("put")),
            ("key", json!(null)),
            ("call", json!(null)),
        ] {
            assert_eq!(heard[field], value, "{field}");
        }
        let stamp = (heard["boot"].as_u64().expect("boot"), heard["sequence"].as_u64().expect("sequence"));
        if let Some((boot, sequence)) = last {
            assert_eq!(stamp, (boot, sequence + 1), "the stream has no holes");
        }
        last = Some(stamp);
        let report: HealthReport = umaa::decode(&unhex(&heard["content"])).expect("a report");
        assert_eq!(heard["instance"], report.instance().hash.to_string());
        let read = &heard["read"];
        assert_eq!(read["source"], report.source.to_string());
        assert_eq!(read["resource_id"], report.resource_id.to_string());
        assert_eq!(read["status"], report.status.as_str());
        assert_eq!(read["severity"], format!("{:?}", report.severity).to_uppercase());
        assert_eq!(read["code"], format!("{:?}", report.code).to_uppercase());
        assert_eq!(read["time_stamp"], aldis_envelope::Wall::from(report.time_stamp).0);
        statuses.insert(report.status.as_str().to_owned());
    }
    fleet.node.signal("TERM");
    let disposed = std::iter::from_fn(|| sub.next()).find(|heard| heard["change"] == "dispose");
    let disposed = disposed.expect("a node that ends in order disposes its reports");
    assert_eq!(unhex(&disposed["key"]).len(), 32);
    assert_eq!(disposed["content"], "");
}

#[test]
fn aldis_reads_what_python_sends() {
    let Some(python) = zenoh() else { return };
    let fleet = Fleet::start();
    let sub = fleet.start_aldis(&["sub", "interop.", "eid9000", "UMAA::.", "--json"]);
    let cycle = fleet.start_foreign(&python, &["cycle"]);
    let chunk = "0000012c000000000000000000000000";
    let topic = "interop.Topic";
    let mut expected = vec![
        json!([topic, "text", topic, "Put", null, "broadcast", 0, ""]),
        json!([topic, "text", topic, "Put", chunk, "keyed", 0, ""]),
        json!([topic, "text", topic, "Dispose", chunk, "", 0, ""]),
        json!([topic, "text", topic, "Unregister", chunk, "", 0, ""]),
        json!(["eid9000sid7", "lmcp", topic, "Put", null, "to one", 3, "g"]),
        json!(["eid9000sid7", "lmcp", topic, "Dispose", chunk, "", 0, ""]),
        json!(["eid9000sidall", "x-own", topic, "Put", null, "to all", 0, ""]),
        json!(["UMAA::.a:b. é", "cdr", "d", "Put", null, "exact", 0, ""]),
    ];
    let all = expected.clone();
    while !expected.is_empty() {
        let heard = sub.next().expect("the peer repeats its messages");
        assert_eq!([&heard["source_entity"], &heard["source_service"], &heard["node"]], [300, 5, 300]);
        let content = String::from_utf8(unhex(&heard["content"]["hex"])).expect("UTF-8");
        let form = json!([
            heard["address"],
            heard["content_type"],
            heard["descriptor"],
            heard["change"],
            heard["instance"],
            content,
            heard["skipped"],
            heard["source_group"],
        ]);
        assert!(all.contains(&form), "not to be received: {form}");
        expected.retain(|wanted| *wanted != form);
    }
    cycle.finish();
}

#[test]
fn calls_pass_both_ways() {
    let Some(python) = zenoh() else { return };
    let fleet = Fleet::start();
    let ping = |to: &str| {
        let peer = fleet.start_peer(&python, &["--as", "301", "ping", to, "--within", "10"]);
        std::iter::from_fn(|| peer.next()).collect::<Vec<_>>()
    };
    let answers = ping("eid400sid1");
    assert_eq!([&answers[0]["from"], &answers[0]["descriptor"]], ["eid400sid1", "aldis.Pong"]);
    assert_eq!(answers[1], json!({ "ok": true, "answers": 1 }));
    assert_eq!(ping("eid401sid1"), [json!({ "ok": false, "answers": 0 })]);

    let service = fleet.start_peer(&python, &["--as", "300", "--service", "5", "serve"]);
    assert_eq!(service.next(), Some(json!({ "serving": "eid300sid5" })));
    for to in ["eid300sid5", "eid300sidall", "eid300"] {
        let answers = fleet.aldis(&["call", to, "--ping", "--json", "--within", "10s"]).json();
        assert_eq!([&answers[0]["from"], &answers[0]["descriptor"]], ["eid300sid5", "aldis.Pong"], "{to}");
        assert_eq!(answers[1]["answers"], 1);
    }
    let seen = fleet.aldis(&["fleet", "--json"]).json();
    assert!(seen.contains(&json!({ "node": 300, "services_alive": [5], "answers": false })), "{seen:?}");
    let refused = fleet.aldis(&["call", "eid300sid5", "--request", "interop.Unknown", "--within", "10s"]);
    assert_eq!(refused.code, Some(1));
    assert!(refused.stderr.contains("not understood: interop.Unknown"));

    service.finish();
    let nobody = fleet.aldis(&["call", "eid300sid5", "--ping", "--within", "10s"]);
    assert_eq!(nobody.code, Some(3), "nobody is there, and that is told at once");
}

#[test]
fn what_is_refused_is_counted_and_stops_nothing() {
    let Some(python) = zenoh() else { return };
    let fleet = Fleet::start();
    let foreign = fleet.start_foreign(&python, &["refused"]);
    let told = foreign.next().expect("a line");
    assert!(told["sent"].as_u64().is_some_and(|sent| sent > 30));
    assert_eq!(told["counted"], told["sent"], "{told}");
    assert_eq!([&told["pong"]["descriptor"], &told["pong"]["content"]], ["aldis.Pong", "good"]);
    assert!(told["pong"]["seconds"].as_f64().is_some_and(|seconds| seconds < 5.0), "{told}");
    let services = told["services"].as_array().expect("a list");
    assert!(services.contains(&json!({ "source": [400, 1], "name": "node", "state": "running" })), "{told}");
}
