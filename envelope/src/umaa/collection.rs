//! Large Sets and Large Lists on the wire (ICD 3.8, tables 4 to 7): metadata inside a report, each element a sample.

use super::structure::structure;
use super::{ElementKey, LargeCollectionSize, Topic};
use crate::guid::Guid;
use crate::time::DateTime;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::fmt;

/// An attribute of a report that is a large collection: a name for the topic of its elements.
pub trait LargeCollection: Clone + PartialEq + fmt::Debug + Send + Sync + 'static {
    /// The value of an element.
    type Element: Serialize + DeserializeOwned + Clone + PartialEq + fmt::Debug + Send + Sync + 'static;
    /// The elements' topic and type: in the report's namespace, `<report's type><Attribute>SetElement` or `…ListElement`.
    const ELEMENT_NAME: &'static str;
}

structure! {
    /// Says of a large set what belongs to it (`LargeSetMetadata`, table 4).
    #[derive(Copy, Eq)]
    LargeSetMetadata = "UMAA::Common::LargeSetMetadata" {
        /// The set.
        set_id: Guid = "setID",
        /// The element whose reception ends the update; nil for a set that is empty from the start (3.8.3).
        update_element_id: Guid = "updateElementID",
        /// The timestamp of that element; none when the update ended with its disposal.
        update_element_timestamp: Option<DateTime> = "updateElementTimestamp",
        /// How many elements the set has after the update.
        size: LargeCollectionSize = "size",
    }
}

structure! {
    /// Says of a large list what belongs to it (`LargeListMetadata`, table 6).
    #[derive(Copy, Eq)]
    LargeListMetadata = "UMAA::Common::LargeListMetadata" {
        /// The list.
        list_id: Guid = "listID",
        /// The element whose reception ends the update; nil for a list that is empty from the start (3.8.3).
        update_element_id: Guid = "updateElementID",
        /// The timestamp of that element; none when the update ended with its disposal.
        update_element_timestamp: Option<DateTime> = "updateElementTimestamp",
        /// The first element of the list; nil when it is empty.
        starting_element_id: Guid = "startingElementID",
        /// How many elements the list has after the update.
        size: LargeCollectionSize = "size",
    }
}

/// An element of a large set (table 5).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(bound = "", rename_all = "camelCase", deny_unknown_fields)]
pub struct SetElement<C: LargeCollection> {
    /// Its value.
    pub element: C::Element,
    /// The set that it belongs to.
    #[serde(rename = "setID")]
    pub set_id: Guid,
    /// The element, unique among all elements on the bus (key).
    #[serde(rename = "elementID")]
    pub element_id: Guid,
    /// When it was made or changed.
    pub element_timestamp: DateTime,
}

/// An element of a large list (table 7).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(bound = "", rename_all = "camelCase", deny_unknown_fields)]
pub struct ListElement<C: LargeCollection> {
    /// Its value.
    pub element: C::Element,
    /// The list that it belongs to.
    #[serde(rename = "listID")]
    pub list_id: Guid,
    /// The element, unique among all elements on the bus (key).
    #[serde(rename = "elementID")]
    pub element_id: Guid,
    /// When it was made or changed.
    pub element_timestamp: DateTime,
    /// The element after it; none for the last one.
    #[serde(rename = "nextElementID")]
    pub next_element_id: Option<Guid>,
}

impl<C: LargeCollection> Topic for SetElement<C> {
    const NAME: &'static str = C::ELEMENT_NAME;
    const TYPE_NAME: &'static str = C::ELEMENT_NAME;
    type Key = ElementKey;

    fn key(&self) -> ElementKey {
        ElementKey { element_id: self.element_id }
    }
}

impl<C: LargeCollection> Topic for ListElement<C> {
    const NAME: &'static str = C::ELEMENT_NAME;
    const TYPE_NAME: &'static str = C::ELEMENT_NAME;
    type Key = ElementKey;

    fn key(&self) -> ElementKey {
        ElementKey { element_id: self.element_id }
    }
}
