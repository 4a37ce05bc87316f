//! Large Sets and Large Lists (ICD 3.8): a collection whose elements are samples of their own, with metadata in a report.
//!
//! A **provider** turns changes into updates: the elements' samples in order, and the metadata for its report. A **reader**
//! puts collections together again from samples of both topics, whichever comes first, and tells of each element or of each
//! stable state.
//!
//! The topic of the elements is ordered (3.8.1): samples of one writer come in the order in which they were written, those of
//! a late joiner's history too. Between the two topics there is no order.
//!
//! What the ICD leaves open, and what is done here:
//!
//! - A provider sends the elements of an update before its metadata. A reader takes both orders.
//! - In an update, elements are disposed first, then put, so that it ends with a sample that late joiners still find. Where
//!   nothing is put, an element that stays is put again; only an update that empties a collection ends with a disposal.
//! - Timestamps of elements grow strictly within a collection, so that one element and timestamp name one moment.
//! - The starting element of an empty list is nil.
//! - An update of another provider may end with a disposal (tables 4 and 6). The metadata then has no timestamp to tell which
//!   disposal of that element it means: the latest that no sample newer than the report precedes. Metadata that comes long
//!   before its elements may so be taken for an earlier disposal that left as many elements, until the right one comes. A
//!   late joiner never hears of a disposal that lies in the past: it needs the history of elements, read after the metadata
//!   came, and then goes by the number of elements and by their age.

mod assembly;
mod list;
mod reader;
mod set;
mod shape;
#[cfg(test)]
mod tests;
mod update;

pub use list::{ListChange, ListProvider};
pub use reader::{ListReader, Reader, ReaderLimits, SetReader, Tell, Told};
pub use set::{SetChange, SetProvider};
pub use shape::{Damage, Lists, Sets, Shape};
pub use update::{ChangeError, ElementChange, Update};
