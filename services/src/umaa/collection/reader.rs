//! The consumer's side: all large collections of one topic of elements.

use super::assembly::{Assembly, Outcome};
use super::shape::{Damage, Lists, Sets, Shape};
use aldis_envelope::{DateTime, Guid};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A consumer of Large Sets.
pub type SetReader<C> = Reader<Sets<C>>;
/// A consumer of Large Lists.
pub type ListReader<C> = Reader<Lists<C>>;

/// What a consumer wants to be told of (3.8.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tell {
    /// Each element as it comes, and each stable state.
    Elements,
    /// Each stable state alone.
    States,
}

/// What a reader has to say.
#[derive(Debug, Clone, PartialEq)]
pub enum Told<S> {
    /// An element is new or has changed. Part of an update that may not have ended.
    Changed(Guid, Arc<S>),
    /// An element of a collection is gone: the collection, the element.
    Removed(Guid, Guid),
    /// The collection is in a new stable state: [`Reader::stable`] has it.
    Stable(Guid),
    /// The collection is damaged at the end of an update. It may be whole again after a later one.
    Damaged(Guid, Damage),
    /// The collection is gone, together with the report that spoke of it.
    Gone(Guid),
    /// The limit on elements is reached: this element is not held, and its collection not whole.
    Shed(Guid, Guid),
}

/// What a reader holds at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReaderLimits {
    /// Elements of all collections together.
    pub elements: usize,
    /// Collections, those without metadata too.
    pub collections: usize,
}

impl Default for ReaderLimits {
    fn default() -> Self {
        Self { elements: 100_000, collections: 1000 }
    }
}

/// Puts the large collections of one topic of elements together. An element's topic has no source and a disposal no
/// collection, so all collections of the topic come in here.
#[derive(Debug)]
pub struct Reader<S: Shape> {
    tell: Tell,
    limits: ReaderLimits,
    collections: BTreeMap<Guid, Assembly<S>>,
    /// Which collection an element belongs to: a disposal tells its id alone.
    owners: BTreeMap<Guid, Guid>,
    /// Whether the history of elements has been read.
    live: bool,
    told: Vec<Told<S::Sample>>,
}

impl<S: Shape> Reader<S> {
    /// A reader that has heard nothing.
    pub fn new(tell: Tell, limits: ReaderLimits) -> Self {
        let (collections, owners) = (BTreeMap::new(), BTreeMap::new());
        Self { tell, limits, collections, owners, live: false, told: Vec::new() }
    }

    /// A sample of an element, in the order of its topic.
    pub fn element(&mut self, sample: S::Sample) {
        let (collection, (element, _)) = (S::collection_of(&sample), S::stamp_of(&sample));
        match self.owners.get(&element) {
            Some(owner) if *owner != collection => self.dispose(element),
            _ => {}
        }
        if !self.owners.contains_key(&element) && self.is_full(collection) {
            self.told.push(Told::Shed(collection, element));
            return;
        }
        self.owners.insert(element, collection);
        let sample = Arc::new(sample);
        if self.assembly(collection).put(sample.clone()) && self.tell == Tell::Elements {
            self.told.push(Told::Changed(collection, sample));
        }
        self.advance(collection);
    }

    /// The disposal of an element, in the order of its topic.
    pub fn dispose(&mut self, element: Guid) {
        let Some(collection) = self.owners.remove(&element) else { return };
        let Some(assembly) = self.collections.get_mut(&collection) else { return };
        if assembly.remove(element) && self.tell == Tell::Elements {
            self.told.push(Told::Removed(collection, element));
        }
        self.advance(collection);
    }

    /// A report with this timestamp says how a collection is.
    pub fn metadata(&mut self, metadata: S::Metadata, time_stamp: DateTime) {
        let collection = S::end_of(&metadata).collection;
        if !self.collections.contains_key(&collection) && self.collections.len() >= self.limits.collections {
            self.told.push(Told::Shed(collection, Guid::NIL));
            return;
        }
        self.assembly(collection).metadata(metadata, time_stamp);
        self.advance(collection);
    }

    /// The report that spoke of a collection is disposed: the collection is no more.
    pub fn gone(&mut self, collection: Guid) {
        if self.collections.remove(&collection).is_some() {
            self.owners.retain(|_, owner| *owner != collection);
            self.told.push(Told::Gone(collection));
        }
    }

    /// Samples of elements were lost for good: nothing is stable until the topic's history has been read again, oldest first,
    /// and [`Self::caught_up`] says so.
    pub fn gap(&mut self) {
        self.live = false;
        self.collections.values_mut().for_each(Assembly::gap);
    }

    /// The history of elements has been read, and the read was begun after the metadata that is here came. From then on what
    /// is missing is damage; and an update that ended with a disposal, which no history tells, can be seen to have ended.
    pub fn caught_up(&mut self) {
        self.live = true;
        let outcomes = self.collections.iter_mut().map(|(id, assembly)| (*id, assembly.caught_up()));
        for (collection, outcome) in outcomes.collect::<Vec<_>>() {
            outcome.into_iter().for_each(|outcome| self.tell(collection, outcome));
            self.advance(collection);
        }
    }

    /// Whether the history of elements should be read: at first, after a gap, after damage, and where metadata speaks of a
    /// disposal that may have been before the history was read. Then: [`Self::gap`], the samples, [`Self::caught_up`].
    pub fn wants_history(&self) -> bool {
        !self.live || self.collections.values().any(Assembly::wants_history)
    }

    /// Collections with metadata that are in no stable state, each with what is wrong with it where that is known. One that
    /// stays here for long is damaged, even if nobody could say so for certain.
    pub fn unsettled(&self) -> impl Iterator<Item = (Guid, Option<Damage>)> + '_ {
        self.collections.iter().filter_map(|(id, assembly)| Some((*id, assembly.unsettled()?)))
    }

    /// Takes what there is to say.
    pub fn told(&mut self) -> impl Iterator<Item = Told<S::Sample>> + '_ {
        self.told.drain(..)
    }

    /// The latest stable state of a collection, a list in its order and a set by its ids; none where there is none.
    pub fn stable(&self, collection: Guid) -> Option<impl ExactSizeIterator<Item = &Arc<S::Sample>>> {
        self.collections.get(&collection)?.stable()
    }

    fn is_full(&self, collection: Guid) -> bool {
        let new = !self.collections.contains_key(&collection);
        self.owners.len() >= self.limits.elements || new && self.collections.len() >= self.limits.collections
    }

    fn assembly(&mut self, collection: Guid) -> &mut Assembly<S> {
        self.collections.entry(collection).or_insert_with(|| Assembly::new(self.live))
    }

    fn advance(&mut self, collection: Guid) {
        while let Some(outcome) = self.collections.get_mut(&collection).and_then(Assembly::advance) {
            self.tell(collection, outcome);
        }
        // A collection of which nothing is known any longer leaves no trace.
        if self.collections.get(&collection).is_some_and(Assembly::is_forgotten) {
            self.collections.remove(&collection);
        }
    }

    fn tell(&mut self, collection: Guid, outcome: Outcome) {
        if let Outcome::Damaged(damage) = outcome {
            self.told.push(Told::Damaged(collection, damage));
            return;
        }
        for element in self.collections.get_mut(&collection).map(Assembly::gone).unwrap_or_default() {
            self.owners.remove(&element);
            if self.tell == Tell::Elements {
                self.told.push(Told::Removed(collection, element));
            }
        }
        self.told.push(Told::Stable(collection));
    }
}
