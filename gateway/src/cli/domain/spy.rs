//! A participant that only looks: endpoints as they come and go, mismatches between them, and every change of every topic.

use crate::cli::exit::Failure;
use crate::cli::print_line;
use crate::cli::within::Within;
use crate::config::DdsVersion;
use aldis_dds::{
    Change, Discovery, Endpoint, Guid, History, Incoming, Participant, ParticipantConfig, Qos, Reader, Side,
    Topic, TypeSource,
};
use aldis_envelope::codec::cdr::{KeySchema, Schema};
use aldis_envelope::description::{Extensibility, Library};
use aldis_services::map::dds::mismatches;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

/// Watch a domain: topics, types, readers, writers, mismatches and samples, a JSON object a line.
#[derive(clap::Args)]
pub(super) struct Spy {
    /// The number of the domain.
    #[arg(long, default_value_t = 0)]
    domain: u32,
    /// A folder of IDL files: samples of their types are shown with their members.
    #[arg(long)]
    idl: Option<PathBuf>,
    /// The version of UMAA's own types: 5.2.1 or 6.0.
    #[arg(long, default_value = "5.2.1", value_parser = version)]
    umaa: DdsVersion,
    /// A file with a configuration of Cyclone DDS. Default: what `CYCLONEDDS_URI` says.
    #[arg(long)]
    cyclonedds: Option<PathBuf>,
    /// Endpoints alone, no samples.
    #[arg(long)]
    quiet: bool,
    /// Watch for so long. Default: until it is stopped.
    #[arg(long = "for")]
    span: Option<Within>,
}

fn version(text: &str) -> Result<DdsVersion, String> {
    match text {
        "5.2.1" => Ok(DdsVersion::V5_2_1),
        "6.0" => Ok(DdsVersion::V6_0),
        _ => Err("5.2.1 and 6.0 are known".into()),
    }
}

enum News {
    Discovered,
    Arrived(String, Incoming),
}

struct Watching {
    spy: Spy,
    participants: BTreeMap<Extensibility, Participant>,
    types: Arc<Library>,
    endpoints: BTreeMap<Guid, Endpoint>,
    readers: BTreeMap<String, Reader>,
    /// By topic: its type, as samples are read.
    schemas: BTreeMap<String, (Schema, Option<KeySchema>)>,
    tell: Sender<News>,
}

impl Spy {
    pub(super) fn run(self) -> Result<(), Failure> {
        let failed = |why: &dyn std::fmt::Display| Failure::Failed(why.to_string());
        let types = crate::config::dds_types(self.umaa, self.idl.as_deref()).map_err(Failure::Usage)?;
        let read = |path: &PathBuf| {
            let text = std::fs::read_to_string(path);
            text.map_err(|why| Failure::Usage(format!("{}: {why}", path.display())))
        };
        let xml = self.cyclonedds.as_ref().map(read).transpose()?;
        let config = ParticipantConfig { xml, ..ParticipantConfig::new(self.domain) };
        let participant = Participant::open(&config).map_err(|why| failed(&why))?;
        let (tell, told) = channel();
        let discovered = tell.clone();
        let on_change = Box::new(move || discovered.send(News::Discovered).unwrap_or_default());
        let discovery = Discovery::new(&participant, on_change).map_err(|why| failed(&why))?;
        let until = self.span.as_ref().map(|span| Instant::now() + span.0);
        let mut watching = Watching {
            spy: self,
            participants: BTreeMap::from([(Extensibility::Appendable, participant)]),
            types,
            endpoints: BTreeMap::new(),
            readers: BTreeMap::new(),
            schemas: BTreeMap::new(),
            tell,
        };
        watching.discovered(&discovery, &config)?;
        loop {
            let left = until
                .map_or(Duration::from_secs(3_600), |until| until.saturating_duration_since(Instant::now()));
            match told.recv_timeout(left) {
                Ok(News::Discovered) => watching.discovered(&discovery, &config)?,
                Ok(News::Arrived(topic, incoming)) => watching.show(&topic, &incoming),
                Err(RecvTimeoutError::Timeout) if until.is_none() => {}
                Err(_) => return Ok(()),
            }
        }
    }
}

impl Watching {
    fn discovered(&mut self, discovery: &Discovery, config: &ParticipantConfig) -> Result<(), Failure> {
        for change in discovery.changes().map_err(|why| Failure::Failed(why.to_string()))? {
            match change {
                Change::Participant(guid, _) => print_line(json!({ "participant": guid.to_string() })),
                Change::ParticipantGone(guid) => print_line(json!({ "participant_gone": guid.to_string() })),
                Change::EndpointGone(guid) => {
                    if self.endpoints.remove(&guid).is_some() {
                        print_line(json!({ "gone": guid.to_string() }));
                    }
                }
                Change::Endpoint(endpoint) => self.endpoint(*endpoint, config),
            }
        }
        Ok(())
    }

