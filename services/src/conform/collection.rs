//! Large Sets and Large Lists (ICD 3.8) as they can be judged from outside: what metadata says against what comes.

use super::ledger::{Debt, Ledger};
use super::sample::{Sample, time};
use super::{Clause, FOLLOWED_MAX};
use aldis_envelope::Guid;
use serde_json::Value;
use std::collections::{BTreeMap, VecDeque};

/// How many samples of a collection are remembered while no metadata comes; beyond it the collection is judged no more until
/// metadata points at what follows.
const EVENTS_MAX: usize = 20_000;
/// How much metadata waits for its elements.
const AWAITED_MAX: usize = 64;

/// Whether a topic is one of elements, by its name (3.8).
pub(super) fn is_element(topic: &str) -> bool {
    topic.ends_with("SetElement") || topic.ends_with("ListElement")
}

/// An element and its timestamp; none where it is disposed.
type Mark = (Guid, Option<(i64, i64)>);

/// What metadata says.
#[derive(Debug, Clone, PartialEq)]
struct Metadata {
    collection: Guid,
    end: Mark,
    size: usize,
    /// Where a list starts.
    start: Option<Guid>,
}

impl Metadata {
    fn read(value: &Value) -> Option<Self> {
        let sample = Sample::new(value.clone());
        let (collection, start) = match sample.guid("setID") {
            Some(set) => (set, None),
            None => (sample.guid("listID")?, Some(sample.guid("startingElementID")?)),
        };
        let end = (sample.guid("updateElementID")?, time(&value["updateElementTimestamp"]));
        Some(Self { collection, end, size: value["size"].as_u64()? as usize, start })
    }
}

/// What a sample of the elements' topic did.
#[derive(Debug)]
struct Event {
    mark: Mark,
    next: Option<Guid>,
}

#[derive(Debug, Default)]
struct Collection {
    /// The elements and their successors, up to what was judged last.
    elements: BTreeMap<Guid, Option<Guid>>,
    events: VecDeque<Event>,
    last: Option<Mark>,
    awaited: VecDeque<Metadata>,
    latest: Option<Metadata>,
    /// Some of it is history, which leaves out what was overwritten: it is judged once an update has followed.
    partial: bool,
}

/// All large collections that were seen.
#[derive(Debug, Default)]
pub(super) struct Collections {
    known: BTreeMap<Guid, Collection>,
    owners: BTreeMap<Guid, Guid>,
}

impl Collections {
    /// A sample of an element.
    pub(super) fn element(&mut self, sample: &Sample, retained: bool, ledger: &mut Ledger) {
        let collection = sample.guid("setID").or_else(|| sample.guid("listID"));
        let (Some(collection), Some(element)) = (collection, sample.guid("elementID")) else { return };
        if self.owners.len() >= FOLLOWED_MAX && !self.owners.contains_key(&element) {
            ledger.unfollowed();
            return;
        }
        let owner = *self.owners.entry(element).or_insert(collection);
        ledger.judge(Clause::ElementId, owner == collection, || {
            format!("element {element} of {collection} is one of {owner} too")
        });
        if owner != collection {
            return;
        }
        let known = self.known.entry(collection).or_default();
        known.partial |= retained;
        let event =
            Event { mark: (element, sample.time("elementTimestamp")), next: sample.guid("nextElementID") };
        known.event(event, ledger);
    }

    /// An element is disposed.
    pub(super) fn element_disposed(&mut self, key: &Sample, ledger: &mut Ledger) {
        let Some(element) = key.guid("elementID") else { return };
        let Some(collection) = self.owners.remove(&element) else { return };
        if let Some(known) = self.known.get_mut(&collection) {
            known.event(Event { mark: (element, None), next: None }, ledger);
        }
    }

