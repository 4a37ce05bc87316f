//! Objects from XML.

use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;

use super::NULL;
use super::pull::{Piece, Pull, Tag, XmlError};
use crate::lmcp::memory::{Full, Memory, shown};
use crate::lmcp::object::Object;
use crate::lmcp::registry::{descendants, type_in};
use crate::lmcp::schema::{EnumInfo, FieldInfo, Kind, TypeInfo};
use crate::lmcp::value::{List, Reference, Slot, text_apart};

/// What a document holds.
#[derive(Debug, Clone, Default)]
pub struct Document {
    /// Its objects in document order: the root element, or those at any depth of a scenario file. An
    /// object within another is part of that one.
    pub objects: Vec<Placed>,
    /// What was passed over, as far as there is memory for it.
    pub warnings: Vec<Warning>,
    /// How much more was passed over.
    pub more_warnings: usize,
}

/// An object with its place in the document.
#[derive(Debug, Clone)]
pub struct Placed {
    /// The object.
    pub object: Box<dyn Object>,
    /// The line where it begins, counted from 1.
    pub line: usize,
    /// When a simulator is to send it, in seconds from the scenario's start: its attribute `Time`.
    pub time: Option<f64>,
}

/// Something in a document that was passed over.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// The line, counted from 1.
    pub line: usize,
    /// What it was.
    pub kind: WarningKind,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.kind)
    }
}

/// What may be passed over in a document.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WarningKind {
    /// An element of a series or type that is not declared here.
    #[error("type {name} of series {series} is not known")]
    UnknownType {
        /// The series that the element tells; empty if it does not.
        series: Box<str>,
        /// The element.
        name: Box<str>,
    },
    /// An element that is no field of the object's type.
    #[error("{info} has no field {field}")]
    UnknownField {
        /// The type.
        info: &'static str,
        /// The element.
        field: Box<str>,
    },
    /// A text that is not a value of the field.
    #[error("{text:?} is not a value of {field}")]
    Value {
        /// The field.
        field: &'static str,
        /// The text.
        text: Box<str>,
    },
    /// An object of a type that the field does not hold.
    #[error("{field} does not hold {info}")]
    Kind {
        /// The field.
        field: &'static str,
        /// The object's type.
        info: &'static str,
    },
    /// An element beyond what the field has room for.
    #[error("{field} has no room for another {name}")]
    Surplus {
        /// The field.
        field: &'static str,
        /// The element.
        name: Box<str>,
    },
}

impl WarningKind {
    /// Bytes of memory that it takes beside itself.
    fn apart(&self) -> usize {
        match self {
            Self::UnknownType { series, name } => series.len() + name.len(),
            Self::UnknownField { field: text, .. }
            | Self::Value { text, .. }
            | Self::Surplus { name: text, .. } => text.len(),
            Self::Kind { .. } => 0,
        }
    }
}

/// Reads the objects of a document: a message, a simulator's scenario, or whatever has elements with
/// the attribute `Series` in it.
///
/// # Errors
/// Tells the line where the document is not well formed, or where its objects take more memory than it is allowed.
pub fn read_xml(document: &[u8]) -> Result<Document, XmlError> {
    let memory = Memory::of_text(document.len());
    let for_warnings = memory.third();
    let pull = Pull::new(document, memory)?;
    let mut reader = XmlReader { pull, found: Document::default(), for_warnings };
    reader.read_all()?;
    Ok(reader.found)
}

type Read<T> = Result<T, XmlError>;

struct XmlReader<'a> {
    pull: Pull<'a>,
    found: Document,
    /// The most that warnings may take of the memory: they do not crowd out objects.
    for_warnings: Memory,
}

impl<'a> XmlReader<'a> {
    /// Reads each element that tells a series as an object, at any depth.
    fn read_all(&mut self) -> Read<()> {
        loop {
            match self.pull.next()? {
                Piece::Open(tag) => self.read_placed(&tag)?,
                Piece::Close | Piece::Text(_) | Piece::Kept(_) => {}
                Piece::End => return Ok(()),
            }
        }
    }

