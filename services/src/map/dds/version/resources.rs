//! The configuration's resources: a sequence in 5.2.1, a large set in 6.0 (ICD 3.8; umaa-so, Version 6.0).
//!
//! Sets and elements get ids that follow from source and resource, so that a restart and a second gateway give the same ones.

use super::convert::{guid_of, member};
use super::health::due;
use super::{Lost, Sample, Translator};
use aldis_envelope::codec::cdr::Value;
use aldis_envelope::umaa::v6_0::RESOURCES_ELEMENT;
use aldis_envelope::{Change, Guid, KeyHash};
use std::collections::BTreeMap;

pub(super) const CONFIG: &str = "UMAA::SO::ResourceAllocation::ResourceAllocationConfigReport";
const REPORT: &str = "UMAA::SO::ResourceAllocation::ResourceAllocationConfigReportType";
const DEFINITION: &str = "UMAA::SO::ResourceAllocation::ResourceAllocationDefinitionType";

/// How many sets are followed, and how many elements of each: 5.2.1 has room for 256.
const SETS_MAX: usize = 1_024;
const ELEMENTS_MAX: usize = 1_024;

/// What the bus was told of a configuration of the fleet.
#[derive(Debug, Default)]
pub(super) struct Said {
    /// Definitions in the words of 6.0, by their elements.
    elements: BTreeMap<Guid, Value>,
    /// The element that ended the last update, and its timestamp where it was not disposed.
    update: (Guid, Option<Value>),
}

/// What the bus has told of its configurations.
#[derive(Debug, Default)]
pub(super) struct Heard {
    sets: BTreeMap<Guid, Set>,
}

#[derive(Debug, Default)]
struct Set {
    /// Definitions with their timestamps, in the words of 6.0.
    elements: BTreeMap<Guid, (Value, Value)>,
    report: Option<Value>,
    /// The report that was last made of it.
    made: Option<Value>,
}

fn octets(guid: Guid) -> Option<Value> {
    Some(Value::Octets(guid.0.to_vec()))
}

/// A name-based GUID of parts (RFC 9562, 5.3 and 5.8: our own digest, so version 8).
fn derived(parts: [Guid; 2]) -> Guid {
    let KeyHash(mut digest) = KeyHash::md5(&[b"aldis/resources", &parts[0].0, &parts[1].0]);
    digest[6] = digest[6] & 0x0f | 0x80;
    digest[8] = digest[8] & 0x3f | 0x80;
    Guid(digest)
}

impl Translator {
    pub(super) fn config_to_newer(&mut self, sample: &Sample) -> Result<Vec<Sample>, Lost> {
        let of = |name| member(&self.older, REPORT, &sample.value, name);
        let source = guid_of(of("source")).ok_or_else(|| due(CONFIG, "source"))?;
        let set = derived([source, Guid::NIL]);
        let identifier = self.identifier_of(&sample.value, source)?;
        if sample.change != Change::Put {
            return Ok(self.config_ends(sample.change, source, set, identifier));
        }
        let stamp = of("timeStamp").cloned().ok_or_else(|| due(CONFIG, "timeStamp"))?;
        let Some(Value::List(resources)) = of("resources") else { return Err(due(CONFIG, "resources")) };
        let mut wanted = BTreeMap::new();
        for resource in resources {
            let id = guid_of(member(&self.older, DEFINITION, resource, "resourceID"))
                .ok_or_else(|| due(CONFIG, "resourceID"))?;
            let newer = self.converted_value(CONFIG, DEFINITION, resource, false, true)?;
            wanted.insert(derived([source, id]), newer);
        }
        let said = self.said.entry(source).or_default();
        let gone = said.elements.keys().filter(|id| !wanted.contains_key(id)).copied().collect::<Vec<_>>();
        let changed = wanted.iter().filter(|(id, held)| said.elements.get(id) != Some(held));
        let mut samples: Vec<_> = gone.iter().map(|id| element_ends(Change::Dispose, set, *id)).collect();
        // An update ends with an element that is there, if any is: then its timestamp tells one update from the next.
        if let Some(last) = gone.last() {
            said.update = (*last, None);
        }
        for (id, held) in changed {
            said.update = (*id, Some(stamp.clone()));
            let value =
                Value::Structure(vec![Some(held.clone()), octets(set), octets(*id), Some(stamp.clone())]);
            samples.push(Sample { topic: RESOURCES_ELEMENT.to_owned(), change: Change::Put, value });
        }
        let size = Value::Signed(wanted.len() as i64);
        let (update, at) = said.update.clone();
        said.elements = wanted;
        let metadata = Value::Structure(vec![octets(set), octets(update), at, Some(size)]);
        let value = Value::Structure(vec![Some(stamp), Some(identifier), Some(metadata)]);
        samples.push(Sample { topic: REPORT.to_owned(), change: Change::Put, value });
        Ok(samples)
    }

    /// The source of a report as an identifier.
    fn identifier_of(&mut self, report: &Value, source: Guid) -> Result<Value, Lost> {
        let newer = self.converted_value(CONFIG, REPORT, report, true, true)?;
        member(&self.newer, REPORT, &newer, "source").cloned().ok_or_else(|| due(CONFIG, &source.to_string()))
    }

