//! Types of DDS as data: what an IDL file says of them, and what the built-in types of UMAA say of themselves.
//!
//! A [`Library`] holds definitions by their fully scoped names (`UMAA::SO::HealthReport::HealthReportType`) and is sound: every
//! name in it is known, nothing is inside itself, keys are never absent (DDS-XTypes 1.3, 7.2.2). What reads and writes samples
//! by it is [`crate::codec::cdr`].

mod check;
mod error;
mod key;
mod library;
#[cfg(test)]
mod tests;
mod weight;

pub use error::{DescriptionError, Fault};
pub use key::KeyMember;
pub use library::{Draft, Library, Resolved};

use std::fmt;

/// The deepest nesting of types: far above any type of UMAA, and low enough that no walk runs out of stack.
pub const DEPTH_MAX: usize = 64;

/// The most elements of an array, over all its dimensions.
pub const ARRAY_ELEMENTS_MAX: u64 = 1 << 24;

/// The most members of a type, those of nested structures counted one by one.
pub const MEMBERS_MAX: u64 = 1 << 16;

/// The highest id of a member (DDS-XTypes 1.3, 7.3.1.2.1: 28 bits).
pub const MEMBER_ID_MAX: u32 = 0x0fff_ffff;

/// The type of a member, an element or a discriminator.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs, reason = "the plain types are those of IDL 4.2 by their names")]
pub enum Type {
    Boolean,
    Octet,
    Char8,
    Char16,
    Int8,
    UInt8,
    Int16,
    UInt16,
    Int32,
    UInt32,
    Int64,
    UInt64,
    Float32,
    Float64,
    /// A text in UTF-8; the bound is in bytes, without the terminator.
    String {
        bound: Option<u32>,
    },
    /// A text in UTF-16; the bound is in units of 16 bits.
    WideString {
        bound: Option<u32>,
    },
    /// So many elements as there are, or at most the bound.
    Sequence {
        element: Box<Type>,
        bound: Option<u32>,
    },
    /// A fixed number of elements; the last dimension runs fastest.
    Array {
        element: Box<Type>,
        dimensions: Vec<u32>,
    },
    /// A definition by its fully scoped name.
    Named(String),
}

impl Type {
    /// A definition by its name.
    pub fn named(name: impl Into<String>) -> Self {
        Self::Named(name.into())
    }

    /// A sequence of elements.
    pub fn sequence(element: Self, bound: Option<u32>) -> Self {
        Self::Sequence { element: Box::new(element), bound }
    }

    /// An array of one dimension.
    pub fn array(element: Self, length: u32) -> Self {
        Self::Array { element: Box::new(element), dimensions: vec![length] }
    }

    /// The size of a value in bytes, for the types of one number.
    pub fn primitive_size(&self) -> Option<usize> {
        match self {
            Self::Boolean | Self::Octet | Self::Char8 | Self::Int8 | Self::UInt8 => Some(1),
            Self::Char16 | Self::Int16 | Self::UInt16 => Some(2),
            Self::Int32 | Self::UInt32 | Self::Float32 => Some(4),
            Self::Int64 | Self::UInt64 | Self::Float64 => Some(8),
            _ => None,
        }
    }
}

/// The type as IDL writes it.
impl fmt::Display for Type {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bounded = |f: &mut fmt::Formatter<'_>, name: &str, bound: &Option<u32>| match bound {
            Some(bound) => write!(f, "{name}<{bound}>"),
            None => f.write_str(name),
        };
        f.write_str(match self {
            Self::Boolean => "boolean",
            Self::Octet => "octet",
            Self::Char8 => "char",
            Self::Char16 => "wchar",
            Self::Int8 => "int8",
            Self::UInt8 => "uint8",
            Self::Int16 => "short",
            Self::UInt16 => "unsigned short",
            Self::Int32 => "long",
            Self::UInt32 => "unsigned long",
            Self::Int64 => "long long",
            Self::UInt64 => "unsigned long long",
            Self::Float32 => "float",
            Self::Float64 => "double",
            Self::Named(name) => name,
            Self::String { bound } => return bounded(f, "string", bound),
            Self::WideString { bound } => return bounded(f, "wstring", bound),
            Self::Sequence { element, bound: None } => return write!(f, "sequence<{element}>"),
            Self::Sequence { element, bound: Some(bound) } => {
                return write!(f, "sequence<{element}, {bound}>");
            }
            Self::Array { element, dimensions } => {
                write!(f, "{element}")?;
                return dimensions.iter().try_for_each(|length| write!(f, "[{length}]"));
            }
        })
    }
}