    fn read_placed(&mut self, tag: &Tag<'a>) -> Read<()> {
        let Some(series) = &tag.series else { return Ok(()) };
        let Some(info) = type_in(series, tag.name) else {
            self.warn_unknown(tag);
            return self.pull.skip();
        };
        self.pull.take(info.size)?;
        let mut object = (info.default)();
        self.pull.take(object.apart())?;
        self.read_object(object.as_mut())?;
        self.pull.memory.grow(&mut self.found.objects).or_else(|full| self.pull.full(full))?;
        self.found.objects.push(Placed { object, line: tag.line, time: tag.time });
        Ok(())
    }

    /// Notes what is passed over, or counts it where there is no memory left for it.
    fn warn(&mut self, line: usize, kind: WarningKind) {
        if self.make_room_to_warn(kind.apart()).is_ok() {
            self.found.warnings.push(Warning { line, kind });
        } else {
            self.found.more_warnings += 1;
        }
    }

    /// Accounts for a warning that takes `apart` bytes beside itself.
    fn make_room_to_warn(&mut self, apart: usize) -> Result<(), Full> {
        let count = self.found.warnings.len();
        let (more, moved) = match self.found.warnings.capacity() {
            room if room == count => (count / 4 + 1, count),
            _ => (0, 0),
        };
        let bytes = apart + (moved + more) * size_of::<Warning>();
        self.for_warnings.take(bytes)?;
        self.pull.memory.take(bytes)?;
        self.found.warnings.reserve_exact(more);
        self.for_warnings.give_back(moved * size_of::<Warning>());
        self.pull.memory.give_back(moved * size_of::<Warning>());
        Ok(())
    }

    fn warn_unknown(&mut self, tag: &Tag<'a>) {
        let series = tag.series.clone().unwrap_or_default();
        self.warn(tag.line, WarningKind::UnknownType { series, name: shown(tag.name) });
    }

    fn warn_surplus(&mut self, field: &'static FieldInfo, tag: &Tag<'a>) {
        self.warn(tag.line, WarningKind::Surplus { field: field.name, name: shown(tag.name) });
    }

    fn read_object(&mut self, object: &mut dyn Object) -> Read<()> {
        let info = object.type_info();
        while let Some(tag) = self.pull.next_child()? {
            match (info.field(tag.name), object.slot(tag.name)) {
                (Some(field), Some(slot)) => self.read_field(field, slot, &tag)?,
                _ => {
                    let field = shown(tag.name);
                    self.warn(tag.line, WarningKind::UnknownField { info: info.full_name, field });
                    self.pull.skip()?;
                }
            }
        }
        Ok(())
    }

    fn read_field(&mut self, field: &'static FieldInfo, slot: Slot<'_>, tag: &Tag<'a>) -> Read<()> {
        match (slot, field.kind) {
            (Slot::Object(reference), Kind::Object(declared)) => {
                self.read_reference(field, declared, reference)
            }
            (Slot::List(list), Kind::List(kind, _)) => self.read_list(field, kind, list),
            (slot, _) => self.read_primitive(field, slot, tag, true).map(drop),
        }
    }

    /// A field that holds an object has it as its one child; without any it keeps its default.
    fn read_reference(
        &mut self,
        field: &'static FieldInfo,
        declared: &'static TypeInfo,
        reference: &mut dyn Reference,
    ) -> Read<()> {
        let mut is_first = true;
        while let Some(tag) = self.pull.next_child()? {
            if std::mem::take(&mut is_first) {
                self.read_held(field, declared, reference, &tag)?;
            } else {
                self.warn_surplus(field, &tag);
                self.pull.skip()?;
            }
        }
        Ok(())
    }

    /// Reads an object or a null; false when it is passed over.
    fn read_held(
        &mut self,
        field: &'static FieldInfo,
        declared: &'static TypeInfo,
        reference: &mut dyn Reference,
        tag: &Tag<'a>,
    ) -> Read<bool> {
        if tag.name == NULL {
            reference.clear();
            return self.pull.skip().map(|()| true);
        }
        let info = match &tag.series {
            Some(series) => type_in(series, tag.name),
            None => descendants(declared).find(|info| info.name == tag.name),
        };
        let Some(info) = info else {
            self.warn_unknown(tag);
            return self.pull.skip().map(|()| false);
        };
        self.pull.take(reference.size_apart(info))?;
        let Some(object) = reference.make(info) else {
            self.warn(tag.line, WarningKind::Kind { field: field.name, info: info.full_name });
            return self.pull.skip().map(|()| false);
        };
        self.pull.take(object.apart())?;
        self.read_object(object).map(|()| true)
    }

