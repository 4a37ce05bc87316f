//! From the text of a file to a configuration, with the place of every mistake.
//!
//! Tables with a `kind` are taken out and read one by one, because serde loses the place of a mistake inside of them.

use super::Config;
use super::bridge::{
    Bridge, Dds, DdsTable, UxasSerial, UxasSerialTable, UxasTcp, UxasTcpTable, UxasZmq, UxasZmqTable,
};
use super::check;
use super::cure::{nearest, split};
use super::error::{ConfigError, Fault};
use super::recorder::{EntityStates, Recorder};
use super::roads::OsmPlanner;
use super::send_messages::SendMessages;
use super::service::{Service, ServiceManager, Track, named_service};
use miette::NamedSource;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

type Element<'a> = Spanned<DeValue<'a>>;

/// Reads and checks a configuration; `file` is how mistakes name it.
pub(super) fn read(file: &str, text: &str) -> Result<Config, ConfigError> {
    let source = Arc::new(NamedSource::new(file, text.to_owned()));
    let place = |mistake| located(&source, text, mistake);
    let (config, mistakes) = parse(text).map_err(place)?;
    let faults = mistakes.into_iter().chain(check::check(&config).into_iter().map(Mistake::Fault));
    match ConfigError::all(faults.map(place).collect()) {
        Some(error) => Err(error),
        None => Ok(config),
    }
}

/// Reads the files that a configuration names; relative ones are taken from a directory.
pub(super) fn read_files(
    config: &mut Config,
    file: &str,
    text: &str,
    base: &Path,
) -> Result<(), ConfigError> {
    let source = Arc::new(NamedSource::new(file, text.to_owned()));
    let mut mistakes = Vec::new();
    for (index, service) in config.services.iter_mut().enumerate() {
        let read = match service {
            Service::SendMessages(send) => send.read(base),
            Service::OsmPlanner(roads) => roads.read(base),
            Service::Recorder(recorder) => {
                recorder.stand(base);
                Ok(())
            }
            _ => Ok(()),
        };
        if let Err(fault) = read {
            let fault = fault.below(&format!("service.{index}"));
            mistakes.push(located(&source, text, Mistake::Fault(fault)));
        }
    }
    for (index, bridge) in config.bridges.iter_mut().enumerate() {
        if let Bridge::Dds(dds) = bridge
            && let Err(fault) = dds.read_types(base)
        {
            mistakes.push(located(&source, text, Mistake::Fault(fault.below(&format!("bridge.{index}")))));
        }
    }
    ConfigError::all(mistakes).map_or(Ok(()), Err)
}

/// What was found: with its place, or with a path to look the place up.
enum Mistake {
    Toml(toml::de::Error, Range<usize>),
    Fault(Fault),
}

fn parse(text: &str) -> Result<(Config, Vec<Mistake>), Mistake> {
    let mut document = DeTable::parse(text).map_err(|e| Mistake::Toml(e, 0..0))?;
    let bridges = take(document.get_mut(), "bridge");
    let services = take(document.get_mut(), "service");
    let mut config = Config::deserialize(Deserializer::from(document)).map_err(|e| Mistake::Toml(e, 0..0))?;
    let mut mistakes = Vec::new();
    for (index, element) in bridges.into_iter().enumerate() {
        match bridge(element, index) {
            Ok(bridge) => config.bridges.push(bridge),
            Err(mistake) => mistakes.push(mistake),
        }
    }
    for (index, element) in services.into_iter().enumerate() {
        match service(element, index) {
            Ok(service) => config.services.push(service),
            Err(mistake) => mistakes.push(mistake),
        }
    }
    Ok((config, mistakes))
}

/// Takes an array out of the document; what is no array stays, so that its type is refused with all others.
fn take<'a>(root: &mut DeTable<'a>, key: &str) -> Vec<Element<'a>> {
    let is_array = root.get(key).is_some_and(|value| matches!(value.get_ref(), DeValue::Array(_)));
    match is_array.then(|| root.remove(key)).flatten().map(Spanned::into_inner) {
        Some(DeValue::Array(array)) => array.into_iter().collect(),
        _ => Vec::new(),
    }
}

fn bridge(element: Element<'_>, index: usize) -> Result<Bridge, Mistake> {
    let path = format!("bridge.{index}");
    let (kind, table) = kind(element, &path, Bridge::KINDS)?;
    match kind.as_str() {
        "uxas-tcp" => {
            let bridge = UxasTcp::try_from(typed::<UxasTcpTable>(table)?);
            Ok(Bridge::UxasTcp(bridge.map_err(|f| Mistake::Fault(f.below(&path)))?))
        }
        "uxas-serial" => {
            let bridge = UxasSerial::try_from(typed::<UxasSerialTable>(table)?);
            Ok(Bridge::UxasSerial(bridge.map_err(|f| Mistake::Fault(f.below(&path)))?))
        }
        "uxas-zmq" => {
            let bridge = UxasZmq::try_from(typed::<UxasZmqTable>(table)?);
            Ok(Bridge::UxasZmq(bridge.map_err(|f| Mistake::Fault(f.below(&path)))?))
        }
        "dds" => {
            let bridge = Dds::try_from(typed::<DdsTable>(table)?);
            Ok(Bridge::Dds(bridge.map_err(|f| Mistake::Fault(f.below(&path)))?))
        }
        other => Err(unknown_kind(&path, other, Bridge::KINDS)),
    }
}

