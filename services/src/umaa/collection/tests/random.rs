//! Random updates, delivered in random ways, against a plain map and a plain vector.

use super::super::*;
use super::model::{Item, Items, at, id};
use aldis_envelope::umaa::{LargeListMetadata, LargeSetMetadata, ListElement, SetElement};
use aldis_envelope::{DateTime, Guid};
use proptest::collection::vec;
use proptest::prelude::*;
use std::collections::BTreeMap;

/// A collection's elements in order.
type State = Vec<(Guid, Item)>;
type UpdateOf<S> = Update<<S as Shape>::Sample, <S as Shape>::Metadata>;

/// What a provider has sent in all, and the states that it meant. The first update is that of the empty collection.
struct Sent<S: Shape> {
    updates: Vec<UpdateOf<S>>,
    states: Vec<State>,
    value: fn(&S::Sample) -> (Guid, Item),
}

impl<S: Shape> Sent<S> {
    /// The topic of the elements, and how many of its samples were sent when each update's metadata followed.
    fn elements(&self) -> (Vec<ElementChange<S::Sample>>, Vec<usize>) {
        let (mut all, mut ends) = (Vec::new(), Vec::new());
        for update in &self.updates {
            all.extend(update.elements.iter().cloned());
            ends.push(all.len());
        }
        (all, ends)
    }

    /// The history of the elements' topic after so many samples: the latest sample of each element that is there.
    fn history(&self, sent: usize) -> Vec<S::Sample> {
        let (all, _) = self.elements();
        let mut latest = BTreeMap::new();
        for (position, change) in all.into_iter().take(sent).enumerate() {
            match change {
                ElementChange::Put(sample) => latest.insert((self.value)(&sample).0, (position, sample)),
                ElementChange::Dispose(id) => latest.remove(&id),
            };
        }
        let mut samples: Vec<_> = latest.into_values().collect();
        samples.sort_by_key(|(position, _)| *position);
        samples.into_iter().map(|(_, sample)| sample).collect()
    }
}

/// A consumer under test, and what it has been told so far.
struct Consumer<'a, S: Shape> {
    sent: &'a Sent<S>,
    reader: Reader<S>,
    /// The state that was told last.
    at: usize,
    elements: BTreeMap<Guid, Item>,
}

impl<'a, S: Shape> Consumer<'a, S> {
    fn new(sent: &'a Sent<S>) -> Self {
        let reader = Reader::new(Tell::Elements, ReaderLimits::default());
        Self { sent, reader, at: 0, elements: BTreeMap::new() }
    }

    fn element(&mut self, change: ElementChange<S::Sample>) -> Result<(), TestCaseError> {
        match change {
            ElementChange::Put(sample) => self.reader.element(sample),
            ElementChange::Dispose(id) => self.reader.dispose(id),
        }
        self.check()
    }

    fn metadata(&mut self, update: usize) -> Result<(), TestCaseError> {
        let Update { metadata, time_stamp, .. } = &self.sent.updates[update];
        self.reader.metadata(*metadata, *time_stamp);
        self.check()
    }

    fn history(&mut self, sent: usize) -> Result<(), TestCaseError> {
        for sample in self.sent.history(sent) {
            self.element(ElementChange::Put(sample))?;
        }
        self.reader.caught_up();
        self.check()
    }

    /// Reads the history of now: it holds whatever published metadata speaks of. How many samples were sent by then.
    fn read_again(&mut self, sent: usize, published: &[usize]) -> Result<usize, TestCaseError> {
        let sent = sent.max(published.last().copied().unwrap_or_default());
        self.reader.gap();
        self.history(sent)?;
        Ok(sent)
    }

    fn stable(&self) -> Option<State> {
        Some(self.reader.stable(id(100))?.map(|sample| (self.sent.value)(sample)).collect())
    }

    /// What is told is a state that the provider meant, none older than the one before.
    fn check(&mut self) -> Result<(), TestCaseError> {
        for told in self.reader.told().collect::<Vec<_>>() {
            match told {
                Told::Changed(_, sample) => {
                    let (id, item) = (self.sent.value)(&sample);
                    self.elements.insert(id, item);
                }
                Told::Removed(_, element) => {
                    self.elements.remove(&element);
                }
                Told::Stable(_) => {
                    let later = self.stable();
                    // Between two events there may be more than one stable state: then only the last can be looked at.
                    if let Some(state) = later {
                        let found = self.sent.states[self.at..].iter().position(|meant| *meant == state);
                        prop_assert!(
                            found.is_some(),
                            "{state:?} is none of {:?}",
                            &self.sent.states[self.at..]
                        );
                        self.at += found.unwrap_or_default();
                    }
                }
                other => prop_assert!(false, "{other:?}"),
            }
        }
        Ok(())
    }

