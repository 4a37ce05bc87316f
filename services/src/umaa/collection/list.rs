//! The provider's side of a Large List: a linked list over the elements' samples.

use super::shape::{Damage, Lists, Shape};
use super::update::{ChangeError, ElementChange, Ticks, Update, end_of, size};
use aldis_envelope::umaa::{LargeCollection, LargeCollectionSize, LargeListMetadata, ListElement};
use aldis_envelope::{DateTime, Guid};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// A change of a list. Positions count from 0, in the list as the changes before have left it.
#[derive(Debug, Clone, PartialEq)]
pub enum ListChange<E> {
    /// A new element at a position; the elements from there on move back.
    Insert(usize, Guid, E),
    /// A new element at the end.
    Push(Guid, E),
    /// A new value of an element.
    Replace(Guid, E),
    /// The element moves to a position, counted without it.
    Move(Guid, usize),
    /// The element leaves the list.
    Remove(Guid),
}

/// Holds a Large List and says what is to be sent for each update of it.
#[derive(Debug, Clone)]
pub struct ListProvider<C: LargeCollection> {
    order: Vec<Guid>,
    elements: BTreeMap<Guid, ListElement<C>>,
    metadata: LargeListMetadata,
    ticks: Ticks,
}

impl<C: LargeCollection> ListProvider<C> {
    /// An empty list (3.8.3).
    pub fn new(list_id: Guid) -> Self {
        let metadata = LargeListMetadata {
            list_id,
            update_element_id: Guid::NIL,
            update_element_timestamp: None,
            starting_element_id: Guid::NIL,
            size: LargeCollectionSize::ZERO,
        };
        Self { order: Vec::new(), elements: BTreeMap::new(), metadata, ticks: Ticks::default() }
    }

    /// A list that its provider's former life has left on the bus.
    ///
    /// # Errors
    /// [`Damage`] when the elements do not make up the list that the metadata tells.
    pub fn recovered(
        metadata: LargeListMetadata,
        elements: impl IntoIterator<Item = ListElement<C>>,
    ) -> Result<Self, Damage> {
        let own = elements.into_iter().filter(|element| element.list_id == metadata.list_id);
        let elements: BTreeMap<_, _> = own.map(|element| (element.element_id, Arc::new(element))).collect();
        let order = Lists::<C>::order(&metadata, &elements)?;
        let ticks = Ticks::after(elements.values().map(|element| element.element_timestamp).max());
        let elements =
            elements.into_iter().map(|(id, element)| (id, Arc::unwrap_or_clone(element))).collect();
        Ok(Self { order, elements, metadata, ticks })
    }

    /// What the report has to say of the list now.
    pub fn metadata(&self) -> LargeListMetadata {
        self.metadata
    }

    /// The elements now, in the list's order.
    pub fn elements(&self) -> impl Iterator<Item = &ListElement<C>> {
        self.order.iter().filter_map(|id| self.elements.get(id))
    }

    /// Carries out changes as one update; none where they change nothing. Only elements whose value or successor is another
    /// are sent again.
    ///
    /// # Errors
    /// [`ChangeError`] when a change is impossible; then none is carried out.
    pub fn update(
        &mut self,
        now: DateTime,
        changes: impl IntoIterator<Item = ListChange<C::Element>>,
    ) -> Result<Option<Update<ListElement<C>, LargeListMetadata>>, ChangeError> {
        let Wanted { order, mut values, removed, touched, .. } = self.wanted(changes)?;
        let size = size(order.len())?;

        let gone =
            removed.into_iter().filter(|id| self.elements.contains_key(id) && !values.contains_key(id));
        let mut changes: Vec<_> = gone.map(ElementChange::Dispose).collect();
        let link = |position: usize| (order[position], order.get(position + 1).copied());
        let changed = |(id, next): &(Guid, Option<Guid>)| {
            let old = self.elements.get(id).filter(|_| !values.contains_key(id));
            old.is_none_or(|old| old.next_element_id != *next)
        };
        let positions = (0..order.len()).filter(|position| touched.contains(&order[*position]));
        let mut puts: Vec<_> = positions.map(link).filter(changed).collect();
        // Without a new sample the update would end with a disposal: the first element that stays is put again.
        if puts.is_empty() && !changes.is_empty() && !order.is_empty() {
            puts.push(link(0));
        }
        for (element_id, next_element_id) in puts {
            let old = || self.elements.get(&element_id).map(|old| old.element.clone());
            let element = values.remove(&element_id).or_else(old).ok_or(ChangeError::Missing(element_id))?;
            let (list_id, element_timestamp) = (self.metadata.list_id, self.ticks.next(now));
            let sample = ListElement { element, list_id, element_id, element_timestamp, next_element_id };
            changes.push(ElementChange::Put(sample));
        }
        self.order = order;
        if changes.is_empty() {
            return Ok(None);
        }
        for change in &changes {
            match change {
                ElementChange::Dispose(id) => self.elements.remove(id),
                ElementChange::Put(sample) => self.elements.insert(sample.element_id, sample.clone()),
            };
        }
        let end = end_of(&changes, |sample: &ListElement<C>| (sample.element_id, sample.element_timestamp));
        (self.metadata.update_element_id, self.metadata.update_element_timestamp) = end;
        self.metadata.starting_element_id = self.order.first().copied().unwrap_or(Guid::NIL);
        self.metadata.size = size;
        let time_stamp = self.ticks.next(now);
        Ok(Some(Update { elements: changes, metadata: self.metadata, time_stamp }))
    }

