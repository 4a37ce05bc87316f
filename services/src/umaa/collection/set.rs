//! The provider's side of a Large Set.

use super::update::{ChangeError, ElementChange, Ticks, Update, end_of, size};
use aldis_envelope::umaa::{LargeCollection, LargeCollectionSize, LargeSetMetadata, SetElement};
use aldis_envelope::{DateTime, Guid};
use std::collections::BTreeMap;

/// A change of a set.
#[derive(Debug, Clone, PartialEq)]
pub enum SetChange<E> {
    /// A new element, or a new value of one that is there.
    Put(Guid, E),
    /// The element leaves the set.
    Remove(Guid),
}

/// Holds a Large Set and says what is to be sent for each update of it.
#[derive(Debug, Clone)]
pub struct SetProvider<C: LargeCollection> {
    elements: BTreeMap<Guid, SetElement<C>>,
    metadata: LargeSetMetadata,
    ticks: Ticks,
}

impl<C: LargeCollection> SetProvider<C> {
    /// An empty set (3.8.3).
    pub fn new(set_id: Guid) -> Self {
        let metadata = LargeSetMetadata {
            set_id,
            update_element_id: Guid::NIL,
            update_element_timestamp: None,
            size: LargeCollectionSize::ZERO,
        };
        Self { elements: BTreeMap::new(), metadata, ticks: Ticks::default() }
    }

    /// A set that its provider's former life has left on the bus, as a reader found it stable. Elements of another set are
    /// left out.
    pub fn recovered(metadata: LargeSetMetadata, elements: impl IntoIterator<Item = SetElement<C>>) -> Self {
        let own = elements.into_iter().filter(|element| element.set_id == metadata.set_id);
        let elements: BTreeMap<_, _> = own.map(|element| (element.element_id, element)).collect();
        let ticks = Ticks::after(elements.values().map(|element| element.element_timestamp).max());
        Self { elements, metadata, ticks }
    }

    /// What the report has to say of the set now.
    pub fn metadata(&self) -> LargeSetMetadata {
        self.metadata
    }

    /// The elements now, by their ids.
    pub fn elements(&self) -> impl ExactSizeIterator<Item = &SetElement<C>> {
        self.elements.values()
    }

    /// Carries out changes as one update; none where they change nothing. An element may change more than once: the last
    /// change counts.
    ///
    /// # Errors
    /// [`ChangeError`] when a change is impossible; then none is carried out.
    pub fn update(
        &mut self,
        now: DateTime,
        changes: impl IntoIterator<Item = SetChange<C::Element>>,
    ) -> Result<Option<Update<SetElement<C>, LargeSetMetadata>>, ChangeError> {
        let wanted = self.wanted(changes)?;
        let added = wanted.iter().filter(|(id, value)| value.is_some() && !self.elements.contains_key(id));
        let removed = wanted.values().filter(|value| value.is_none()).count();
        let size = size(self.elements.len() + added.count() - removed)?;
        if wanted.is_empty() {
            return Ok(None);
        }

        let (put, disposed): (Vec<_>, Vec<_>) = wanted.into_iter().partition(|(_, value)| value.is_some());
        let mut changes = Vec::with_capacity(put.len() + disposed.len());
        for (id, _) in disposed {
            self.elements.remove(&id);
            changes.push(ElementChange::Dispose(id));
        }
        // Without a new element the update would end with a disposal: one that stays is put again.
        let first = self.elements.first_key_value().map(|(id, first)| (*id, Some(first.element.clone())));
        let again = first.filter(|_| put.is_empty());
        for (element_id, element) in put.into_iter().chain(again) {
            let Some(element) = element else { continue };
            let element_timestamp = self.ticks.next(now);
            let sample = SetElement { element, set_id: self.metadata.set_id, element_id, element_timestamp };
            self.elements.insert(element_id, sample.clone());
            changes.push(ElementChange::Put(sample));
        }
        let end = end_of(&changes, |sample: &SetElement<C>| (sample.element_id, sample.element_timestamp));
        (self.metadata.update_element_id, self.metadata.update_element_timestamp) = end;
        self.metadata.size = size;
        let time_stamp = self.ticks.next(now);
        Ok(Some(Update { elements: changes, metadata: self.metadata, time_stamp }))
    }

    /// What each element that changes is to be: a new value, or nothing where it is there and goes.
    fn wanted(
        &self,
        changes: impl IntoIterator<Item = SetChange<C::Element>>,
    ) -> Result<BTreeMap<Guid, Option<C::Element>>, ChangeError> {
        let mut wanted = BTreeMap::new();
        for change in changes {
            match change {
                SetChange::Put(Guid::NIL, _) => return Err(ChangeError::Nil),
                SetChange::Put(id, element) => {
                    wanted.insert(id, Some(element));
                }
                SetChange::Remove(id) => {
                    let there = self.elements.contains_key(&id);
                    let new = matches!(wanted.get(&id), Some(Some(_)));
                    match (there, new) {
                        (true, _) if wanted.get(&id) != Some(&None) => wanted.insert(id, None),
                        (false, true) => wanted.remove(&id),
                        _ => return Err(ChangeError::Missing(id)),
                    };
                }
            }
        }
        Ok(wanted)
    }
}
