//! Values to CDR (DDS-XTypes 1.3, 7.4): driven by a schema, from anything that gives values.

use super::cursor::Read;
use super::error::{CdrError, CdrFault, DEPTH_MAX};
use super::read::{EXTENDED, MUST_UNDERSTAND};
use super::representation::{ByteOrder, Form, Representation};
use super::schema::{Field, List, Node, NodeId, Primitive, Schema, Structure};
use super::sink::Source;
use crate::description::{Enumeration, Extensibility};

/// Writes one sample.
pub(super) struct Writer<'a, 'o, S> {
    schema: &'a Schema,
    source: &'o mut S,
    representation: Representation,
    out: &'o mut Vec<u8>,
    /// Where alignment counts from.
    origin: usize,
    depth: usize,
}

impl<'a, 'o, 's, S: Source<'s>> Writer<'a, 'o, S> {
    /// Writes behind what is in `out` already; alignment counts from there.
    pub(super) fn new(
        schema: &'a Schema,
        representation: Representation,
        source: &'o mut S,
        out: &'o mut Vec<u8>,
    ) -> Self {
        let origin = out.len();
        Self { schema, source, representation, out, origin, depth: 0 }
    }

    fn is_xcdr1(&self) -> bool {
        self.representation.form == Form::Xcdr1
    }

    #[cold]
    fn fault(&self, fault: CdrFault) -> Box<CdrError> {
        CdrError::new(fault, self.out.len())
    }

    fn align(&mut self, size: usize) {
        let most = if self.is_xcdr1() { 8 } else { 4 };
        let length = self.out.len() - self.origin;
        self.out.resize(self.origin + length.next_multiple_of(size.min(most)), 0);
    }

    fn put(&mut self, value: u64, size: usize) {
        self.align(size);
        match self.representation.order {
            ByteOrder::Little => self.out.extend_from_slice(&value.to_le_bytes()[..size]),
            ByteOrder::Big => self.out.extend_from_slice(&value.to_be_bytes()[8 - size..]),
        }
    }

    fn length(&mut self, length: usize) -> Read<()> {
        let fits = u32::try_from(length).map_err(|_| self.fault(CdrFault::OutOfRange))?;
        self.put(fits.into(), 4);
        Ok(())
    }

    /// Leaves room for the length of what follows, and says where.
    fn open(&mut self) -> usize {
        self.put(0, 4);
        self.out.len()
    }

    /// Writes the length of what has followed since.
    fn close(&mut self, start: usize) -> Read<()> {
        let length = u32::try_from(self.out.len() - start).map_err(|_| self.fault(CdrFault::OutOfRange))?;
        let bytes = match self.representation.order {
            ByteOrder::Little => length.to_le_bytes(),
            ByteOrder::Big => length.to_be_bytes(),
        };
        self.out[start - 4..start].copy_from_slice(&bytes);
        Ok(())
    }

    fn given<T>(&self, given: Result<T, CdrFault>) -> Read<T> {
        given.map_err(|fault| self.fault(fault))
    }

    /// Writes a value of the node.
    pub(super) fn value(&mut self, node: NodeId) -> Read<()> {
        let schema = self.schema;
        match &schema.nodes[node] {
            Node::Primitive { kind, size } => self.primitive(*kind, *size),
            Node::Text { bound } => {
                let text = self.source.text();
                let text = self.given(text)?;
                self.bounded(text.len(), *bound)?;
                self.length(text.len() + 1)?;
                self.out.extend_from_slice(text.as_bytes());
                self.out.push(0);
                Ok(())
            }
            Node::WideText { bound } => {
                let text = self.source.text();
                let units: Vec<u16> = self.given(text)?.encode_utf16().collect();
                self.bounded(units.len(), *bound)?;
                self.length(2 * units.len())?;
                units.into_iter().for_each(|unit| self.put(unit.into(), 2));
                Ok(())
            }
            Node::Enumeration(known) => self.literal(known),
            Node::Bitmask { size } => {
                let bits = self.source.bits();
                let bits = self.given(bits)?;
                self.put(bits, *size);
                Ok(())
            }
            Node::List(list) => self.list(list),
            Node::Structure(structure) => self.deeper(|it| it.structure(structure)),
            Node::Union { .. } => self.deeper(|it| it.union(node)),
            Node::Open => Err(self.fault(CdrFault::TooDeep)),
        }
    }

    fn deeper(&mut self, write: impl FnOnce(&mut Self) -> Read<()>) -> Read<()> {
        if self.depth >= DEPTH_MAX {
            return Err(self.fault(CdrFault::TooDeep));
        }
        self.depth += 1;
        let done = write(self);
        self.depth -= 1;
        done
    }