    fn wanted(
        &self,
        changes: impl IntoIterator<Item = ListChange<C::Element>>,
    ) -> Result<Wanted<'_, C>, ChangeError> {
        let (order, values) = (self.order.clone(), BTreeMap::new());
        let (removed, touched) = (BTreeSet::new(), BTreeSet::new());
        let mut wanted = Wanted { old: &self.elements, order, values, removed, touched };
        for change in changes {
            match change {
                ListChange::Insert(at, id, element) => wanted.insert(at, id, element)?,
                ListChange::Push(id, element) => wanted.insert(wanted.order.len(), id, element)?,
                ListChange::Replace(id, element) => wanted.replace(id, element)?,
                ListChange::Move(id, at) => {
                    wanted.take(id)?;
                    wanted.place(at, id)?;
                }
                ListChange::Remove(id) => {
                    wanted.take(id)?;
                    wanted.values.remove(&id);
                    wanted.removed.insert(id);
                }
            }
        }
        Ok(wanted)
    }
}

/// The list as the changes want it.
struct Wanted<'a, C: LargeCollection> {
    old: &'a BTreeMap<Guid, ListElement<C>>,
    order: Vec<Guid>,
    /// The values that are new.
    values: BTreeMap<Guid, C::Element>,
    removed: BTreeSet<Guid>,
    /// Elements whose value or successor has been another in between: no others need to be looked at.
    touched: BTreeSet<Guid>,
}

impl<C: LargeCollection> Wanted<'_, C> {
    fn holds(&self, id: Guid) -> bool {
        self.values.contains_key(&id) || self.old.contains_key(&id) && !self.removed.contains(&id)
    }

    fn insert(&mut self, at: usize, id: Guid, element: C::Element) -> Result<(), ChangeError> {
        if id == Guid::NIL {
            return Err(ChangeError::Nil);
        }
        if self.holds(id) {
            return Err(ChangeError::Exists(id));
        }
        self.place(at, id)?;
        self.values.insert(id, element);
        Ok(())
    }

    fn replace(&mut self, id: Guid, element: C::Element) -> Result<(), ChangeError> {
        if !self.holds(id) {
            return Err(ChangeError::Missing(id));
        }
        self.values.insert(id, element);
        self.touched.insert(id);
        Ok(())
    }

    fn take(&mut self, id: Guid) -> Result<(), ChangeError> {
        let from = self.order.iter().position(|other| *other == id).ok_or(ChangeError::Missing(id))?;
        self.order.remove(from);
        self.touch_before(from);
        Ok(())
    }

    fn touch_before(&mut self, position: usize) {
        self.touched.extend(position.checked_sub(1).map(|before| self.order[before]));
    }

    fn place(&mut self, at: usize, id: Guid) -> Result<(), ChangeError> {
        let length = self.order.len();
        if at > length {
            return Err(ChangeError::Position { at, length });
        }
        self.order.insert(at, id);
        self.touched.insert(id);
        self.touch_before(at);
        Ok(())
    }
}
