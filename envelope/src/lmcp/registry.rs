//! All declared types: found by their number, by name, by descent.

use super::error::DecodeFault;
use super::reader::Header;
use super::schema::{Series, TypeInfo};
use super::{cmasi, impact, perceive, route, uxnative, uxtask, vehicles};

/// A series with its types in the order of their numbers.
struct Entry {
    series: &'static Series,
    types: &'static [&'static TypeInfo],
}

static REGISTRY: [Entry; 7] = [
    Entry { series: &cmasi::SERIES, types: &cmasi::TYPES_BY_ID },
    Entry { series: &uxtask::SERIES, types: &uxtask::TYPES_BY_ID },
    Entry { series: &route::SERIES, types: &route::TYPES_BY_ID },
    Entry { series: &uxnative::SERIES, types: &uxnative::TYPES_BY_ID },
    Entry { series: &impact::SERIES, types: &impact::TYPES_BY_ID },
    Entry { series: &vehicles::SERIES, types: &vehicles::TYPES_BY_ID },
    Entry { series: &perceive::SERIES, types: &perceive::TYPES_BY_ID },
];

/// All declared types, series by series.
pub fn types() -> impl Iterator<Item = &'static TypeInfo> {
    REGISTRY.iter().flat_map(|entry| entry.types.iter().copied())
}

/// The type of that descriptor, such as `afrl.cmasi.AirVehicleState`.
pub fn type_of(full_name: &str) -> Option<&'static TypeInfo> {
    let (namespace, name) = full_name.rsplit_once('.')?;
    let entry = REGISTRY.iter().find(|entry| entry.series.namespace == namespace)?;
    entry.types.iter().copied().find(|info| info.name == name)
}

/// The type of that name in the series, as the XML form tells it: `CMASI`, `AirVehicleState`.
pub fn type_in(series: &str, name: &str) -> Option<&'static TypeInfo> {
    let entry = REGISTRY.iter().find(|entry| entry.series.text == series)?;
    entry.types.iter().copied().find(|info| info.name == name)
}

/// The type and all that descend from it, as a subscription to a base type means them.
pub fn descendants(info: &'static TypeInfo) -> impl Iterator<Item = &'static TypeInfo> {
    types().filter(move |candidate| candidate.is_a(info))
}

impl Header {
    /// The type that it tells.
    ///
    /// # Errors
    /// When the series, its version or the type is not declared here.
    #[inline]
    pub fn type_info(&self) -> Result<&'static TypeInfo, DecodeFault> {
        let Self { series, type_id: id, version } = *self;
        let Some(entry) = REGISTRY.iter().find(|entry| entry.series.name == series) else {
            return Err(DecodeFault::UnknownSeries(series));
        };
        if version != entry.series.version {
            return Err(DecodeFault::Version { series, found: version, known: entry.series.version });
        }
        // Numbers start at 1: 0 wraps to beyond the end.
        match entry.types.get((id as usize).wrapping_sub(1)) {
            Some(info) => Ok(info),
            None => Err(DecodeFault::UnknownType { series, id }),
        }
    }
}

/// The types of all `groups` by their number, `N` in all: does not compile unless each number from 1
/// to `N` is declared once.
pub(super) const fn table<const N: usize>(groups: &[&[&'static TypeInfo]]) -> [&'static TypeInfo; N] {
    let mut table = [None; N];
    let mut group = 0;
    while group < groups.len() {
        let mut i = 0;
        while i < groups[group].len() {
            let info = groups[group][i];
            let place = &mut table[info.id as usize - 1];
            assert!(place.is_none(), "two types of one number");
            *place = Some(info);
            i += 1;
        }
        group += 1;
    }
    complete(table)
}

const fn complete<const N: usize>(table: [Option<&'static TypeInfo>; N]) -> [&'static TypeInfo; N] {
    let mut full = [match table[0] {
        Some(first) => first,
        None => panic!("type 1 is not declared"),
    }; N];
    let mut i = 0;
    while i < N {
        match table[i] {
            Some(info) => full[i] = info,
            None => panic!("a type number is not declared"),
        }
        i += 1;
    }
    full
}