    /// The report ends, and then each of its elements.
    fn config_ends(&mut self, change: Change, source: Guid, set: Guid, identifier: Value) -> Vec<Sample> {
        let value = Value::Structure(vec![None, Some(identifier), None]);
        let report = Sample { topic: REPORT.to_owned(), change, value };
        let elements = self.said.remove(&source).unwrap_or_default().elements;
        let elements = elements.into_keys().map(|id| element_ends(change, set, id));
        [report].into_iter().chain(elements).collect()
    }

    pub(super) fn element_to_older(&mut self, sample: &Sample) -> Result<Vec<Sample>, Lost> {
        let of = |name| member(&self.newer, RESOURCES_ELEMENT, &sample.value, name);
        let guid = |name| guid_of(of(name)).ok_or_else(|| due(RESOURCES_ELEMENT, name));
        let (set, id) = (guid("setID")?, guid("elementID")?);
        let held = of("element").cloned().zip(of("elementTimestamp").cloned());
        let elements = &mut self.heard.set(set).elements;
        match (sample.change, held) {
            (Change::Put, Some(held)) => {
                if elements.len() >= ELEMENTS_MAX && !elements.contains_key(&id) {
                    let (topic, member) = (CONFIG.to_owned(), "resources".to_owned());
                    return Err(Lost::TooLong { topic, member, length: elements.len() + 1, bound: 256 });
                }
                elements.insert(id, held);
            }
            (Change::Put, None) => return Err(due(RESOURCES_ELEMENT, "element")),
            (Change::Dispose, _) => drop(elements.remove(&id)),
            // Its writer is gone; the element is what it was.
            (Change::Unregister, _) => {}
        }
        self.stable(set)
    }

    pub(super) fn config_to_older(&mut self, sample: &Sample) -> Result<Vec<Sample>, Lost> {
        if sample.change != Change::Put {
            let value = self.converted(sample, REPORT, false)?;
            let source = guid_of(member(&self.newer, REPORT, &sample.value, "source"));
            for set in self.heard.sets.values_mut() {
                let of = set.report.as_ref().and_then(|report| member(&self.newer, REPORT, report, "source"));
                if sample.change == Change::Dispose && guid_of(of) == source {
                    (set.report, set.made) = (None, None);
                }
            }
            return Ok(vec![Sample { topic: CONFIG.to_owned(), change: sample.change, value }]);
        }
        let metadata = member(&self.newer, REPORT, &sample.value, "resourcesSetMetadata");
        let set = metadata.and_then(|metadata| match metadata {
            Value::Structure(members) => guid_of(members.first()?.as_ref()),
            _ => None,
        });
        let set = set.ok_or_else(|| due(REPORT, "setID"))?;
        self.heard.set(set).report = Some(sample.value.clone());
        self.stable(set)
    }

    /// The report of a set once all that its metadata tells of is there.
    fn stable(&mut self, id: Guid) -> Result<Vec<Sample>, Lost> {
        let Some(Set { elements, report: Some(report), made }) = self.heard.sets.get(&id) else {
            return Ok(Vec::new());
        };
        let metadata = member(&self.newer, REPORT, report, "resourcesSetMetadata");
        let Some(Value::Structure(metadata)) = metadata else { return Ok(Vec::new()) };
        let [_, update, at, Some(Value::Signed(size))] = metadata.as_slice() else { return Ok(Vec::new()) };
        let update = guid_of(update.as_ref()).unwrap_or(Guid::NIL);
        let ended = match at {
            Some(at) => elements.get(&update).is_some_and(|(_, stamp)| stamp == at),
            None => !elements.contains_key(&update),
        };
        if !ended || *size != elements.len() as i64 {
            return Ok(Vec::new());
        }
        let stamp = member(&self.newer, REPORT, report, "timeStamp").cloned();
        let source = guid_of(member(&self.newer, REPORT, report, "source"));
        let (held, made) =
            (elements.values().map(|(held, _)| held.clone()).collect::<Vec<_>>(), made.clone());
        if held.len() > 256 {
            let (topic, member) = (CONFIG.to_owned(), "resources".to_owned());
            return Err(Lost::TooLong { topic, member, length: held.len(), bound: 256 });
        }
        let resources = held.iter().map(|held| self.converted_value(REPORT, DEFINITION, held, false, false));
        let resources = resources.collect::<Result<Vec<_>, _>>()?;
        let value = Value::Structure(vec![Some(Value::List(resources)), stamp, source.and_then(octets)]);
        if made.as_ref() == Some(&value) {
            return Ok(Vec::new());
        }
        self.heard.set(id).made = Some(value.clone());
        Ok(vec![Sample { topic: CONFIG.to_owned(), change: Change::Put, value }])
    }
}

impl Heard {
    fn set(&mut self, id: Guid) -> &mut Set {
        if self.sets.len() >= SETS_MAX && !self.sets.contains_key(&id) {
            self.sets.pop_first();
        }
        self.sets.entry(id).or_default()
    }
}

fn element_ends(change: Change, set: Guid, id: Guid) -> Sample {
    let value = Value::Structure(vec![None, octets(set), octets(id), None]);
    Sample { topic: RESOURCES_ELEMENT.to_owned(), change, value }
}