/// How a type may grow from one version to the next (DDS-XTypes 1.3, 7.2.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Extensibility {
    /// Not at all.
    Final,
    /// Members are added at its end. What is not annotated is so.
    #[default]
    Appendable,
    /// Members come in any order, each with its id.
    Mutable,
}

/// A member of a structure, or of a case of a union.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Member {
    /// Its id, unique in the type and those that it inherits from.
    pub id: u32,
    /// Its name, unique likewise.
    pub name: String,
    /// Its type.
    pub r#type: Type,
    /// Whether it is part of the key.
    pub key: bool,
    /// Whether it may be absent.
    pub optional: bool,
    /// Whether a reader that does not know it must refuse the sample.
    pub must_understand: bool,
}

impl Member {
    /// A member that is always there and no part of the key.
    pub fn new(id: u32, name: impl Into<String>, r#type: Type) -> Self {
        Self { id, name: name.into(), r#type, key: false, optional: false, must_understand: false }
    }

    /// The same as a part of the key.
    pub fn key(self) -> Self {
        Self { key: true, ..self }
    }

    /// The same as one that may be absent.
    pub fn optional(self) -> Self {
        Self { optional: true, ..self }
    }
}

/// An enumeration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Enumeration {
    /// Bits of a value on the wire: 1 to 8 take a byte, to 16 two, to 32 four. 32 where nothing is annotated.
    pub bit_bound: u16,
    /// Whether values may be added.
    pub extensibility: Extensibility,
    /// The values with their names, in the order of their declaration.
    pub literals: Vec<(String, i32)>,
    /// The value that is taken where none is given; the first where nothing is annotated.
    pub default: Option<i32>,
}

impl Enumeration {
    /// An enumeration of 32 bits whose values count from 0.
    pub fn counted<'a>(names: impl IntoIterator<Item = &'a str>) -> Self {
        let literals = names.into_iter().map(str::to_owned).zip(0..).collect();
        Self { bit_bound: 32, extensibility: Extensibility::default(), literals, default: None }
    }

    /// The name of a value.
    pub fn name_of(&self, value: i32) -> Option<&str> {
        self.literals.iter().find(|(_, known)| *known == value).map(|(name, _)| name.as_str())
    }

    /// Bytes of a value on the wire.
    pub fn size(&self) -> usize {
        match self.bit_bound {
            ..=8 => 1,
            9..=16 => 2,
            _ => 4,
        }
    }
}

/// A set of named bits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bitmask {
    /// Bits on the wire: up to 8 take a byte, to 16 two, to 32 four, to 64 eight. 32 where nothing is annotated.
    pub bit_bound: u16,
    /// Whether bits may be added.
    pub extensibility: Extensibility,
    /// The bits' names with their places, from 0.
    pub flags: Vec<(String, u16)>,
}

impl Bitmask {
    /// Bytes of a value on the wire.
    pub fn size(&self) -> usize {
        match self.bit_bound {
            ..=8 => 1,
            9..=16 => 2,
            17..=32 => 4,
            _ => 8,
        }
    }
}

/// A structure.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Structure {
    /// How it may grow; the same as that of what it inherits from.
    pub extensibility: Extensibility,
    /// The structure whose members come before its own.
    pub base: Option<String>,
    /// Its own members in the order of their declaration.
    pub members: Vec<Member>,
}

/// A case of a union.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Case {
    /// The values of the discriminator that choose it.
    pub labels: Vec<i64>,
    /// Whether it is also chosen by what no case names.
    pub default: bool,
    /// What it holds; never a key and never optional.
    pub member: Member,
}

/// A union: one of several members, chosen by a discriminator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Union {
    /// How it may grow.
    pub extensibility: Extensibility,
    /// The discriminator's type: a boolean, an octet, a character, a whole number or an enumeration.
    pub discriminator: Type,
    /// Whether the discriminator is a key.
    pub key: bool,
    /// The cases in the order of their declaration.
    pub cases: Vec<Case>,
}

impl Union {
    /// The case that a discriminator chooses; none where the union is empty then.
    pub fn case_of(&self, discriminator: i64) -> Option<&Case> {
        let named = self.cases.iter().find(|case| case.labels.contains(&discriminator));
        named.or_else(|| self.cases.iter().find(|case| case.default))
    }
}

/// What a name stands for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Definition {
    /// One of some named values.
    Enumeration(Enumeration),
    /// Any of some named bits.
    Bitmask(Bitmask),
    /// Members together.
    Structure(Structure),
    /// One of some members.
    Union(Union),
    /// Another name of a type.
    Alias(Type),
}

/// A topic: its name and the type of its samples.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Topic {
    /// The topic's name, as in `UMAA::SO::HealthReport::HealthReport`.
    pub name: String,
    /// The fully scoped name of its type.
    pub type_name: String,
}