    fn endpoint(&mut self, endpoint: Endpoint, config: &ParticipantConfig) {
        let kind = if endpoint.side == Side::Writer { "writer" } else { "reader" };
        print_line(
            json!({ kind: endpoint.guid.to_string(), "topic": endpoint.topic, "type": endpoint.type_name,
                           "qos": crate::bridge::dds::words(&endpoint.qos), "partitions": endpoint.qos.partitions,
                           "tells_type": endpoint.type_information.is_some() }),
        );
        for other in self
            .endpoints
            .values()
            .filter(|other| other.topic == endpoint.topic && other.side != endpoint.side)
        {
            let (writer, reader) =
                if endpoint.side == Side::Writer { (&endpoint, other) } else { (other, &endpoint) };
            for (policy, offered, requested) in disagreements(&writer.qos, &reader.qos) {
                print_line(
                    json!({ "mismatch": policy, "topic": endpoint.topic, "writer": writer.guid.to_string(),
                                   "offered": offered, "reader": reader.guid.to_string(), "requested": requested }),
                );
            }
        }
        if endpoint.side == Side::Writer && !self.spy.quiet && !self.readers.contains_key(&endpoint.topic) {
            match self.read(&endpoint, config) {
                Ok(reader) => drop(self.readers.insert(endpoint.topic.clone(), reader)),
                Err(why) => print_line(json!({ "not_read": endpoint.topic, "why": why })),
            }
        }
        self.endpoints.insert(endpoint.guid, endpoint);
    }

    fn read(&mut self, endpoint: &Endpoint, config: &ParticipantConfig) -> Result<Reader, String> {
        let Some(main) = self.participants.values().next().cloned() else {
            return Err("no participant".into());
        };
        let told = endpoint.type_information.as_ref();
        let extensibility = match told.map(|told| told.extensibility(&main)) {
            Some(Ok(extensibility)) => extensibility,
            _ => Extensibility::Appendable,
        };
        let source = match told {
            Some(told) => TypeSource::Discovered(told),
            None => TypeSource::Described {
                library: &self.types,
                type_name: &endpoint.type_name,
                extensibility: Some(extensibility),
                told: true,
            },
        };
        let participant = match self.participants.get(&extensibility) {
            Some(known) => known.clone(),
            None => Participant::open(config).map_err(|why| why.to_string())?,
        };
        self.participants.insert(extensibility, participant.clone());
        let topic = Topic::new(&participant, &endpoint.topic, source).map_err(|why| why.to_string())?;
        if let Ok(schema) = Schema::new(&self.types, &endpoint.type_name) {
            let schema = if extensibility == Extensibility::Final { schema.as_final() } else { schema };
            let keys = KeySchema::new(&schema);
            self.schemas.insert(endpoint.topic.clone(), (schema, keys));
        }
        let qos = Qos {
            reliable: endpoint.qos.reliable,
            durability: endpoint.qos.durability.min(aldis_dds::Durability::TransientLocal),
            history: History::KeepAll,
            exclusive: endpoint.qos.exclusive,
            partitions: endpoint.qos.partitions.clone(),
            ..Qos::default()
        };
        let (tell, name) = (self.tell.clone(), endpoint.topic.clone());
        let receive = move |incoming: Incoming| tell.send(News::Arrived(name.clone(), incoming)).is_ok();
        Reader::new(&topic, &qos, Box::new(receive), Box::new(|_| ())).map_err(|why| why.to_string())
    }

    fn show(&self, topic: &str, incoming: &Incoming) {
        let Incoming::Change(change) = incoming else { return };
        let known = self.schemas.get(topic);
        let members: Value = match known {
            Some((schema, _)) if change.is_sample => schema
                .read(&change.cdr)
                .map_or_else(|why| json!({ "unreadable": why.to_string() }), |read| schema.json(&read.value)),
            Some((_, Some(keys))) => keys
                .of_key_sample(&change.cdr)
                .ok()
                .and_then(|instance| instance.key)
                .and_then(|key| keys.json(&key).ok())
                .unwrap_or_default(),
            _ => json!({ "cdr": change.cdr.iter().map(|byte| format!("{byte:02x}")).collect::<String>() }),
        };
        let what = match (change.is_sample, change.disposes, change.unregisters) {
            (true, false, _) => "sample",
            (_, true, _) => "dispose",
            _ => "unregister",
        };
        print_line(json!({ what: members, "topic": topic, "writer": change.writer.to_string(),
                           "source_timestamp": change.source_timestamp }));
    }
}

/// What keeps a writer and a reader apart: policy, offered, requested. Partitions must have one in common.
fn disagreements(writer: &Qos, reader: &Qos) -> Vec<(&'static str, String, String)> {
    let (offered, requested) = (crate::bridge::dds::quality(writer), crate::bridge::dds::quality(reader));
    let found = mismatches(&offered, &requested).into_iter();
    let mut found: Vec<_> = found.map(|m| (m.policy, m.offered, m.requested)).collect();
    let shared = offered.partitions.iter().any(|name| requested.partitions.contains(name));
    if offered.partitions != requested.partitions && !shared {
        found.push(("PARTITION", offered.partitions.join(","), requested.partitions.join(",")));
    }
    found
}
