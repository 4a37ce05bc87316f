//! What a message model says of its series, structs, fields and enumerations, as constants.

use std::fmt;

use super::object::Object;
use super::reader::{Decoded, HEADER, Reader};

/// The name of a series as the wire carries it: up to eight ASCII characters, zero padded, as one
/// big-endian number.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SeriesName(pub u64);

impl SeriesName {
    /// The name of at most eight ASCII characters.
    ///
    /// # Panics
    /// When `name` is longer than eight bytes; in a constant this is a compile error.
    pub const fn new(name: &str) -> Self {
        let text = name.as_bytes();
        assert!(text.len() <= 8, "a series name has at most eight characters");
        let mut padded = [0; 8];
        let mut i = 0;
        while i < text.len() {
            padded[i] = text[i];
            i += 1;
        }
        Self(u64::from_be_bytes(padded))
    }
}

impl fmt::Display for SeriesName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let padded = self.0.to_be_bytes();
        let length = padded.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1);
        write!(f, "{}", padded[..length].escape_ascii())
    }
}

impl fmt::Debug for SeriesName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}")
    }
}

/// A series of message types that share a version.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Series {
    /// Its name on the wire and in the XML form, such as `CMASI`.
    pub name: SeriesName,
    /// The same name as text.
    pub text: &'static str,
    /// What precedes a type's name in its full name, such as `afrl.cmasi`.
    pub namespace: &'static str,
    /// The version whose types are declared here; no other one is decoded.
    pub version: u16,
}

impl Series {
    /// What an object of the type of that number begins with on the wire: its presence, the series,
    /// the number and the version.
    pub(super) const fn header(&self, type_id: u32) -> [u8; HEADER] {
        let [s0, s1, s2, s3, s4, s5, s6, s7] = self.name.0.to_be_bytes();
        let [t0, t1, t2, t3] = type_id.to_be_bytes();
        let [v0, v1] = self.version.to_be_bytes();
        [1, s0, s1, s2, s3, s4, s5, s6, s7, t0, t1, t2, t3, v0, v1]
    }
}

/// One message type: a struct of a series.
pub struct TypeInfo {
    /// The series that it belongs to.
    pub series: &'static Series,
    /// Its number on the wire: the position in its series, counted from 1.
    pub id: u32,
    /// Its name in its series, such as `AirVehicleState`.
    pub name: &'static str,
    /// Its descriptor, such as `afrl.cmasi.AirVehicleState`.
    pub full_name: &'static str,
    /// The type whose fields precede its own.
    pub parent: Option<&'static TypeInfo>,
    /// Its own fields in wire order, without those of its parents.
    pub own_fields: &'static [FieldInfo],
    /// What an object of this type begins with on the wire.
    pub(super) header: [u8; HEADER],
    /// Bytes that an object of this type takes in memory, without what it holds elsewhere.
    pub size: usize,
    /// Makes an object of this type, every field at its default.
    pub default: fn() -> Box<dyn Object>,
}

impl TypeInfo {
    /// Whether this is `other` or descends from it.
    pub const fn is_a(&self, other: &TypeInfo) -> bool {
        let mut candidate = self;
        loop {
            if candidate.id == other.id && candidate.series.name.0 == other.series.name.0 {
                return true;
            }
            match candidate.parent {
                Some(parent) => candidate = parent,
                None => return false,
            }
        }
    }

    /// This type, its parent, the parent's parent, and so on.
    pub fn lineage(&'static self) -> impl Iterator<Item = &'static TypeInfo> {
        std::iter::successors(Some(self), |info| info.parent)
    }

    /// All fields in wire order: those of the first ancestor first, its own last.
    pub fn fields(&'static self) -> impl Iterator<Item = &'static FieldInfo> {
        let mut lineage: Vec<_> = self.lineage().collect();
        lineage.reverse();
        lineage.into_iter().flat_map(|info| info.own_fields)
    }

    /// The field of that name, own or inherited.
    pub fn field(&'static self, name: &str) -> Option<&'static FieldInfo> {
        self.lineage().flat_map(|info| info.own_fields).find(|field| field.name == name)
    }

    /// How many bytes of fields precede the field `name` of a type without a parent, when all of
    /// them have a fixed width.
    pub(super) const fn offset_of(&self, name: &str) -> Option<usize> {
        if self.parent.is_some() {
            return None;
        }
        let (mut offset, mut i) = (0, 0);
        while i < self.own_fields.len() && !same_text(self.own_fields[i].name, name) {
            match self.own_fields[i].kind.width() {
                Some(width) => offset += width,
                None => return None,
            }
            i += 1;
        }
        if i < self.own_fields.len() { Some(offset) } else { None }
    }

    /// The fewest bytes that all fields take.
    const fn size_min(&self) -> usize {
        let mut size = match self.parent {
            Some(parent) => parent.size_min(),
            None => 0,
        };
        let mut i = 0;
        while i < self.own_fields.len() {
            size += self.own_fields[i].kind.size_min();
            i += 1;
        }
        size
    }
}

/// Fields of fixed width that follow one another, from a field on that begins such a row.
pub(super) struct Run {
    fields: &'static [FieldInfo],
    first: usize,
    width: usize,
}

impl Run {
    /// The run that the own field `name` begins; of width 0 where it begins none.
    pub(super) const fn at(info: &TypeInfo, name: &str) -> Self {
        let fields = info.own_fields;
        let mut first = 0;
        while !same_text(fields[first].name, name) {
            first += 1;
        }
        let (mut width, mut i) = (0, first);
        if first == 0 || fields[first - 1].kind.width().is_none() {
            while i < fields.len()
                && let Some(field) = fields[i].kind.width()
            {
                width += field;
                i += 1;
            }
        }
        Self { fields, first, width }
    }

    /// Checks at once that all of it is there, so that its fields are read without a check of each.
    #[inline(always)]
    pub(super) fn check(&self, reader: &mut Reader<'_>) -> Decoded<()> {
        reader.run(self.width, self.fields, self.first)
    }
}

impl PartialEq for TypeInfo {
    fn eq(&self, other: &Self) -> bool {
        self.id == other.id && self.series.name == other.series.name
    }
}

impl Eq for TypeInfo {}

impl fmt::Display for TypeInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.full_name)
    }
}

