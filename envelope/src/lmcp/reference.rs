//! References to objects: null, of the declared type, or of one that descends from it.

use std::fmt;

use super::error::DecodeFault;
use super::object::{Object, Struct};
use super::reader::{Decoded, Header, Reader};
use super::schema::{Kind, TypeInfo};
use super::value::{Reference, Slot, Value, View};
use super::writer::{Encoded, Writer};

/// A field for an object of type `T` or of one that descends from it, or null.
#[derive(Clone)]
pub struct Ref<T: Struct>(Content<T>);

/// An object of the very type stands in line, as most do, or where the type's declaration says; those of descending
/// types are boxed.
#[derive(Clone)]
enum Content<T: Struct> {
    Null,
    Exact(T::Place),
    Descendant(Box<dyn Object>),
}

/// How a field holds an object of the type that it declares.
pub trait Place<T> {
    /// Bytes beside the field itself.
    const APART: usize;
    /// Puts an object in.
    fn from_box(object: Box<T>) -> Self;
    /// The object.
    fn get(&self) -> &T;
    /// The object, to be changed.
    fn get_mut(&mut self) -> &mut T;
}

/// In line: without a box, where objects of the very type are usual.
#[derive(Clone, Debug, Default)]
pub struct Inline<T>(T);

impl<T> Place<T> for Inline<T> {
    const APART: usize = 0;
    fn from_box(object: Box<T>) -> Self {
        Self(*object)
    }
    #[inline]
    fn get(&self) -> &T {
        &self.0
    }
    #[inline]
    fn get_mut(&mut self) -> &mut T {
        &mut self.0
    }
}

impl<T> Place<T> for Box<T> {
    const APART: usize = size_of::<T>();
    fn from_box(object: Self) -> Self {
        object
    }
    #[inline]
    fn get(&self) -> &T {
        self
    }
    #[inline]
    fn get_mut(&mut self) -> &mut T {
        self
    }
}

impl<T: Struct> Ref<T> {
    /// No object.
    pub const NULL: Self = Self(Content::Null);

    /// A reference to `object`, whose type is `T` or descends from it; any other one does not compile.
    pub fn new<D: Struct>(object: D) -> Self {
        const { assert!(D::TYPE.is_a(T::TYPE), "the field does not hold this type") };
        let mut reference = Self::NULL;
        let put = reference.put(Box::new(object));
        debug_assert!(put.is_ok(), "checked at compile time");
        reference
    }

    /// The object as a `T`, of whatever descending type it is.
    pub fn get(&self) -> Option<&T> {
        match &self.0 {
            Content::Null => None,
            Content::Exact(place) => Some(place.get()),
            Content::Descendant(object) => object.get(),
        }
    }

    /// The object as a `T`, to be changed.
    pub fn get_mut(&mut self) -> Option<&mut T> {
        match &mut self.0 {
            Content::Null => None,
            Content::Exact(place) => Some(place.get_mut()),
            Content::Descendant(object) => object.get_mut(),
        }
    }

    /// The object as what it is.
    pub fn object(&self) -> Option<&dyn Object> {
        match &self.0 {
            Content::Null => None,
            Content::Exact(place) => Some(place.get()),
            Content::Descendant(object) => Some(object.as_ref()),
        }
    }

    /// Whether there is no object.
    pub fn is_null(&self) -> bool {
        matches!(self.0, Content::Null)
    }

    /// Reads an object of the very type. All fields are read, so what one is there holds does not matter.
    #[inline]
    fn decode_exact(&mut self, reader: &mut Reader<'_>) -> Decoded<()> {
        reader.allocate(T::Place::APART)?;
        if !matches!(self.0, Content::Exact(_)) {
            self.0 = Content::Exact(T::Place::default());
        }
        match &mut self.0 {
            Content::Exact(place) => place.get_mut().decode_fields(reader),
            Content::Null | Content::Descendant(_) => Ok(()),
        }
    }
}

/// Reads the fields of an object that is not of the very type declared, but must descend from it.
fn decode_descendant(
    header: Header,
    declared: &'static TypeInfo,
    reader: &mut Reader<'_>,
) -> Decoded<Box<dyn Object>> {
    let info = header.type_info().or_else(|fault| reader.fail_header(fault))?;
    if !info.is_a(declared) {
        let (expected, found) = (declared.full_name, info.full_name);
        return reader.fail_header(DecodeFault::Kind { expected, found });
    }
    let mut object = (info.default)();
    reader.allocate(size_of_val(object.as_ref()))?;
    object.decode_fields(reader)?;
    Ok(object)
}

impl<T: Struct> Value for Ref<T> {
    const KIND: Kind = Kind::Object(T::TYPE);
    fn blank() -> Self {
        Self::NULL
    }
    fn decode(&mut self, reader: &mut Reader<'_>) -> Decoded<()> {
        if reader.skip(&T::TYPE.header) {
            return reader.nested(|reader| self.decode_exact(reader));
        }
        self.0 = match reader.header()? {
            Some(header) => {
                Content::Descendant(reader.nested(|reader| decode_descendant(header, T::TYPE, reader))?)
            }
            None => Content::Null,
        };
        Ok(())
    }
    fn encode(&self, writer: &mut Writer<'_>) -> Encoded {
        match self.object() {
            Some(object) => writer.object(object),
            None => writer.null(),
        }
    }
    fn view(&self) -> View<'_> {
        View::Object(self.object())
    }
    fn slot(&mut self) -> Slot<'_> {
        Slot::Object(self)
    }
    fn apart(&self) -> usize {
        self.object().map_or(0, |object| self.size_apart(object.type_info()) + object.apart())
    }
}

impl<T: Struct> Reference for Ref<T> {
    fn clear(&mut self) {
        self.0 = Content::Null;
    }
    fn put(&mut self, object: Box<dyn Object>) -> Result<(), Box<dyn Object>> {
        if !object.is_a(T::TYPE) {
            return Err(object);
        }
        self.0 = match object.downcast() {
            Ok(exact) => Content::Exact(T::Place::from_box(exact)),
            Err(descendant) => Content::Descendant(descendant),
        };
        Ok(())
    }
    fn make(&mut self, info: &'static TypeInfo) -> Option<&mut dyn Object> {
        if !info.is_a(T::TYPE) {
            return None;
        }
        self.0 = if info == T::TYPE {
            Content::Exact(T::Place::default())
        } else {
            Content::Descendant((info.default)())
        };
        match &mut self.0 {
            Content::Null => None,
            Content::Exact(place) => Some(place.get_mut()),
            Content::Descendant(object) => Some(object.as_mut()),
        }
    }
    fn size_apart(&self, info: &TypeInfo) -> usize {
        if info == T::TYPE { T::Place::APART } else { info.size }
    }
}

/// An object of the declared type with every field at its default, as the reference has it for what
/// the model does not call optional.
impl<T: Struct> Default for Ref<T> {
    fn default() -> Self {
        Self(Content::Exact(T::Place::default()))
    }
}

impl<T: Struct, D: Struct> From<D> for Ref<T> {
    fn from(object: D) -> Self {
        Self::new(object)
    }
}

impl<T: Struct> PartialEq for Ref<T> {
    fn eq(&self, other: &Self) -> bool {
        self.object() == other.object()
    }
}

impl<T: Struct> fmt::Debug for Ref<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.view().fmt(f)
    }
}
