//! Roads out of OpenStreetMap's XML.
//!
//! The document is read twice: for the ways that are roads, then for the nodes that these name. So nodes may come before or
//! after ways, and what is no road takes no memory.

use crate::plan::geodesy::Place;
use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

/// How deep elements may be nested: the document's own are three.
const DEPTH_MAX: usize = 16;

/// How many nodes all roads together may name: those of a large country. A segment takes some 150 bytes.
const REFERENCES_MAX: usize = 20_000_000;

/// Why a document is not read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {fault}")]
pub struct RoadsError {
    /// The line, counted from 1.
    pub line: usize,
    /// What is wrong there.
    pub fault: RoadsFault,
}

/// What is wrong with a document.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RoadsFault {
    /// A byte that is not UTF-8.
    #[error("not UTF-8")]
    Encoding,
    /// A fault of syntax.
    #[error("{0}")]
    Syntax(String),
    /// Another kind of document.
    #[error("the document is no OpenStreetMap XML: its first element is `{0}` and not `osm`")]
    NotOsm(String),
    /// The end comes too early.
    #[error("the document ends within an element: it is cut off")]
    CutOff,
    /// Elements are nested too deep.
    #[error("elements nested too deep")]
    Depth,
    /// An attribute is not there.
    #[error("a `{element}` without `{attribute}`")]
    Missing {
        /// The element.
        element: &'static str,
        /// The attribute.
        attribute: &'static str,
    },
    /// An attribute that is none.
    #[error("`{attribute}` = `{value}` is none")]
    Value {
        /// The attribute.
        attribute: &'static str,
        /// Its value.
        value: String,
    },
    /// A node with two places.
    #[error("node {0} is elsewhere in the document already")]
    Twice(i64),
    /// More roads than fit.
    #[error("more than {REFERENCES_MAX} nodes of roads: cut out a smaller region")]
    TooMany,
    /// Nothing to drive on.
    #[error("no road: no way has a tag `highway` and two nodes")]
    NoRoads,
}

/// A road.
#[derive(Debug, Default)]
pub(super) struct Way {
    pub id: i64,
    pub nodes: Vec<i64>,
    /// Whether it may be driven as it is drawn.
    pub forth: bool,
    /// Whether it may be driven the other way.
    pub back: bool,
}

/// What a document holds of roads.
pub(super) struct Document {
    /// The nodes of roads, by id.
    pub nodes: Vec<(i64, Place)>,
    pub ways: Vec<Way>,
    /// How many nodes are named that are not there.
    pub missing_nodes: usize,
}

pub(super) fn parse(document: &[u8]) -> Result<Document, RoadsError> {
    let text = str::from_utf8(document).map_err(|error| RoadsError {
        line: 1 + document[..error.valid_up_to()].iter().filter(|&&byte| byte == b'\n').count(),
        fault: RoadsFault::Encoding,
    })?;
    let ways = ways(text)?;
    let mut ids: Vec<i64> = ways.iter().flat_map(|way| way.nodes.iter().copied()).collect();
    ids.sort_unstable();
    ids.dedup();
    let nodes = nodes(text, &ids)?;
    let is_there = |id: &i64| nodes.binary_search_by_key(id, |node| node.0).is_ok();
    if !ways.iter().any(|way| way.nodes.windows(2).any(|pair| pair.iter().all(is_there))) {
        return Err(RoadsError { line: 1, fault: RoadsFault::NoRoads });
    }
    Ok(Document { missing_nodes: ids.len() - nodes.len(), nodes, ways })
}

