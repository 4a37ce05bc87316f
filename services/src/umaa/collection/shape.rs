//! What sets and lists have in common, and where they differ.

use aldis_envelope::umaa::{
    LargeCollection, LargeCollectionSize, LargeListMetadata, LargeSetMetadata, ListElement, SetElement,
};
use aldis_envelope::{DateTime, Guid};
use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;
use std::sync::Arc;

/// The elements of a collection by their ids.
pub(super) type Elements<S> = BTreeMap<Guid, Arc<<S as Shape>::Sample>>;

/// A kind of large collection: [`Sets`] or [`Lists`].
pub trait Shape: fmt::Debug + Sized {
    /// The sample of an element.
    type Sample: Clone + PartialEq + fmt::Debug;
    /// What a report says of the collection.
    type Metadata: Copy + PartialEq + fmt::Debug;

    /// The collection that an element belongs to.
    fn collection_of(sample: &Self::Sample) -> Guid;

    /// The element's id and timestamp.
    fn stamp_of(sample: &Self::Sample) -> (Guid, DateTime);

    /// The element after it; none where there is none, or no order.
    fn next_of(sample: &Self::Sample) -> Option<Guid>;

    /// How an update ends.
    fn end_of(metadata: &Self::Metadata) -> UpdateEnd;

    /// Where the collection starts; none where there is no order.
    fn start_of(metadata: &Self::Metadata) -> Option<Guid>;

    /// The order of the elements, where the collection is whole.
    ///
    /// # Errors
    /// [`Damage`] where elements are missing or too many, or where a list's links are broken.
    fn order(
        metadata: &Self::Metadata,
        elements: &BTreeMap<Guid, Arc<Self::Sample>>,
    ) -> Result<Vec<Guid>, Damage>;
}

/// What metadata says of the end of an update, in sets and lists alike (tables 4 and 6).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UpdateEnd {
    /// The collection.
    pub collection: Guid,
    /// The element whose reception ends the update.
    pub element: Guid,
    /// Its timestamp; none where it is disposed.
    pub timestamp: Option<DateTime>,
    /// How many elements there are then.
    pub size: LargeCollectionSize,
}

/// What is wrong with a collection at the end of an update.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Damage {
    /// There are not as many elements as the metadata says.
    #[error("{found} elements where the metadata says {expected}")]
    Size {
        /// How many the metadata says.
        expected: usize,
        /// How many there are.
        found: usize,
    },
    /// A link of the list, or its start, leads to an element that is not there.
    #[error("the list leads to {0}, which is not there")]
    Missing(Guid),
    /// A link of the list leads back to an element before it.
    #[error("the list leads back to {0}")]
    Loop(Guid),
    /// The list ends before it has come to all elements.
    #[error("the list ends after {reached} of {found} elements")]
    Unreached {
        /// How many elements it comes to.
        reached: usize,
        /// How many there are.
        found: usize,
    },
}

/// The shape of Large Sets with elements of one attribute.
pub struct Sets<C>(PhantomData<fn() -> C>);

/// The shape of Large Lists with elements of one attribute.
pub struct Lists<C>(PhantomData<fn() -> C>);

impl<C> fmt::Debug for Sets<C> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Sets")
    }
}

impl<C> fmt::Debug for Lists<C> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Lists")
    }
}

impl<C: LargeCollection> Shape for Sets<C> {
    type Sample = SetElement<C>;
    type Metadata = LargeSetMetadata;

    fn collection_of(sample: &SetElement<C>) -> Guid {
        sample.set_id
    }

    fn stamp_of(sample: &SetElement<C>) -> (Guid, DateTime) {
        (sample.element_id, sample.element_timestamp)
    }

    fn next_of(_: &SetElement<C>) -> Option<Guid> {
        None
    }

    fn start_of(_: &LargeSetMetadata) -> Option<Guid> {
        None
    }

    fn end_of(metadata: &LargeSetMetadata) -> UpdateEnd {
        UpdateEnd {
            collection: metadata.set_id,
            element: metadata.update_element_id,
            timestamp: metadata.update_element_timestamp,
            size: metadata.size,
        }
    }

    fn order(
        metadata: &LargeSetMetadata,
        elements: &BTreeMap<Guid, Arc<SetElement<C>>>,
    ) -> Result<Vec<Guid>, Damage> {
        right_size(metadata.size, elements.len())?;
        Ok(elements.keys().copied().collect())
    }
}

impl<C: LargeCollection> Shape for Lists<C> {
    type Sample = ListElement<C>;
    type Metadata = LargeListMetadata;

    fn collection_of(sample: &ListElement<C>) -> Guid {
        sample.list_id
    }

    fn stamp_of(sample: &ListElement<C>) -> (Guid, DateTime) {
        (sample.element_id, sample.element_timestamp)
    }

    fn next_of(sample: &ListElement<C>) -> Option<Guid> {
        sample.next_element_id
    }

    fn start_of(metadata: &LargeListMetadata) -> Option<Guid> {
        Some(metadata.starting_element_id)
    }

    fn end_of(metadata: &LargeListMetadata) -> UpdateEnd {
        UpdateEnd {
            collection: metadata.list_id,
            element: metadata.update_element_id,
            timestamp: metadata.update_element_timestamp,
            size: metadata.size,
        }
    }

    /// Follows the links from the first element on (table 7). They are looked at before the size, because they say more.
    fn order(
        metadata: &LargeListMetadata,
        elements: &BTreeMap<Guid, Arc<ListElement<C>>>,
    ) -> Result<Vec<Guid>, Damage> {
        let mut order = Vec::with_capacity(elements.len());
        // An empty list has no first element, whatever the metadata names.
        let mut next = (metadata.size.get() > 0).then_some(metadata.starting_element_id);
        while let Some(id) = next {
            let element = elements.get(&id).ok_or(Damage::Missing(id))?;
            if order.len() == elements.len() {
                return Err(Damage::Loop(id));
            }
            order.push(id);
            next = element.next_element_id;
        }
        right_size(metadata.size, elements.len())?;
        let (reached, found) = (order.len(), elements.len());
        if reached == found { Ok(order) } else { Err(Damage::Unreached { reached, found }) }
    }
}

fn right_size(expected: LargeCollectionSize, found: usize) -> Result<(), Damage> {
    let expected = expected.get();
    if expected == found { Ok(()) } else { Err(Damage::Size { expected, found }) }
}