    fn finish(&self) -> Result<(), TestCaseError> {
        let last = self.sent.states.last().cloned().unwrap_or_default();
        prop_assert_eq!(self.stable(), Some(last.clone()));
        prop_assert_eq!(&self.elements, &last.into_iter().collect::<BTreeMap<_, _>>());
        Ok(())
    }
}

/// Makes updates those of a provider that ends an update with a disposal where it can: the element that was put again is not.
fn end_with_disposals<S: Shape>(
    updates: &mut [UpdateOf<S>],
    end_with: fn(&mut S::Metadata, Guid),
    aged: fn(S::Sample, DateTime) -> S::Sample,
) {
    let mut before: BTreeMap<Guid, S::Sample> = BTreeMap::new();
    for update in updates {
        if let [.., ElementChange::Dispose(gone), ElementChange::Put(last)] = &update.elements[..] {
            let (id, timestamp) = S::stamp_of(last);
            if before.get(&id).is_some_and(|old| aged(old.clone(), timestamp) == *last) {
                end_with(&mut update.metadata, *gone);
                update.elements.pop();
            }
        }
        for change in &update.elements {
            match change {
                ElementChange::Put(sample) => before.insert(S::stamp_of(sample).0, sample.clone()),
                ElementChange::Dispose(id) => before.remove(id),
            };
        }
    }
}

/// How samples travel.
#[derive(Debug, Clone)]
struct Travel {
    /// Whether metadata may come before its elements.
    early: bool,
    /// Which topic goes on next.
    turns: Vec<bool>,
    /// Which metadata comes again, or is overtaken by the next and never comes.
    repeated: Vec<bool>,
    overtaken: Vec<bool>,
    /// When the consumer joins, and where it misses samples: parts of the elements' topic, from 0 to 255.
    joins: Option<u8>,
    gap: Option<(u8, u8)>,
}

fn travel(early: bool) -> impl Strategy<Value = Travel> {
    let bits = || vec(any::<bool>(), 1..40);
    let (joins, gap) = (proptest::option::of(any::<u8>()), proptest::option::of(any::<(u8, u8)>()));
    (bits(), bits(), bits(), joins, gap).prop_map(move |(turns, repeated, overtaken, joins, gap)| Travel {
        early,
        turns,
        repeated,
        overtaken,
        joins,
        gap,
    })
}

fn deliver<S: Shape>(sent: &Sent<S>, travel: &Travel) -> Result<(), TestCaseError> {
    let (elements, ends) = sent.elements();
    let part = |of: u8| elements.len() * usize::from(of) / 255;
    let mut consumer = Consumer::new(sent);
    let (mut element, mut update) = (0, 0);
    if let Some(joins) = travel.joins {
        element = part(joins);
        // What was published before the history was asked for is there first.
        update = ends.iter().filter(|end| **end <= element).count();
        consumer.metadata(update - 1)?;
        consumer.history(element)?;
    } else {
        consumer.reader.caught_up();
    }
    let mut gap = travel.gap.map(|(from, length)| (part(from), part(length)));
    let mut turn = 0;
    while element < elements.len() || update < ends.len() {
        if let Some((from, length)) = gap
            && element >= from
        {
            gap = None;
            element = consumer.read_again((element + length).min(elements.len()), &ends[..update])?;
            continue;
        }
        let bit = |bits: &[bool], at: usize| bits[at % bits.len()];
        let too_early = || !travel.early && ends[update] > element;
        if element < elements.len() && (update == ends.len() || bit(&travel.turns, turn) || too_early()) {
            consumer.element(elements[element].clone())?;
            element += 1;
        } else {
            if update + 1 == ends.len() || !bit(&travel.overtaken, update) {
                consumer.metadata(update)?;
                if bit(&travel.repeated, update) {
                    consumer.metadata(update)?;
                }
            }
            update += 1;
        }
        turn += 1;
    }
    if consumer.reader.wants_history() {
        consumer.read_again(element, &ends)?;
    }
    consumer.finish()
}

/// One change as numbers, to be made sense of in the collection as it is.
type Numbers = (u8, u8, u8);

fn set_of(batches: &[Vec<Numbers>]) -> Sent<Sets<Items>> {
    let mut provider = SetProvider::<Items>::new(id(100));
    let first = Update { elements: Vec::new(), metadata: provider.metadata(), time_stamp: at(0) };
    let (mut updates, mut states) = (vec![first], vec![State::new()]);
    let mut model = BTreeMap::new();
    for (seconds, batch) in batches.iter().enumerate() {
        let mut changes = Vec::new();
        for (kind, element, item) in batch {
            let element = id(1 + element % 6);
            if kind % 3 == 0 && model.remove(&element).is_some() {
                changes.push(SetChange::Remove(element));
            } else {
                model.insert(element, *item);
                changes.push(SetChange::Put(element, *item));
            }
        }
        // The wall clock stands still now and then.
        if let Some(update) = provider.update(at(seconds as i64 / 2), changes).unwrap() {
            updates.push(update);
            states.push(model.clone().into_iter().collect());
        }
    }
    Sent { updates, states, value: |sample: &SetElement<Items>| (sample.element_id, sample.element) }
}

