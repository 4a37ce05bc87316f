//! CDR against real Cyclone DDS: its Python binding, whose types are written by hand there, and ours must give the same bytes,
//! keys and values, for every topic of Support Operations in both versions.

mod samples;

use aldis_envelope::codec::cdr::{ByteOrder, Form, HEADER, KeySchema, Representation, Schema};
use aldis_envelope::description::{Extensibility, Library};
use aldis_envelope::umaa::{self, v5_2_1, v6_0};
use aldis_tests::{python, root};
use fastrand::Rng;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// Samples of each topic in each version and extensibility.
const SAMPLES: usize = 12;

/// Cyclone DDS, told and asked line by line.
struct Cyclone {
    child: Child,
    stdin: ChildStdin,
    stdout: BufReader<ChildStdout>,
}

impl Cyclone {
    fn start() -> Option<Self> {
        let python = python::with_packages(&["cyclonedds==11.0.1"])?;
        let mut command = Command::new(python);
        command.arg(root().join("tests/tests/cdr/cyclone.py"));
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("Python starts");
        let stdin = child.stdin.take().expect("it is piped");
        let stdout = BufReader::new(child.stdout.take().expect("it is piped"));
        Some(Self { child, stdin, stdout })
    }

    fn ask(&mut self, question: &Value) -> Value {
        writeln!(self.stdin, "{question}").expect("it listens");
        let mut line = String::new();
        self.stdout.read_line(&mut line).expect("it answers");
        serde_json::from_str(&line).unwrap_or_else(|why| panic!("{why}: `{line}` to {question}"))
    }
}

impl Drop for Cyclone {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn unhex(text: &Value) -> Vec<u8> {
    let text = text.as_str().expect("hexadecimal digits");
    let digit = |at: usize| u8::from_str_radix(&text[at..at + 2], 16).expect("hexadecimal digits");
    (0..text.len()).step_by(2).map(digit).collect()
}

/// A sample without the filler that its header tells of. Cyclone's binding for Python leaves it to its core to fill up.
fn unfilled(sample: &[u8]) -> Vec<u8> {
    let mut bare = sample[..sample.len() - usize::from(sample[3] & 3)].to_vec();
    bare[3] = 0;
    bare
}

fn forms(extensibility: Extensibility) -> [(&'static str, Representation); 4] {
    let second = Representation::xcdr2(extensibility);
    let big = |form| Representation { form, order: ByteOrder::Big };
    [
        ("xcdr1-little", Representation::XCDR1),
        ("xcdr1-big", big(Form::Xcdr1)),
        ("xcdr2-little", second),
        ("xcdr2-big", big(second.form)),
    ]
}

/// One sample: our reader, our writer and our keys against Cyclone's.
fn compare(cyclone: &mut Cyclone, schema: &Schema, question: &Value) {
    let told = cyclone.ask(question);
    let keys = KeySchema::new(schema).expect("all topics of Support Operations have keys");
    let mut instances = Vec::new();
    for (name, representation) in forms(schema.extensibility()) {
        let theirs = unhex(&told[name]);
        let read = schema.read(&theirs).unwrap_or_else(|why| panic!("{name} of {question}: {why}"));
        assert_eq!((read.representation, read.differs), (representation, false));
        assert_eq!(schema.json(&read.value), question["members"], "{name}");
        let ours = schema.write(&read.value, representation).expect("what was read is written");
        assert_eq!(hex(&unfilled(&ours)), hex(&theirs), "{name} of {question}");
        assert_eq!(ours.len() % 4, HEADER % 4);
        instances.push(keys.of_sample(schema, &theirs).expect("it has a key"));
    }
    let alone = keys.of_key_sample(&unhex(&told["key"])).expect("a key alone is read");
    assert!(instances.iter().all(|instance| *instance == alone), "{question}");
    let key = alone.key.expect("a key that was read is known");
    let big = forms(schema.extensibility())[3].1;
    assert_eq!(
        hex(&unfilled(&keys.key_sample(&key, big).expect("a key"))),
        told["key"].as_str().expect("digits")
    );
    let ours = unhex(&told["xcdr2-little"]);
    let read = cyclone.ask(&json!({
        "version": question["version"], "extensibility": question["extensibility"],
        "type": question["type"], "read": hex(&ours),
    }));
    assert_eq!(read, question["members"]);
}

fn version(cyclone: &mut Cyclone, name: &str, library: &Library, types: &[String], seed: u64) {
    let mut random = Rng::with_seed(seed);
    for type_name in types {
        let open = Schema::new(library, type_name).expect("a type of Support Operations");
        for (extensibility, schema) in [("appendable", &open), ("final", &open.as_final())] {
            for number in 0..SAMPLES {
                let members = samples::made_up(&mut random, library, type_name, number);
                let question = json!({
                    "version": name, "extensibility": extensibility, "type": type_name, "members": members,
                });
                compare(cyclone, schema, &question);
            }
        }
    }
}

#[test]
fn every_topic_of_both_versions_has_the_bytes_and_keys_that_cyclone_gives_it() {
    let Some(mut cyclone) = Cyclone::start() else { return };
    let types = |topics: Vec<aldis_envelope::description::Topic>| {
        topics.into_iter().map(|topic| topic.type_name).collect::<Vec<_>>()
    };
    let (older, newer) = (types(v5_2_1::described_topics()), types(v6_0::topics()));
    assert_eq!((older.len(), newer.len()), (11, 12));
    version(&mut cyclone, "5.2.1", &v5_2_1::library().expect("it is sound"), &older, 521);
    version(&mut cyclone, "6.0", &v6_0::library().expect("it is sound"), &newer, 600);
}

#[test]
fn contents_of_envelopes_become_cyclones_bytes_and_come_back() {
    let Some(mut cyclone) = Cyclone::start() else { return };
    let library = v5_2_1::library().expect("it is sound");
    let mut random = Rng::with_seed(7);
    for topic in umaa::topics() {
        let schema = Schema::new(&library, topic.type_name).expect("a type of Support Operations");
        for number in 0..SAMPLES {
            let members = samples::made_up(&mut random, &library, topic.type_name, number);
            let told = cyclone.ask(&json!({
                "version": "5.2.1", "extensibility": "appendable", "type": topic.type_name, "members": members,
            }));
            let (content, instance) = topic.sample(&members.to_string()).expect("a sample in JSON");
            for (name, representation) in forms(Extensibility::Appendable) {
                let theirs = unhex(&told[name]);
                assert_eq!(schema.to_postcard(&theirs).expect("a sample").as_deref(), Some(&content[..]));
                let ours = schema.of_postcard(&content, representation).expect("a content");
                assert_eq!(hex(&unfilled(&ours)), hex(&theirs), "{name}");
            }
            let keys = KeySchema::new(&schema).expect("it has a key");
            assert_eq!(keys.of_key_sample(&unhex(&told["key"])).expect("a key"), instance);
        }
    }
}