/// Hands on the beginning of each element, with how many are open around it, and the end of each.
fn each(
    text: &str,
    mut on: impl FnMut(usize, Option<&BytesStart<'_>>) -> Result<(), RoadsFault>,
) -> Result<(), RoadsError> {
    let mut reader = Reader::from_str(text);
    let mut depth = 0;
    loop {
        let before = reader.buffer_position() as usize;
        let event = reader.read_event();
        let done = match event {
            Ok(Event::Start(tag)) => {
                depth += 1;
                if depth > DEPTH_MAX { Err(RoadsFault::Depth) } else { on(depth - 1, Some(&tag)) }
            }
            Ok(Event::Empty(tag)) => on(depth, Some(&tag)).and_then(|()| on(depth, None)),
            Ok(Event::End(_)) => {
                depth -= 1;
                on(depth, None)
            }
            Ok(Event::Eof) if depth == 0 => return Ok(()),
            Ok(Event::Eof) => Err(RoadsFault::CutOff),
            Ok(_) => Ok(()),
            Err(error) => Err(RoadsFault::Syntax(error.to_string())),
        };
        done.map_err(|fault| {
            let passed = text.as_bytes().get(..before).unwrap_or_default();
            RoadsError { line: 1 + passed.iter().filter(|&&byte| byte == b'\n').count(), fault }
        })?;
    }
}

/// The values of these attributes, where they are there.
fn values<const N: usize>(
    tag: &BytesStart<'_>,
    names: [&'static str; N],
) -> Result<[Option<String>; N], RoadsFault> {
    let mut found = [const { None }; N];
    // Not checked for doubles: that would compare each attribute with each.
    for attribute in tag.attributes().with_checks(false) {
        let attribute = attribute.map_err(|error| RoadsFault::Syntax(error.to_string()))?;
        if let Some(at) = names.iter().position(|name| *name == attribute.key.into_inner()) {
            let value = attribute.normalized_value(XmlVersion::Implicit1_0);
            let value = value.map_err(|error| RoadsFault::Syntax(error.to_string()))?;
            found[at] = Some(value.into_owned());
        }
    }
    Ok(found)
}

fn number<T: std::str::FromStr>(
    element: &'static str,
    attribute: &'static str,
    value: Option<&String>,
) -> Result<T, RoadsFault> {
    let value = value.ok_or(RoadsFault::Missing { element, attribute })?;
    value.trim().parse().map_err(|_| wrong(attribute, value))
}

fn wrong(attribute: &'static str, value: &str) -> RoadsFault {
    RoadsFault::Value { attribute, value: value.chars().take(40).collect() }
}

/// Whether an element is there: editors keep what is deleted, and say so.
fn is_there(visible: Option<&str>, action: Option<&str>) -> bool {
    visible != Some("false") && action != Some("delete")
}

/// The ways that are roads.
fn ways(text: &str) -> Result<Vec<Way>, RoadsError> {
    let mut ways: Vec<Way> = Vec::new();
    // The way that is open, whether it is there, and what it says of its direction.
    let mut open: Option<(Way, bool, bool, Option<String>)> = None;
    let (mut references, mut is_first) = (0, true);
    each(text, |depth, tag| {
        let Some(tag) = tag else {
            if let Some((way, is_there, is_road, one_way)) = open.take_if(|_| depth == 1) {
                if is_there && is_road && way.nodes.len() > 1 {
                    references += way.nodes.len();
                    let one_way = one_way.as_deref().unwrap_or("no");
                    let back = matches!(one_way, "-1" | "reverse");
                    let forth = matches!(one_way, "yes" | "true" | "1");
                    ways.push(Way { forth: !back, back: !forth, ..way });
                }
                if references > REFERENCES_MAX {
                    return Err(RoadsFault::TooMany);
                }
            }
            return Ok(());
        };
        let name = tag.name().into_inner();
        if std::mem::take(&mut is_first) && name != "osm" {
            return Err(RoadsFault::NotOsm(name.chars().take(40).collect()));
        }
        match (depth, name, &mut open) {
            (1, "way", _) => {
                let [id, visible, action] = values(tag, ["id", "visible", "action"])?;
                let way = Way { id: number("way", "id", id.as_ref())?, ..Way::default() };
                open = Some((way, is_there(visible.as_deref(), action.as_deref()), false, None));
            }
            (2, "nd", Some((way, ..))) => {
                let [reference] = values(tag, ["ref"])?;
                way.nodes.push(number("nd", "ref", reference.as_ref())?);
            }
            (2, "tag", Some((_, _, is_road, one_way))) => match values(tag, ["k", "v"])? {
                [Some(key), _] if key == "highway" => *is_road = true,
                [Some(key), value] if key == "oneway" => *one_way = value,
                [Some(key), Some(value)] if key == "junction" && value == "roundabout" => {
                    one_way.get_or_insert_with(|| "yes".to_owned());
                }
                _ => {}
            },
            _ => {}
        }
        Ok(())
    })?;
    Ok(ways)
}

/// The places of these nodes, by id.
fn nodes(text: &str, ids: &[i64]) -> Result<Vec<(i64, Place)>, RoadsError> {
    let mut places: Vec<Option<Place>> = vec![None; ids.len()];
    each(text, |depth, tag| {
        let Some(tag) = tag.filter(|tag| depth == 1 && tag.name().into_inner() == "node") else {
            return Ok(());
        };
        let [id, latitude, longitude, visible, action] =
            values(tag, ["id", "lat", "lon", "visible", "action"])?;
        let id = number("node", "id", id.as_ref())?;
        let Ok(at) = ids.binary_search(&id) else { return Ok(()) };
        if !is_there(visible.as_deref(), action.as_deref()) {
            return Ok(());
        }
        let place = Place {
            latitude_deg: number("node", "lat", latitude.as_ref())?,
            longitude_deg: number("node", "lon", longitude.as_ref())?,
        };
        if !place.is_valid() {
            return Err(wrong("lat", &latitude.unwrap_or_default()));
        }
        if place.longitude_deg.abs() > 360.0 {
            return Err(wrong("lon", &longitude.unwrap_or_default()));
        }
        if places[at].is_some_and(|known| known != place) {
            return Err(RoadsFault::Twice(id));
        }
        places[at] = Some(place);
        Ok(())
    })?;
    Ok(ids.iter().zip(places).filter_map(|(&id, place)| Some((id, place?))).collect())
}