fn list_of(batches: &[Vec<Numbers>]) -> Sent<Lists<Items>> {
    let mut provider = ListProvider::<Items>::new(id(100));
    let first = Update { elements: Vec::new(), metadata: provider.metadata(), time_stamp: at(0) };
    let (mut updates, mut states) = (vec![first], vec![State::new()]);
    let mut model = State::new();
    for (seconds, batch) in batches.iter().enumerate() {
        let changes: Vec<_> = batch.iter().map(|numbers| list_change(&mut model, *numbers)).collect();
        if let Some(update) = provider.update(at(seconds as i64 / 2), changes).unwrap() {
            updates.push(update);
            states.push(model.clone());
        }
    }
    Sent { updates, states, value: |sample: &ListElement<Items>| (sample.element_id, sample.element) }
}

fn list_change(model: &mut State, (kind, number, item): Numbers) -> ListChange<Item> {
    let element = id(1 + number % 6);
    let Some(from) = model.iter().position(|(id, _)| *id == element) else {
        let at = usize::from(kind) % (model.len() + 1);
        model.insert(at, (element, item));
        return if at + 1 == model.len() {
            ListChange::Push(element, item)
        } else {
            ListChange::Insert(at, element, item)
        };
    };
    match kind % 3 {
        0 => {
            model.remove(from);
            ListChange::Remove(element)
        }
        1 => {
            model[from].1 = item;
            ListChange::Replace(element, item)
        }
        _ => {
            let moved = model.remove(from);
            let to = usize::from(item) % (model.len() + 1);
            model.insert(to, moved);
            ListChange::Move(element, to)
        }
    }
}

fn batches() -> impl Strategy<Value = Vec<Vec<Numbers>>> {
    vec(vec(any::<Numbers>(), 1..5), 1..16)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn a_set_is_only_ever_what_its_provider_meant(batches in batches(), travel in travel(true)) {
        deliver(&set_of(&batches), &travel)?;
    }

    #[test]
    fn a_list_is_only_ever_what_its_provider_meant(batches in batches(), travel in travel(true)) {
        deliver(&list_of(&batches), &travel)?;
    }

    #[test]
    fn so_is_a_set_whose_updates_end_with_disposals(batches in batches(), travel in travel(false)) {
        let mut sent = set_of(&batches);
        let end_with = |metadata: &mut LargeSetMetadata, gone| {
            (metadata.update_element_id, metadata.update_element_timestamp) = (gone, None);
        };
        end_with_disposals::<Sets<Items>>(&mut sent.updates, end_with, |sample, element_timestamp| SetElement {
            element_timestamp,
            ..sample
        });
        deliver(&sent, &travel)?;
    }

    #[test]
    fn so_is_a_list_whose_updates_end_with_disposals(batches in batches(), travel in travel(false)) {
        let mut sent = list_of(&batches);
        let end_with = |metadata: &mut LargeListMetadata, gone| {
            (metadata.update_element_id, metadata.update_element_timestamp) = (gone, None);
        };
        end_with_disposals::<Lists<Items>>(&mut sent.updates, end_with, |sample, element_timestamp| ListElement {
            element_timestamp,
            ..sample
        });
        deliver(&sent, &travel)?;
    }

    #[test]
    fn loss_that_nobody_notices_makes_no_list_out_of_pieces(batches in batches(), lost in vec(any::<bool>(), 1..20)) {
        let sent = list_of(&batches);
        let mut reader = Reader::<Lists<Items>>::new(Tell::States, ReaderLimits::default());
        reader.caught_up();
        let mut number = 0;
        for update in &sent.updates {
            for change in &update.elements {
                number += 1;
                match change {
                    _ if lost[number % lost.len()] => {}
                    ElementChange::Put(sample) => reader.element(sample.clone()),
                    ElementChange::Dispose(id) => reader.dispose(*id),
                }
            }
            reader.metadata(update.metadata, update.time_stamp);
            if reader.told().any(|told| matches!(told, Told::Stable(_))) {
                let list: Vec<_> = reader.stable(id(100)).unwrap().collect();
                prop_assert!(list.last().is_none_or(|last| last.next_element_id.is_none()));
                for pair in list.windows(2) {
                    prop_assert_eq!(pair[0].next_element_id, Some(pair[1].element_id));
                }
            }
        }
    }
}