impl fmt::Debug for TypeInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.full_name)
    }
}

/// One field of a type.
#[derive(Debug, Clone, Copy)]
pub struct FieldInfo {
    /// Its name in the model, such as `NominalSpeed`.
    pub name: &'static str,
    /// Its unit, such as `m/s`; empty where the model names none.
    pub unit: &'static str,
    /// What it holds.
    pub kind: Kind,
}

/// What a field or an array element holds.
#[derive(Debug, Clone, Copy)]
pub enum Kind {
    /// A truth value in one byte, 0 or 1.
    Bool,
    /// An unsigned 8-bit number.
    Byte,
    /// A signed 32-bit number.
    Int32,
    /// An unsigned 32-bit number.
    UInt32,
    /// A signed 64-bit number.
    Int64,
    /// A 32-bit floating-point number.
    Real32,
    /// A 64-bit floating-point number.
    Real64,
    /// A 32-bit number that stands for a name.
    Enum(&'static EnumInfo),
    /// UTF-8 text of at most 65 535 bytes.
    Text,
    /// An object of this type or of one that descends from it, or none.
    Object(&'static TypeInfo),
    /// Several of one kind.
    List(&'static Kind, Count),
}

impl Kind {
    /// The name of a primitive kind in the model and in the XML form; none for objects and lists.
    pub fn name(&self) -> Option<&'static str> {
        match self {
            Self::Bool => Some("bool"),
            Self::Byte => Some("byte"),
            Self::Int32 => Some("int32"),
            Self::UInt32 => Some("uint32"),
            Self::Int64 => Some("int64"),
            Self::Real32 => Some("real32"),
            Self::Real64 => Some("real64"),
            Self::Text => Some("string"),
            Self::Enum(info) => Some(info.name),
            Self::Object(_) | Self::List(..) => None,
        }
    }

    /// How many bytes every value of this kind takes, when that is the same for all.
    pub const fn width(&self) -> Option<usize> {
        match self {
            Self::Bool | Self::Byte => Some(1),
            Self::Int32 | Self::UInt32 | Self::Real32 | Self::Enum(_) => Some(4),
            Self::Int64 | Self::Real64 => Some(8),
            Self::List(element, Count::Fixed(count)) => match element.width() {
                Some(width) => Some(width * *count),
                None => None,
            },
            Self::Text | Self::Object(_) | Self::List(..) => None,
        }
    }

    /// The fewest bytes that a value of this kind takes.
    pub(super) const fn size_min(&self) -> usize {
        match self {
            Self::Object(_) => 1,
            Self::Text | Self::List(_, Count::U16) => 2,
            Self::List(_, Count::U32) => 4,
            Self::List(element, Count::Fixed(count)) => element.size_min() * *count,
            _ => match self.width() {
                Some(width) => width,
                None => panic!("all other kinds have a width"),
            },
        }
    }

    /// The fewest bytes that a value of this kind takes if it is not null.
    pub(super) const fn size_full(&self) -> usize {
        match self {
            Self::Object(info) => HEADER + info.size_min(),
            _ => self.size_min(),
        }
    }
}

/// How a list tells its number of elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Count {
    /// In a u16 before the first element.
    U16,
    /// In a u32 before the first element: what the model calls a large array.
    U32,
    /// Not at all: the model fixes it.
    Fixed(usize),
}

/// An enumeration of the model.
#[derive(Debug, PartialEq, Eq)]
pub struct EnumInfo {
    /// Its name, such as `AltitudeType`.
    pub name: &'static str,
    /// The declared names with their numbers, in the model's order.
    pub values: &'static [(&'static str, i32)],
}

impl EnumInfo {
    /// The name that the model gives to `value`.
    pub fn name_of(&self, value: i32) -> Option<&'static str> {
        self.values.iter().find(|(_, number)| *number == value).map(|(name, _)| *name)
    }

    /// The number of that name.
    pub fn value_of(&self, name: &str) -> Option<i32> {
        self.values.iter().find(|(declared, _)| *declared == name).map(|(_, number)| *number)
    }
}

/// `==` on text, for constants.
const fn same_text(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    if a.len() != b.len() {
        return false;
    }
    let mut i = 0;
    while i < a.len() {
        if a[i] != b[i] {
            return false;
        }
        i += 1;
    }
    true
}
