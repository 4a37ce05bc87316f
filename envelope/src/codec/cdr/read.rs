//! CDR to values (DDS-XTypes 1.3, 7.4): driven by a schema, into anything that takes values.

use super::cursor::{Cursor, Read};
use super::error::{CdrFault, DEPTH_MAX};
use super::schema::{Field, List, Node, NodeId, Primitive, Schema, Structure};
use super::sink::Sink;
use crate::description::{Enumeration, Extensibility};

/// The parameter that says that a longer header follows (DDS-XTypes 1.3, 7.4.1.2.1).
pub(super) const EXTENDED: u16 = 0x3f01;
/// Whoever does not know the parameter must refuse the sample.
pub(super) const MUST_UNDERSTAND: u16 = 0x4000;
/// The bits of a parameter that are its id.
pub(super) const PARAMETER: u16 = 0x3fff;
/// The bits of a longer header that are the member's id.
pub(super) const MEMBER: u32 = 0x0fff_ffff;

/// Reads one sample.
pub(super) struct Reader<'a, 's, S> {
    pub(super) schema: &'a Schema,
    pub(super) cursor: Cursor<'a>,
    pub(super) sink: &'s mut S,
    /// Whether something was there that the schema does not have, or not there that it has.
    pub(super) differs: bool,
    depth: usize,
}

impl<'a, 's, S: Sink> Reader<'a, 's, S> {
    pub(super) fn new(schema: &'a Schema, cursor: Cursor<'a>, sink: &'s mut S) -> Self {
        Self { schema, cursor, sink, differs: false, depth: 0 }
    }

    /// Reads a value of the node.
    pub(super) fn value(&mut self, node: NodeId) -> Read<()> {
        let schema = self.schema;
        match &schema.nodes[node] {
            Node::Primitive { kind, size } => self.primitive(*kind, *size),
            Node::Text { bound } => {
                let text = self.cursor.text(*bound)?;
                self.sink.text(text);
                Ok(())
            }
            Node::WideText { bound } => {
                let text = self.cursor.wide_text(*bound)?;
                self.sink.text(&text);
                Ok(())
            }
            Node::Enumeration(known) => {
                let value = self.literal(known)?;
                self.differs |= known.name_of(value).is_none();
                self.sink.enumeration(value, known);
                Ok(())
            }
            Node::Bitmask { size } => {
                let bits = self.cursor.unsigned(*size)?;
                self.sink.bits(bits);
                Ok(())
            }
            Node::List(list) => self.list(list),
            Node::Structure(structure) => self.deeper(|it| it.structure(structure)),
            Node::Union { .. } => self.deeper(|it| it.union(node)),
            Node::Open => Err(self.cursor.fault(CdrFault::TooDeep)),
        }
    }

    fn deeper(&mut self, read: impl FnOnce(&mut Self) -> Read<()>) -> Read<()> {
        if self.depth >= DEPTH_MAX {
            return Err(self.cursor.fault(CdrFault::TooDeep));
        }
        self.depth += 1;
        let done = read(self);
        self.depth -= 1;
        done
    }

    fn primitive(&mut self, kind: Primitive, size: usize) -> Read<()> {
        match kind {
            Primitive::Boolean => {
                let value = self.cursor.boolean()?;
                self.sink.boolean(value);
            }
            Primitive::Unsigned => {
                let value = self.cursor.unsigned(size)?;
                self.sink.unsigned(value, size);
            }
            Primitive::Signed => {
                let value = self.cursor.signed(size)?;
                self.sink.signed(value, size);
            }
            Primitive::Float if size == 4 => {
                let bits = self.cursor.u32()?;
                self.sink.float32(f32::from_bits(bits));
            }
            Primitive::Float => {
                let bits = self.cursor.unsigned(8)?;
                self.sink.float64(f64::from_bits(bits));
            }
            Primitive::Character | Primitive::WideCharacter => {
                let unit = self.cursor.unsigned(size)? as u16;
                self.sink.character(unit);
            }
        }
        Ok(())
    }

    fn list(&mut self, list: &List) -> Read<()> {
        if !list.delimited || self.cursor.is_xcdr1() {
            return self.elements(list);
        }
        let length = self.cursor.u32()? as usize;
        let outside = self.cursor.enter(length, false)?;
        self.elements(list)?;
        match self.cursor.leave(outside) {
            0 => Ok(()),
            left => Err(self.cursor.fault(CdrFault::InsideDelimiter { left })),
        }
    }

    fn elements(&mut self, list: &List) -> Read<()> {
        let length = match list.length {
            Some(length) => length,
            None => self.cursor.u32()? as usize,
        };
        if let Some(bound) = list.bound.filter(|bound| length > *bound as usize) {
            return Err(self.cursor.fault(CdrFault::Length { found: length as u64, allowed: bound.into() }));
        }
        // Every element takes a byte at least, so that nothing is made room for that is not there.
        let left = self.cursor.left();
        if length > left {
            return Err(self.cursor.fault(CdrFault::LengthBeyondEnd { declared: length as u64, left }));
        }
        let counted = list.length.is_none();
        if list.octets {
            let octets = self.cursor.take(length)?;
            self.sink.octets(octets, counted);
            return Ok(());
        }
        self.sink.list(length, counted);
        for index in 0..length {
            self.deeper(|it| it.value(list.element)).map_err(|error| error.at_element(index))?;
        }
        self.sink.end();
        Ok(())
    }

