//! An update of a collection as its provider sends it.

use aldis_envelope::umaa::{LargeCollectionSize, OutOfRange};
use aldis_envelope::{DateTime, Guid};

/// What happens to one element, in the order in which it is to be sent on the topic of the elements.
#[derive(Debug, Clone, PartialEq)]
pub enum ElementChange<S> {
    /// The element's instance is disposed.
    Dispose(Guid),
    /// A new sample of the element.
    Put(S),
}

/// An update of a collection (3.8.2): first the elements in their order, then the report with the metadata.
#[derive(Debug, Clone, PartialEq)]
pub struct Update<S, M> {
    /// What happens to elements, in this order.
    pub elements: Vec<ElementChange<S>>,
    /// What the report has to say of the collection.
    pub metadata: M,
    /// The report's timestamp: not before that of any element.
    pub time_stamp: DateTime,
}

/// Why changes are refused. The collection stays as it was.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ChangeError {
    /// An element with this id is there already.
    #[error("element {0} is there already: replace it, or give the new one an id of its own")]
    Exists(Guid),
    /// No element has this id.
    #[error("there is no element {0}")]
    Missing(Guid),
    /// The nil GUID stands for no element (3.8.3).
    #[error("the nil GUID cannot be an element's id: it stands for none")]
    Nil,
    /// A position beyond the end of the list.
    #[error("position {at} in a list of {length} elements")]
    Position {
        /// The position asked for.
        at: usize,
        /// How many elements there are.
        length: usize,
    },
    /// More elements than a `LargeCollectionSize` can tell.
    #[error("too many elements: {0}")]
    Size(#[from] OutOfRange),
}

/// The clock of a collection: timestamps that grow strictly, whatever the wall clock does.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Ticks {
    last: Option<DateTime>,
}

impl Ticks {
    pub(super) fn after(last: Option<DateTime>) -> Self {
        Self { last }
    }

    /// The next timestamp: now, or a nanosecond after the one before.
    pub(super) fn next(&mut self, now: DateTime) -> DateTime {
        let tick = match self.last {
            Some(last) if last >= now => following(last),
            _ => now,
        };
        self.last = Some(tick);
        tick
    }
}

fn following(time: DateTime) -> DateTime {
    let next = DateTime::new(time.seconds(), time.nanoseconds() + 1);
    // At the end of all time it stands still, as there is nothing after it.
    next.or_else(|_| DateTime::new(time.seconds().saturating_add(1), 0)).unwrap_or(time)
}

/// How an update ends: by its last change.
pub(super) fn end_of<S>(
    changes: &[ElementChange<S>],
    stamp: impl Fn(&S) -> (Guid, DateTime),
) -> (Guid, Option<DateTime>) {
    match changes.last() {
        Some(ElementChange::Put(sample)) => {
            let (id, timestamp) = stamp(sample);
            (id, Some(timestamp))
        }
        Some(ElementChange::Dispose(id)) => (*id, None),
        None => (Guid::NIL, None),
    }
}

/// The size as metadata tells it.
pub(super) fn size(elements: usize) -> Result<LargeCollectionSize, ChangeError> {
    Ok(LargeCollectionSize::new(elements)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn timestamps_grow_even_when_the_clock_steps_back() {
        let at = |seconds, nanoseconds| DateTime::new(seconds, nanoseconds).unwrap();
        let mut ticks = Ticks::default();
        let told: Vec<_> = [at(5, 0), at(5, 0), at(3, 0), at(5, 999_999_999), at(1, 0), at(7, 0)]
            .map(|now| ticks.next(now))
            .into();
        assert_eq!(told, [at(5, 0), at(5, 1), at(5, 2), at(5, 999_999_999), at(6, 0), at(7, 0)]);
    }
}
