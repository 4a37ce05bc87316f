//! Sets of atoms as bits: one word of 128 where that is enough, as many words as needed otherwise.

/// A set of small numbers.
pub trait Bits: Clone + PartialEq {
    /// The empty set that can hold the numbers below `count`.
    fn empty(count: usize) -> Self;
    /// Adds a number.
    fn insert(&mut self, number: usize);
    /// Whether a number is in it.
    fn contains(&self, number: usize) -> bool;
    /// Whether both have a number in common.
    fn meets(&self, other: &Self) -> bool;
    /// Adds all numbers of another set.
    fn unite(&mut self, other: &Self);
}

impl Bits for u128 {
    fn empty(_count: usize) -> Self {
        0
    }

    fn insert(&mut self, number: usize) {
        *self |= 1 << number;
    }

    fn contains(&self, number: usize) -> bool {
        self >> number & 1 == 1
    }

    fn meets(&self, other: &Self) -> bool {
        self & other != 0
    }

    fn unite(&mut self, other: &Self) {
        *self |= other;
    }
}

/// A set of any size.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AtomSet(Vec<u64>);

impl Bits for AtomSet {
    fn empty(count: usize) -> Self {
        Self(vec![0; count.div_ceil(64)])
    }

    fn insert(&mut self, number: usize) {
        self.0[number / 64] |= 1 << (number % 64);
    }

    fn contains(&self, number: usize) -> bool {
        self.0[number / 64] >> (number % 64) & 1 == 1
    }

    fn meets(&self, other: &Self) -> bool {
        self.0.iter().zip(&other.0).any(|(a, b)| a & b != 0)
    }

    fn unite(&mut self, other: &Self) {
        for (a, b) in self.0.iter_mut().zip(&other.0) {
            *a |= b;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn holds_what_was_put_in<B: Bits + std::fmt::Debug>(count: usize) {
        let (mut a, mut b) = (B::empty(count), B::empty(count));
        a.insert(3);
        a.insert(count - 1);
        b.insert(4);
        assert!(a.contains(3) && a.contains(count - 1) && !a.contains(4) && !a.meets(&b));
        b.unite(&a);
        assert!(b.contains(3) && b.contains(4) && b.meets(&a));
    }

    #[test]
    fn both_sets_hold_what_was_put_in() {
        holds_what_was_put_in::<u128>(128);
        holds_what_was_put_in::<AtomSet>(1000);
    }
}