    fn structure(&mut self, structure: &'a Structure) -> Read<()> {
        self.sink.structure(structure.members.len());
        if structure.extensibility == Extensibility::Final || self.cursor.is_xcdr1() {
            // In XCDR1 only the outermost type shows where it ends.
            let may_end = structure.extensibility != Extensibility::Final && self.depth == 1;
            self.members(structure, may_end)?;
        } else {
            let length = self.cursor.u32()? as usize;
            let outside = self.cursor.enter(length, false)?;
            self.members(structure, true)?;
            self.differs |= self.cursor.leave(outside) > 0;
        }
        self.sink.end();
        Ok(())
    }

    /// The members; where the sample may end before the last of them, as those of older versions of the type do.
    fn members(&mut self, structure: &'a Structure, may_end: bool) -> Read<()> {
        let mut at_end = false;
        for field in &structure.members {
            at_end |= may_end && self.cursor.left() == 0;
            let done = if at_end {
                self.differs = true;
                self.past_the_end(field)
            } else if field.optional {
                self.optional(field)
            } else {
                self.value(field.node)
            };
            done.map_err(|error| error.within(&field.name))?;
        }
        Ok(())
    }

    fn past_the_end(&mut self, field: &Field) -> Read<()> {
        if field.optional {
            self.sink.optional(false);
            return Ok(());
        }
        if field.key {
            return Err(self.cursor.fault(CdrFault::Absent));
        }
        self.sink.missing();
        Ok(())
    }

    fn optional(&mut self, field: &Field) -> Read<()> {
        if !self.cursor.is_xcdr1() {
            let present = self.cursor.boolean()?;
            self.sink.optional(present);
            return if present { self.value(field.node) } else { Ok(()) };
        }
        let length = self.parameter(field)?;
        self.sink.optional(length > 0);
        if length == 0 {
            return Ok(());
        }
        let outside = self.cursor.enter(length, true)?;
        self.value(field.node)?;
        // Some fill a parameter up to a multiple of four.
        match self.cursor.leave(outside) {
            ..4 => Ok(()),
            left => Err(self.cursor.fault(CdrFault::InsideDelimiter { left })),
        }
    }

    /// The length of the parameter that holds an optional member, by its short or its extended header.
    fn parameter(&mut self, field: &Field) -> Read<usize> {
        self.cursor.align(4)?;
        let short = self.cursor.unsigned(2)? as u16 & PARAMETER;
        let mut length = self.cursor.unsigned(2)? as usize;
        let mut found = u32::from(short);
        if short == EXTENDED {
            found = self.cursor.u32()? & MEMBER;
            length = self.cursor.u32()? as usize;
        }
        if found == field.id {
            return Ok(length);
        }
        Err(self.cursor.fault(CdrFault::OtherMember { found, expected: field.id }))
    }

    fn union(&mut self, node: NodeId) -> Read<()> {
        let schema = self.schema;
        let Node::Union { extensibility, discriminator, union, cases, .. } = &schema.nodes[node] else {
            return Err(self.cursor.fault(CdrFault::OtherKind { expected: "a union" }));
        };
        let delimited = *extensibility != Extensibility::Final && !self.cursor.is_xcdr1();
        let outside = if delimited {
            let length = self.cursor.u32()? as usize;
            Some(self.cursor.enter(length, false)?)
        } else {
            None
        };
        let chosen = self.discriminator(*discriminator)?;
        let case = union.case_of(chosen);
        self.sink.union(chosen);
        if let Some(case) = case {
            let place = union.cases.iter().position(|other| std::ptr::eq(other, case)).unwrap_or_default();
            self.value(cases[place]).map_err(|error| error.within(&case.member.name))?;
        }
        if let Some(outside) = outside {
            self.differs |= self.cursor.leave(outside) > 0;
        }
        self.sink.end();
        Ok(())
    }

    fn discriminator(&mut self, node: NodeId) -> Read<i64> {
        match &self.schema.nodes[node] {
            Node::Primitive { kind: Primitive::Boolean, .. } => self.cursor.boolean().map(i64::from),
            Node::Primitive { kind: Primitive::Signed, size } => self.cursor.signed(*size),
            Node::Primitive { size, .. } => self.cursor.unsigned(*size).map(|value| value as i64),
            Node::Enumeration(known) => self.literal(known).map(i64::from),
            _ => Err(self.cursor.fault(CdrFault::OtherKind { expected: "a discriminator" })),
        }
    }

    /// A value of an enumeration. Of fewer than 32 bits it stands for a negative one where none other is meant.
    fn literal(&mut self, known: &Enumeration) -> Read<i32> {
        let size = known.size();
        let value = self.cursor.signed(size)? as i32;
        let unsigned = value & (u32::MAX >> (32 - 8 * size)) as i32;
        Ok(if known.name_of(value).is_none() { unsigned } else { value })
    }
}
