//! `kind = "dds"`.

use super::super::error::Fault;
use super::super::text::PlainName;
use super::common::{Common, queue_messages_max, stall_timeout_ms};
use aldis_envelope::description::{Definition, Draft, Extensibility, Library, Member, Structure, Type};
use aldis_envelope::{Dialect, Group, ServiceId, umaa};
use aldis_services::map::dds::{Glob, GlobError, QualityRule, Rules};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The highest domain: those above have no ports left.
const DOMAIN_MAX: u32 = 230;

/// A bridge that takes part in a DDS domain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "DdsTable", into = "DdsTable")]
pub(crate) struct Dds {
    /// What every kind has.
    pub(crate) common: Common,
    /// The rest as it is written.
    pub(crate) table: Box<DdsTable>,
    /// Which topics cross.
    pub(crate) topics: Rules,
    /// Quality of service by topic.
    pub(crate) rules: Vec<QualityRule>,
    /// The types that are described.
    pub(crate) types: Arc<Library>,
    /// The types of topics that are described as the specification of the version has them.
    pub(crate) exact: Arc<BTreeSet<String>>,
}

/// Which quality of service topics have.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct DdsQos {
    /// Of which topics: `*` stands for any text.
    topics: String,
    /// Whether samples are repaired: RELIABLE, or BEST_EFFORT.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reliable: Option<bool>,
    /// Whether late joiners get what is kept: TRANSIENT_LOCAL, or VOLATILE.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    durable: Option<bool>,
    /// How many samples of an instance are kept for them; 0 is all, within 500.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    keep_last: Option<u32>,
}

/// The table as it is written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct DdsTable {
    /// The name in logs and counters, unique on the node.
    name: PlainName,
    /// The service id of the bridge on the node's own entity: 20 to 99, unique on the node.
    #[schemars(with = "crate::config::schema::BridgeServiceId")]
    service: ServiceId,
    /// The number of the domain. Default: 0.
    #[serde(default)]
    #[schemars(range(min = 0, max = 230))]
    pub(crate) domain: u32,
    /// The version of UMAA that is spoken in it. Default: 5.2.1.
    #[serde(default)]
    pub(crate) version: DdsVersion,
    /// Whether Support Operations of 6.0 are told to the fleet in 5.2.1, and the other way; what cannot be said is logged once.
    /// Otherwise they cross as they are, between buses of 6.0 alone. Default: true.
    #[serde(default = "translate")]
    pub(crate) translate: bool,
    /// The partition; what is in others is not seen. Default: the one without a name. Bridges join their partition alone, and
    /// partitions of the same name across the fleet.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub(crate) partition: String,
    /// Topics that cross, by name: `*` stands for any text, `?` for a character. Default: all.
    #[serde(default = "all_topics")]
    pub(crate) allow: Vec<String>,
    /// Topics that do not, though they are allowed. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) deny: Vec<String>,
    /// Quality of service by topic; the first that matches counts, before the patterns of UMAA.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) qos: Vec<DdsQos>,
    /// A folder of IDL files that describe further types, beside this file. Default: the types of UMAA Support Operations alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) idl: Option<PathBuf>,
    /// A file with a configuration of Cyclone DDS, beside this file. Default: what `CYCLONEDDS_URI` says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) cyclonedds: Option<PathBuf>,
    /// How many samples wait for readers that do not confirm; over half of it the input is held back. Default: 8192.
    #[serde(default = "queue_messages_max")]
    #[schemars(range(min = 1, max = 1_000_000))]
    queue_messages_max: u32,
    /// How long readers may confirm nothing before what waits for them is dropped, in milliseconds. Default: 5000.
    #[serde(default = "stall_timeout_ms")]
    #[schemars(range(min = 10, max = 600_000))]
    stall_timeout_ms: u32,
}

fn translate() -> bool {
    true
}

fn all_topics() -> Vec<String> {
    vec!["*".into()]
}

impl TryFrom<DdsTable> for Dds {
    type Error = Fault;

    fn try_from(table: DdsTable) -> Result<Self, Fault> {
        if !cfg!(feature = "dds") {
            return Err(Fault::new(
                "kind",
                "this program was built without DDS",
                "apt-get install -y cmake libclang-dev, then cargo build --release --features dds",
            ));
        }
        super::in_range("domain", table.domain, 0..=DOMAIN_MAX, "(a domain's number)")?;
        let fault = |key: &str, why: GlobError| {
            Fault::new(key, why.to_string(), "give a name or a pattern such as \"*Report\"")
        };
        let globs = |key: &str, texts: &[String]| {
            texts
                .iter()
                .map(|text| text.parse::<Glob>())
                .collect::<Result<_, _>>()
                .map_err(|why| fault(key, why))
        };
        let topics = Rules { allow: globs("allow", &table.allow)?, deny: globs("deny", &table.deny)? };
        let rule = |(place, qos): (usize, &DdsQos)| {
            let topics = qos.topics.parse().map_err(|why| fault(&format!("qos.{place}.topics"), why))?;
            Ok(QualityRule { topics, reliable: qos.reliable, durable: qos.durable, keep_last: qos.keep_last })
        };
        let rules = table.qos.iter().enumerate().map(rule).collect::<Result<_, Fault>>()?;
        Group::new(&table.partition).map_err(|why| {
            Fault::new(
                "partition",
                why.to_string(),
                "give a partition that the fleet can carry as a source group",
            )
        })?;
        let common = Common {
            name: table.name.clone(),
            service: table.service,
            dialect: Dialect::default(),
            import: Vec::new(),
            export: Vec::new(),
            message_bytes_max: super::common::message_bytes_max(),
            queue_messages_max: table.queue_messages_max,
            stall_timeout_ms: table.stall_timeout_ms,
            peer: None,
            self_generated: true,
        };
        let (types, exact) = built_in(table.version);
        Ok(Self { common: common.check()?, table: Box::new(table), topics, rules, types, exact })
    }
}