    fn bounded(&self, length: usize, bound: Option<u32>) -> Read<()> {
        match bound {
            Some(bound) if length > bound as usize => {
                Err(self.fault(CdrFault::Length { found: length as u64, allowed: bound.into() }))
            }
            _ => Ok(()),
        }
    }

    fn literal(&mut self, known: &Enumeration) -> Read<()> {
        let value = self.source.enumeration(known);
        let value = self.given(value)?;
        self.put(value as u64, known.size());
        Ok(())
    }

    fn primitive(&mut self, kind: Primitive, size: usize) -> Read<()> {
        let bits = match kind {
            Primitive::Boolean => self.source.boolean().map(u64::from),
            Primitive::Unsigned => self.source.unsigned(size),
            Primitive::Signed => self.source.signed(size).map(|value| value as u64),
            Primitive::Float if size == 4 => self.source.float32().map(|value| value.to_bits().into()),
            Primitive::Float => self.source.float64().map(f64::to_bits),
            Primitive::Character | Primitive::WideCharacter => self.source.character().map(u64::from),
        };
        let bits = self.given(bits)?;
        self.put(bits, size);
        Ok(())
    }

    fn list(&mut self, list: &List) -> Read<()> {
        if !list.delimited || self.is_xcdr1() {
            return self.elements(list);
        }
        let start = self.open();
        self.elements(list)?;
        self.close(start)
    }

    fn elements(&mut self, list: &List) -> Read<()> {
        if list.octets {
            let octets = self.source.octets(list.length);
            let octets = self.given(octets)?;
            self.bounded(octets.len(), list.bound)?;
            if list.length.is_none() {
                self.length(octets.len())?;
            }
            self.out.extend_from_slice(octets);
            return Ok(());
        }
        let length = self.source.list(list.length);
        let length = self.given(length)?;
        self.bounded(length, list.bound)?;
        if list.length.is_none() {
            self.length(length)?;
        }
        for index in 0..length {
            self.deeper(|it| it.value(list.element)).map_err(|error| error.at_element(index))?;
        }
        self.source.end();
        Ok(())
    }

    fn structure(&mut self, structure: &'a Structure) -> Read<()> {
        let begun = self.source.structure(structure.members.len());
        self.given(begun)?;
        let delimited = structure.extensibility != Extensibility::Final && !self.is_xcdr1();
        let start = if delimited { Some(self.open()) } else { None };
        for field in &structure.members {
            let done = if field.optional { self.optional(field) } else { self.value(field.node) };
            done.map_err(|error| error.within(&field.name))?;
        }
        self.source.end();
        start.map_or(Ok(()), |start| self.close(start))
    }

    fn optional(&mut self, field: &Field) -> Read<()> {
        let present = self.source.optional();
        let present = self.given(present)?;
        if !self.is_xcdr1() {
            self.out.push(present.into());
            return if present { self.value(field.node) } else { Ok(()) };
        }
        self.parameter(field)?;
        if !present {
            return Ok(());
        }
        let start = self.out.len();
        let outer = std::mem::replace(&mut self.origin, start);
        self.value(field.node)?;
        self.origin = outer;
        self.close(start)
    }

    /// An extended header, whose length is still 0: it holds every id and every length.
    fn parameter(&mut self, field: &Field) -> Read<()> {
        self.align(4);
        self.put((EXTENDED | MUST_UNDERSTAND).into(), 2);
        self.put(8, 2);
        let flag = if field.must_understand { 0x4000_0000 } else { 0 };
        self.put((field.id | flag).into(), 4);
        self.put(0, 4);
        Ok(())
    }

    fn union(&mut self, node: NodeId) -> Read<()> {
        let schema = self.schema;
        let Node::Union { extensibility, discriminator, union, cases, .. } = &schema.nodes[node] else {
            return Err(self.fault(CdrFault::OtherKind { expected: "a union" }));
        };
        let chosen = self.source.union();
        let (chosen, held) = self.given(chosen)?;
        let delimited = *extensibility != Extensibility::Final && !self.is_xcdr1();
        let start = if delimited { Some(self.open()) } else { None };
        let size = match &schema.nodes[*discriminator] {
            Node::Primitive { size, .. } => *size,
            Node::Enumeration(known) => known.size(),
            _ => 4,
        };
        self.put(chosen as u64, size);
        match union.cases.iter().position(|case| union.case_of(chosen) == Some(case)) {
            Some(place) if held => {
                let name = &union.cases[place].member.name;
                self.value(cases[place]).map_err(|error| error.within(name))?;
            }
            None if !held => {}
            _ => return Err(self.fault(CdrFault::OtherKind { expected: "the member that is chosen" })),
        }
        self.source.end();
        start.map_or(Ok(()), |start| self.close(start))
    }
}
