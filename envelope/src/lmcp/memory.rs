//! How much memory reading a text form may take: everything that is allocated is accounted for before.

use super::reader::{MEMORY_FACTOR, MEMORY_FLOOR};

/// Memory that is not accounted for piece by piece: an error, and what a fresh object holds by default.
const ASIDE: usize = 320;

/// The longest name that errors and warnings show.
const SHOWN_MAX: usize = 64;

/// What may still be allocated while a text is read.
#[derive(Debug)]
pub(super) struct Memory {
    left: usize,
}

/// More memory would be taken than is allowed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Full;

impl Memory {
    /// What a text of `length` bytes may take, as a binary message of that length may.
    pub(super) fn of_text(length: usize) -> Self {
        Self { left: length.saturating_mul(MEMORY_FACTOR).max(MEMORY_FLOOR) - ASIDE }
    }

    /// A third of it, as the most that one kind of thing may take of it.
    pub(super) fn third(&self) -> Self {
        Self { left: self.left / 3 }
    }

    /// Accounts for `bytes` to be allocated.
    pub(super) fn take(&mut self, bytes: usize) -> Result<(), Full> {
        self.left = self.left.checked_sub(bytes).ok_or(Full)?;
        Ok(())
    }

    /// Takes back what was accounted for: it is free again.
    pub(super) fn give_back(&mut self, bytes: usize) {
        self.left += bytes;
    }

    /// Makes room for one more element. A list grows by a quarter, so that old and new together are little more than
    /// twice its elements.
    pub(super) fn grow<T>(&mut self, list: &mut Vec<T>) -> Result<(), Full> {
        if list.len() == list.capacity() {
            let more = list.len() / 4 + 1;
            self.take((list.len() + more) * size_of::<T>())?;
            self.give_back(list.len() * size_of::<T>());
            list.reserve_exact(more);
        }
        Ok(())
    }
}

/// A name as errors and warnings show it: what a document says may be long.
pub(super) fn shown(name: &str) -> Box<str> {
    match name.char_indices().nth(SHOWN_MAX) {
        Some((end, _)) => [&name[..end], "…"].concat().into(),
        None => name.into(),
    }
}
