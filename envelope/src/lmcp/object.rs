//! Objects of any type, and what is the same for all of them.

use std::any::Any;
use std::fmt;

use super::reader::{Decoded, Reader};
use super::reference::Place;
use super::schema::{FieldInfo, TypeInfo};
use super::value::{List, Slot, View};
use super::writer::{Encoded, Writer};

/// An object of one of the declared types. What is implemented by each type is here; what follows
/// from it, below.
pub trait Object: Any + fmt::Debug + Send + Sync {
    /// Its type.
    fn type_info(&self) -> &'static TypeInfo;
    /// The part of it that its parent type declares.
    fn base(&self) -> Option<&dyn Object>;
    /// The part of it that its parent type declares, to be changed.
    fn base_mut(&mut self) -> Option<&mut dyn Object>;
    /// The field of that name in the model, own or inherited.
    fn view(&self, field: &str) -> Option<View<'_>>;
    /// The field of that name in the model, own or inherited, to be set.
    fn slot(&mut self, field: &str) -> Option<Slot<'_>>;
    /// Reads all fields, inherited ones first.
    ///
    /// # Errors
    /// Names the fault, the byte and the field.
    fn decode_fields(&mut self, reader: &mut Reader<'_>) -> Decoded<()>;
    /// Writes all fields, inherited ones first.
    ///
    /// # Errors
    /// Names the field that the wire cannot carry.
    fn encode_fields(&self, writer: &mut Writer<'_>) -> Encoded;
    /// Bytes of memory that it takes beside itself: what its fields hold in boxes, lists and long texts.
    fn apart(&self) -> usize;
    /// A copy in a box.
    fn clone_box(&self) -> Box<dyn Object>;
}

/// A declared type, known at compile time.
pub trait Struct: Object + Clone + Default {
    /// How a field holds an object of this type: in line, or behind a pointer.
    type Place: Clone + fmt::Debug + Default + Send + Sync + Place<Self>;
    /// What the model says of it.
    const TYPE: &'static TypeInfo;
}

impl dyn Object {
    /// Whether its type is `info` or descends from it.
    pub fn is_a(&self, info: &TypeInfo) -> bool {
        self.type_info().is_a(info)
    }

    /// Itself as a `T`: its own type, or one that it descends from.
    pub fn get<T: Struct>(&self) -> Option<&T> {
        let any: &dyn Any = self;
        any.downcast_ref().or_else(|| self.base()?.get())
    }

    /// Itself as a `T`, to be changed: its own type, or one that it descends from.
    pub fn get_mut<T: Struct>(&mut self) -> Option<&mut T> {
        if self.type_info() != T::TYPE {
            return self.base_mut()?.get_mut();
        }
        let any: &mut dyn Any = self;
        any.downcast_mut()
    }

    /// Itself as its own type `T`; given back when it is of another one.
    ///
    /// # Errors
    /// The object, unchanged.
    pub fn downcast<T: Struct>(self: Box<Self>) -> Result<Box<T>, Box<dyn Object>> {
        if self.type_info() != T::TYPE {
            return Err(self);
        }
        let any: Box<dyn Any> = self;
        any.downcast().map_err(|_| unreachable!("one Rust type for one type of the model"))
    }

    /// All fields with their values, in wire order.
    pub fn fields(&self) -> impl Iterator<Item = (&'static FieldInfo, View<'_>)> {
        self.type_info().fields().filter_map(|field| Some((field, self.view(field.name)?)))
    }
}

impl Clone for Box<dyn Object> {
    fn clone(&self) -> Self {
        self.as_ref().clone_box()
    }
}

/// Same type and same values; floating-point numbers compare as such, so a NaN equals nothing.
impl PartialEq for dyn Object {
    fn eq(&self, other: &Self) -> bool {
        self.type_info() == other.type_info()
            && self.fields().zip(other.fields()).all(|((_, a), (_, b))| a == b)
    }
}

impl PartialEq for View<'_> {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Bool(a), Self::Bool(b)) => a == b,
            (Self::Byte(a), Self::Byte(b)) => a == b,
            (Self::Int32(a), Self::Int32(b)) | (Self::Enum(a, _), Self::Enum(b, _)) => a == b,
            (Self::UInt32(a), Self::UInt32(b)) => a == b,
            (Self::Int64(a), Self::Int64(b)) => a == b,
            (Self::Real32(a), Self::Real32(b)) => a == b,
            (Self::Real64(a), Self::Real64(b)) => a == b,
            (Self::Text(a), Self::Text(b)) => a == b,
            (Self::Object(a), Self::Object(b)) => a == b,
            (Self::List(a), Self::List(b)) => a.length() == b.length() && elements(*a).eq(elements(*b)),
            _ => false,
        }
    }
}

/// The elements of a list, first to last.
pub(super) fn elements(list: &dyn List) -> impl Iterator<Item = View<'_>> {
    (0..list.length()).filter_map(|index| list.element(index))
}

impl fmt::Debug for View<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(value) => value.fmt(f),
            Self::Byte(value) => value.fmt(f),
            Self::Int32(value) => value.fmt(f),
            Self::UInt32(value) => value.fmt(f),
            Self::Int64(value) => value.fmt(f),
            Self::Real32(value) => value.fmt(f),
            Self::Real64(value) => value.fmt(f),
            Self::Enum(value, info) => match info.name_of(*value) {
                Some(name) => f.write_str(name),
                None => write!(f, "{}({value})", info.name),
            },
            Self::Text(value) => value.fmt(f),
            Self::Object(Some(object)) => object.fmt(f),
            Self::Object(None) => f.write_str("null"),
            Self::List(list) => f.debug_list().entries(elements(*list)).finish(),
        }
    }
}

/// An object as `Name { Field: value, .. }`, with the model's names.
pub(super) fn debug(object: &dyn Object, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let mut shown = f.debug_struct(object.type_info().name);
    for (field, value) in object.fields() {
        shown.field(field.name, &value);
    }
    shown.finish()
}