impl From<Dds> for DdsTable {
    fn from(bridge: Dds) -> Self {
        *bridge.table
    }
}

/// The version of UMAA that a domain speaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub(crate) enum DdsVersion {
    /// 5.2.1, which the fleet speaks.
    #[default]
    #[serde(rename = "5.2.1")]
    V5_2_1,
    /// 6.0.
    #[serde(rename = "6.0")]
    V6_0,
}

/// Two libraries as one; where both have a name, the first counts.
fn both(first: &Library, second: &Library) -> Result<Library, String> {
    let mut draft = Draft::default();
    let more = second.definitions().filter(|(name, _)| first.get(name).is_none());
    for (name, definition) in first.definitions().chain(more) {
        draft.add(name, definition.clone()).map_err(|error| error.to_string())?;
    }
    draft.finish().map_err(|errors| errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))
}

/// The IDL files of a folder and those below it, by their paths from it.
fn idl_files(root: &Path, folder: &Path, files: &mut BTreeMap<String, String>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            idl_files(root, &path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "idl") {
            let name = path.strip_prefix(root).unwrap_or(&path).display().to_string();
            files.insert(name, std::fs::read_to_string(&path)?);
        }
    }
    Ok(())
}

/// The type of `aldis bench dds`: a number as its key, and bytes.
pub(crate) const BENCH_TYPE: &str = "aldis::Bench";

/// Types with that of the measurement beside them.
fn with_bench_type(library: &Library) -> Library {
    let mut draft = Draft::default();
    let members = vec![
        Member::new(0, "key", Type::Int32).key(),
        Member::new(1, "payload", Type::sequence(Type::Octet, Some(1 << 16))),
    ];
    let bench = Structure { extensibility: Extensibility::Appendable, base: None, members };
    let added = draft.add(BENCH_TYPE, Definition::Structure(bench)).ok();
    let bench = added.and_then(|()| draft.finish().ok()).unwrap_or_default();
    // What is sound stays so beside a type that needs nothing.
    both(&bench, library).unwrap_or_default()
}

/// The type of `aldis bench dds` alone.
#[cfg(feature = "dds")]
pub(crate) fn bench_types() -> Arc<Library> {
    Arc::new(with_bench_type(&Library::default()))
}

/// The types of a version, and of a folder.
#[cfg(feature = "dds")]
pub(crate) fn dds_types(version: DdsVersion, folder: Option<&Path>) -> Result<Arc<Library>, String> {
    let (own, _) = built_in(version);
    let Some(folder) = folder else { return Ok(own) };
    let mut files = BTreeMap::new();
    idl_files(folder, folder, &mut files).map_err(|why| format!("{}: {why}", folder.display()))?;
    let idl = aldis_envelope::idl::parse(&files, Extensibility::Appendable);
    let idl = idl.map_err(|errors| errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))?;
    both(&idl.library, &own).map(Arc::new)
}

/// The types that every program knows, and the names of those that topics have.
fn built_in(version: DdsVersion) -> (Arc<Library>, Arc<BTreeSet<String>>) {
    // A test of theirs rules out that they are unsound.
    let (library, topics) = match version {
        DdsVersion::V5_2_1 => (umaa::v5_2_1::library(), umaa::v5_2_1::described_topics()),
        DdsVersion::V6_0 => (umaa::v6_0::library(), umaa::v6_0::topics()),
    };
    let exact = topics.into_iter().map(|topic| topic.type_name).collect();
    (Arc::new(with_bench_type(&library.unwrap_or_default())), Arc::new(exact))
}

#[cfg_attr(not(feature = "dds"), allow(dead_code, reason = "no bridge is made of it then"))]
impl Dds {
    /// Puts a directory before relative paths, and reads the types of the IDL folder.
    ///
    /// # Errors
    /// A folder that cannot be read, and every mistake in its files.
    pub(crate) fn read_types(&mut self, base: &Path) -> Result<(), Fault> {
        for path in [&mut self.table.idl, &mut self.table.cyclonedds] {
            *path = path.take().map(|relative| base.join(relative));
        }
        let Some(folder) = &self.table.idl else { return Ok(()) };
        let fault = |what: String| {
            Fault::new("idl", what, "give a folder of IDL files; `aldis idl check` says what is in it")
        };
        let mut files = BTreeMap::new();
        idl_files(folder, folder, &mut files).map_err(|why| fault(format!("{}: {why}", folder.display())))?;
        let idl = aldis_envelope::idl::parse(&files, Extensibility::Appendable);
        let idl = idl.map_err(|errors| {
            fault(errors.iter().take(8).map(ToString::to_string).collect::<Vec<_>>().join("; "))
        })?;
        // What the folder describes counts before what is built in.
        let added = both(&idl.library, &self.types);
        self.exact = Arc::new(
            self.exact
                .iter()
                .filter(|name| idl.library.get(name).is_none_or(|own| self.types.get(name) == Some(own)))
                .cloned()
                .collect(),
        );
        self.types = Arc::new(added.map_err(fault)?);
        Ok(())
    }
}
