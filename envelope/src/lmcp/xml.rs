//! The XML form, as scenario files and service configurations use it: an object is an element of its
//! type's name with the attribute `Series`; in it, its fields by the model's names, in any order.
//!
//! ```xml
//! <RemoveTasks Series="CMASI">
//!   <TaskList>
//!     <int64>1000</int64>
//!   </TaskList>
//! </RemoveTasks>
//! ```
//!
//! Reading is tolerant, as the reference is: what is not known is passed over, and returned as a
//! warning; what is not there keeps its default. Only a document that is not well formed is an error.
//! An enumeration is written by name, a number without a name as the number. A null is the element
//! `null`, left out where null is the field's default. Blanks around a text are no part of it unless
//! written as character references, and are written so. A NaN's other bits are lost.
//!
//! A document is read straight into its objects, within the memory that a binary message of its length is allowed.

mod pull;
mod read;

mod write;

pub use pull::{XmlError, XmlFault};
pub use read::{Document, Placed, Warning, WarningKind, read_xml};

pub use write::{XmlTextError, to_xml};

/// The attribute that tells an object's series.
const SERIES: &str = "Series";

/// The element that stands for a null.
const NULL: &str = "null";