fn service(element: Element<'_>, index: usize) -> Result<Service, Mistake> {
    let path = format!("service.{index}");
    let (kind, table) = kind(element, &path, Service::KINDS)?;
    match kind.as_str() {
        "track" => {
            let track = typed::<Track>(table)?.check();
            Ok(Service::Track(track.map_err(|f| Mistake::Fault(f.below(&path)))?))
        }
        "service-manager" => {
            let manager = typed::<ServiceManager>(table)?;
            named_service(manager.service).map_err(|f| Mistake::Fault(f.below(&path)))?;
            Ok(Service::ServiceManager(manager))
        }
        "send-messages" => {
            let send = typed::<SendMessages>(table)?.check();
            Ok(Service::SendMessages(send.map_err(|f| Mistake::Fault(f.below(&path)))?))
        }
        "osm-planner" => {
            let roads = typed::<OsmPlanner>(table)?.check();
            Ok(Service::OsmPlanner(roads.map_err(|f| Mistake::Fault(f.below(&path)))?))
        }
        "recorder" => {
            let recorder = typed::<Recorder>(table)?.check();
            Ok(Service::Recorder(recorder.map_err(|f| Mistake::Fault(f.below(&path)))?))
        }
        "entity-states" => {
            let states = typed::<EntityStates>(table)?;
            named_service(states.service).map_err(|f| Mistake::Fault(f.below(&path)))?;
            Ok(Service::EntityStates(states))
        }
        other => core(other, table, &path),
    }
}

/// A core service.
fn core(kind: &str, table: Spanned<DeTable<'_>>, path: &str) -> Result<Service, Mistake> {
    let service = match kind {
        "automation-request-validator" => Service::AutomationRequestValidator(typed(table)?),
        "task-manager" => Service::TaskManager(typed(table)?),
        "sensor-manager" => Service::SensorManager(typed(table)?),
        "route-planner-visibility" => Service::RoutePlannerVisibility(typed(table)?),
        "route-aggregator" => Service::RouteAggregator(typed(table)?),
        "assignment-tree-branch-bound" => Service::AssignmentTreeBranchBound(typed(table)?),
        "plan-builder" => Service::PlanBuilder(typed(table)?),
        "operating-region-state" => Service::OperatingRegionState(typed(table)?),
        "waypoint-plan-manager" => Service::WaypointPlanManager(typed(table)?),
        "simulated-vehicle" => Service::SimulatedVehicle(typed(table)?),
        other => return Err(unknown_kind(path, other, Service::KINDS)),
    };
    if let Some(table) = service.core() {
        table.check().map_err(|fault| Mistake::Fault(fault.below(path)))?;
    }
    Ok(service)
}

/// Takes the `kind` off a table.
fn kind<'a>(
    element: Element<'a>,
    path: &str,
    kinds: &[&str],
) -> Result<(String, Spanned<DeTable<'a>>), Mistake> {
    let span = element.span();
    let example = kinds.first().copied().unwrap_or_default();
    let fault = |path: String, message: &str| {
        Mistake::Fault(Fault::new(path, message, format!("write kind = \"{example}\" in its table")))
    };
    let DeValue::Table(mut table) = element.into_inner() else {
        return Err(fault(path.to_owned(), "this is not a table"));
    };
    match table.remove("kind").map(Spanned::into_inner) {
        Some(DeValue::String(kind)) => Ok((kind.into_owned(), Spanned::new(span, table))),
        Some(_) => Err(fault(format!("{path}.kind"), "`kind` is not a text")),
        None => Err(fault(path.to_owned(), "the table has no `kind`")),
    }
}

fn unknown_kind(path: &str, found: &str, kinds: &[&str]) -> Mistake {
    let help = match nearest(found, kinds.iter().copied()) {
        Some(kind) => format!("did you mean \"{kind}\"?"),
        None => format!("there is: {}", kinds.join(", ")),
    };
    Mistake::Fault(Fault::new(format!("{path}.kind"), format!("unknown kind `{found}`"), help))
}

fn typed<T: DeserializeOwned>(table: Spanned<DeTable<'_>>) -> Result<T, Mistake> {
    let span = table.span();
    T::deserialize(Deserializer::from(table)).map_err(|e| Mistake::Toml(e, span))
}

fn located(source: &Arc<NamedSource<String>>, text: &str, mistake: Mistake) -> ConfigError {
    match mistake {
        Mistake::Toml(error, table) => {
            let (message, help) = split(error.message());
            let span = narrowed(text, error.span().unwrap_or(table), &message);
            ConfigError::at(source, span, message, help)
        }
        Mistake::Fault(fault) => {
            ConfigError::at(source, span_of(text, &fault.path), fault.message, fault.help)
        }
    }
}

/// The reader places a mistake in a list at the whole list; where the message quotes the text of one value, only that
/// one is meant.
fn narrowed(text: &str, span: Range<usize>, message: &str) -> Range<usize> {
    let quoted = message.split('`').nth(1).map(|word| format!("\"{word}\""));
    let list = text.get(span.clone()).filter(|list| list.starts_with('['));
    match list.zip(quoted).and_then(|(list, value)| Some((list.find(&value)?, value.len()))) {
        Some((offset, length)) => span.start + offset..span.start + offset + length,
        None => span,
    }
}

/// Where a path stands in the text; of a path that is not written, where the nearest table above it stands.
fn span_of(text: &str, path: &str) -> Range<usize> {
    let Ok(document) = DeTable::parse(text) else { return 0..0 };
    let mut span = 0..0;
    let mut value = DeValue::Table(document.into_inner());
    for segment in path.split('.') {
        let next = match value {
            DeValue::Table(mut table) => table.remove(segment),
            DeValue::Array(array) => {
                let index = segment.parse().unwrap_or(usize::MAX);
                array.into_iter().nth(index)
            }
            _ => None,
        };
        let Some(next) = next else { break };
        span = next.span();
        value = next.into_inner();
    }
    span
}
