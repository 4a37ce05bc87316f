//! The order of samples that were taken together.

use super::Taken;

/// Puts a batch into the order in which each writer has written: what is taken comes grouped by instance. Writers stay in the order
/// of their first samples, and samples of one time in the order in which they came.
pub fn in_order(batch: &mut [Taken]) {
    let mut first = std::collections::BTreeMap::new();
    for (place, taken) in batch.iter().enumerate() {
        first.entry(taken.writer).or_insert(place);
    }
    batch.sort_by_key(|taken| (first.get(&taken.writer).copied(), taken.source_time));
}