    /// A report, which may hold the metadata of collections in any of its members.
    pub(super) fn report(&mut self, sample: &Sample, retained: bool, ledger: &mut Ledger) {
        let members = sample.value().as_object().into_iter().flatten();
        for metadata in members.filter_map(|(_, value)| Metadata::read(value)) {
            let nil = metadata.end.0 == Guid::NIL;
            let sound = !nil || metadata.size == 0 && metadata.end.1.is_none();
            ledger.judge(Clause::EmptyCollection, sound, || {
                format!("{} names the nil element with {} elements", metadata.collection, metadata.size)
            });
            if self.known.len() >= FOLLOWED_MAX && !self.known.contains_key(&metadata.collection) {
                ledger.unfollowed();
                continue;
            }
            let known = self.known.entry(metadata.collection).or_default();
            known.partial |= retained;
            if sound {
                known.metadata(metadata, ledger);
            }
        }
    }
}

fn debt(metadata: &Metadata) -> Debt {
    (Clause::UpdateEnd, String::new(), metadata.collection, metadata.end.0)
}

impl Collection {
    fn event(&mut self, event: Event, ledger: &mut Ledger) {
        let mark = event.mark;
        self.events.push_back(event);
        if self.events.len() > EVENTS_MAX {
            self.carry_out(EVENTS_MAX / 2);
        }
        if let Some(index) = self.awaited.iter().position(|metadata| metadata.end == mark) {
            let Some(metadata) = self.awaited.drain(..=index).next_back() else { return };
            self.judge(metadata, self.events.len(), ledger);
        }
    }

    fn metadata(&mut self, metadata: Metadata, ledger: &mut Ledger) {
        if self.latest.as_ref() == Some(&metadata) {
            return;
        }
        self.latest = Some(metadata.clone());
        let at = self.events.iter().rposition(|event| event.mark == metadata.end).map(|index| index + 1);
        let now = || (self.last == Some(metadata.end) || metadata.end.0 == Guid::NIL).then_some(0);
        if let Some(events) = at.or_else(now) {
            self.judge(metadata, events, ledger);
        } else if !self.partial || metadata.end.1.is_some() {
            let text = format!("{}: element {} does not come", metadata.collection, metadata.end.0);
            ledger.owe(debt(&metadata), ledger.bounds.follow, text);
            self.awaited.push_back(metadata);
            if self.awaited.len() > AWAITED_MAX {
                self.awaited.pop_front();
            }
        }
    }

    /// Looks at the collection after so many events.
    fn judge(&mut self, metadata: Metadata, events: usize, ledger: &mut Ledger) {
        ledger.pay(&debt(&metadata));
        let followed = self.last.is_some();
        self.carry_out(events);
        self.last = Some(metadata.end);
        // The first state that is met may be a part of what was, where it comes from history.
        if self.partial && !followed {
            return;
        }
        let (found, wanted, collection) = (self.elements.len(), metadata.size, metadata.collection);
        ledger.judge(Clause::CollectionSize, found == wanted, || {
            format!("{collection} has {found} elements, its metadata says {wanted}")
        });
        if let Some(start) = metadata.start.filter(|_| wanted > 0 && found == wanted) {
            let reached = self.reached(start);
            ledger.judge(Clause::ListOrder, reached == Some(found), || match reached {
                Some(reached) => format!("the links of {collection} lead over {reached} of {found} elements"),
                None => {
                    format!("the links of {collection} lead to an element that is not there, or in a circle")
                }
            });
        }
    }

    /// How many elements the links lead over; none where they leave the list or do not end.
    fn reached(&self, start: Guid) -> Option<usize> {
        let (mut reached, mut next) = (0, Some(start));
        while let Some(element) = next {
            next = *self.elements.get(&element)?;
            reached += 1;
            if reached > self.elements.len() {
                return None;
            }
        }
        Some(reached)
    }

    fn carry_out(&mut self, events: usize) {
        for Event { mark: (element, timestamp), next } in self.events.drain(..events) {
            match timestamp {
                Some(_) => self.elements.insert(element, next),
                None => self.elements.remove(&element),
            };
        }
    }
}