    /// Elements that are passed over leave no gap.
    fn read_list(&mut self, field: &'static FieldInfo, kind: &Kind, list: &mut dyn List) -> Read<()> {
        list.truncate(0);
        let mut index = 0;
        while let Some(tag) = self.pull.next_child()? {
            self.make_room(list, index)?;
            let read = match (list.place(index), kind) {
                (None, _) => {
                    self.warn_surplus(field, &tag);
                    self.pull.skip()?;
                    continue;
                }
                (Some(Slot::Object(reference)), Kind::Object(declared)) => {
                    self.read_held(field, declared, reference, &tag)?
                }
                (Some(slot), _) => self.read_primitive(field, slot, &tag, false)?,
            };
            if read {
                index += 1;
            } else {
                list.truncate(index);
            }
        }
        Ok(())
    }

    /// Makes room for the element at `index`, and a quarter more.
    fn make_room(&mut self, list: &mut dyn List, index: usize) -> Read<()> {
        if index == list.room() && list.element_size() > 0 {
            let more = index / 4 + 1;
            self.pull.take((index + more) * list.element_size())?;
            list.reserve(more);
            self.pull.memory.give_back(index * list.element_size());
        }
        Ok(())
    }

    /// Reads a value from the element's text; false when it is passed over. A field without text is one that is not
    /// there, unless it is a text.
    fn read_primitive(
        &mut self,
        field: &'static FieldInfo,
        slot: Slot<'_>,
        tag: &Tag<'a>,
        may_be_empty: bool,
    ) -> Read<bool> {
        let text = self.pull.text()?;
        let copy = if let Cow::Owned(copy) = &text { copy.capacity() } else { 0 };
        let text = text.as_ref();
        if may_be_empty && text.is_empty() && !matches!(slot, Slot::Text(_)) {
            self.pull.memory.give_back(copy);
            return Ok(false);
        }
        let read = match slot {
            Slot::Bool(value) => set(value, truth(text)),
            Slot::Byte(value) => set(value, integer(text)),
            Slot::Int32(value) => set(value, integer(text)),
            Slot::UInt32(value) => set(value, integer(text)),
            Slot::Int64(value) => set(value, integer(text)),
            Slot::Real32(value) => set(value, text.parse().ok()),
            Slot::Real64(value) => set(value, text.parse().ok()),
            Slot::Enum(value, info) => set(value, enumeration(text, info)),
            Slot::Text(value) => {
                self.pull.take(text_apart(text.len()))?;
                set(value, Some(text.into()))
            }
            Slot::Object(_) | Slot::List(_) => false,
        };
        if !read {
            self.warn(tag.line, WarningKind::Value { field: field.name, text: shown(text) });
        }
        self.pull.memory.give_back(copy);
        Ok(read)
    }
}

fn set<T>(place: &mut T, value: Option<T>) -> bool {
    let found = value.is_some();
    if let Some(value) = value {
        *place = value;
    }
    found
}

fn truth(text: &str) -> Option<bool> {
    match text {
        "1" => Some(true),
        "0" => Some(false),
        _ if text.eq_ignore_ascii_case("true") => Some(true),
        _ if text.eq_ignore_ascii_case("false") => Some(false),
        _ => None,
    }
}

/// An integer, also one that is written as a real number without a fraction.
fn integer<T: FromStr + TryFrom<i64>>(text: &str) -> Option<T> {
    text.parse().ok().or_else(|| {
        let (whole, fraction) = text.split_once('.')?;
        let whole = if fraction.bytes().all(|digit| digit == b'0') { whole } else { return None };
        T::try_from(whole.parse().ok()?).ok()
    })
}

fn enumeration(text: &str, info: &EnumInfo) -> Option<i32> {
    info.value_of(text).or_else(|| text.parse().ok())
}
