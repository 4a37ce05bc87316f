//! Collections of small numbers.

use aldis_envelope::umaa::LargeCollection;
use aldis_envelope::{DateTime, Guid};

/// An attribute whose elements are small numbers.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Items;

/// An element's value.
pub(super) type Item = u8;

impl LargeCollection for Items {
    type Element = Item;
    const ELEMENT_NAME: &'static str = "UMAA::SO::ItemReport::ItemReportTypeItemsElement";
}

pub(super) fn id(number: u8) -> Guid {
    Guid([number; 16])
}

pub(super) fn at(seconds: i64) -> DateTime {
    DateTime::new(seconds, 0).unwrap_or_default()
}
