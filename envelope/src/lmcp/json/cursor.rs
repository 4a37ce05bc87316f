//! A place in JSON text, from which values are read one by one. Nothing is kept of what was passed.

use serde::de::IgnoredAny;

use super::read::{JsonFault, Read, fail};

/// How deep objects and arrays may be nested. Reading recurses as deep.
const DEPTH_MAX: usize = 64;

pub(super) struct Cursor<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self { text, at: 0, depth: 0 }
    }

    /// The next byte that is not blank.
    pub(super) fn peek(&mut self) -> Option<u8> {
        let rest = &self.text.as_bytes()[self.at..];
        let blanks = rest.iter().take_while(|byte| matches!(byte, b' ' | b'\t' | b'\r' | b'\n')).count();
        self.at += blanks;
        rest.get(blanks).copied()
    }

    /// The place of the next value, to come back to.
    pub(super) fn place(&self) -> usize {
        self.at
    }

    /// Goes to a place within the same object or array.
    pub(super) fn go_to(&mut self, place: usize) {
        self.at = place;
    }

    pub(super) fn fail<T>(&self, expected: &'static str) -> Read<T> {
        let line = 1 + self.text.as_bytes()[..self.at].iter().filter(|&&byte| byte == b'\n').count();
        fail(JsonFault::Syntax { line, expected })
    }

    /// Enters the object or array that begins with `bracket`, which was peeked.
    pub(super) fn enter(&mut self) -> Read<()> {
        if self.depth == DEPTH_MAX {
            return fail(JsonFault::Depth);
        }
        self.depth += 1;
        self.at += 1;
        Ok(())
    }

    /// Whether another item follows, and goes to it; `first` tells that none was read. Else the end is passed.
    fn goes_on(&mut self, first: &mut bool, end: u8, expected: &'static str) -> Read<bool> {
        let next = self.peek();
        if next == Some(end) {
            self.at += 1;
            self.depth -= 1;
            return Ok(false);
        }
        if !std::mem::take(first) {
            if next != Some(b',') {
                return self.fail(expected);
            }
            self.at += 1;
            self.peek();
        }
        Ok(true)
    }

    /// The key of the next member, as it stands between its quotes; the cursor is at its value then. None at the end.
    pub(super) fn next_member(&mut self, first: &mut bool) -> Read<Option<&'a str>> {
        if !self.goes_on(first, b'}', "`,` or `}`")? {
            return Ok(None);
        }
        if self.peek() != Some(b'"') {
            return self.fail("a key");
        }
        let key = self.scalar()?;
        if self.peek() != Some(b':') {
            return self.fail("`:`");
        }
        self.at += 1;
        self.peek();
        Ok(Some(&key[1..key.len() - 1]))
    }

    /// Whether another element follows, and goes to it.
    pub(super) fn next_element(&mut self, first: &mut bool) -> Read<bool> {
        self.goes_on(first, b']', "`,` or `]`")
    }

    /// A value that is neither object nor array, as it stands.
    pub(super) fn scalar(&mut self) -> Read<&'a str> {
        let rest = &self.text[self.at..];
        let end = if rest.starts_with('"') {
            let mut is_escaped = false;
            let close = rest.bytes().skip(1).position(|byte| {
                let closes = byte == b'"' && !is_escaped;
                is_escaped = byte == b'\\' && !is_escaped;
                closes
            });
            close.map_or(rest.len(), |close| close + 2)
        } else {
            rest.find([',', ']', '}', ':', ' ', '\t', '\r', '\n']).unwrap_or(rest.len())
        };
        let scalar = &rest[..end];
        if serde_json::from_str::<IgnoredAny>(scalar).is_err() {
            return self.fail("a value");
        }
        self.at += end;
        Ok(scalar)
    }

    /// Passes over a value.
    pub(super) fn skip(&mut self) -> Read<()> {
        let mut first = true;
        match self.peek() {
            Some(b'{') => {
                self.enter()?;
                while self.next_member(&mut first)?.is_some() {
                    self.skip()?;
                }
            }
            Some(b'[') => {
                self.enter()?;
                while self.next_element(&mut first)? {
                    self.skip()?;
                }
            }
            _ => _ = self.scalar()?,
        }
        Ok(())
    }

    /// How many elements the array at the cursor has; none when it is no array.
    pub(super) fn count(&mut self) -> Read<Option<usize>> {
        if self.peek() != Some(b'[') {
            return Ok(None);
        }
        let start = self.at;
        self.enter()?;
        let (mut count, mut first) = (0, true);
        while self.next_element(&mut first)? {
            self.skip()?;
            count += 1;
        }
        self.at = start;
        Ok(Some(count))
    }
}
