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
pub struct Ref<T>(Content<T>);

/// An object of the very type stands in line, as most do; only those of descending types are boxed.
#[derive(Clone)]
enum Content<T> {
    Null,
    Exact(T),
    Descendant(Box<dyn Object>),
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
            Content::Exact(object) => Some(object),
            Content::Descendant(object) => object.get(),
        }
    }

    /// The object as a `T`, to be changed.
    pub fn get_mut(&mut self) -> Option<&mut T> {
        match &mut self.0 {
            Content::Null => None,
            Content::Exact(object) => Some(object),
            Content::Descendant(object) => object.get_mut(),
        }
    }

    /// The object as what it is.
    pub fn object(&self) -> Option<&dyn Object> {
        match &self.0 {
            Content::Null => None,
            Content::Exact(object) => Some(object),
            Content::Descendant(object) => Some(object.as_ref()),
        }
    }

    /// Whether there is no object.
    pub fn is_null(&self) -> bool {
        matches!(self.0, Content::Null)
    }

    fn decode_exact(&mut self, reader: &mut Reader<'_>) -> Decoded<()> {
        self.0 = Content::Exact(T::default());
        match &mut self.0 {
            Content::Exact(object) => object.decode_fields(reader),
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
        self.0 = Content::Null;
        if reader.skip(&T::TYPE.header) {
            return reader.nested(|reader| self.decode_exact(reader));
        }
        if let Some(header) = reader.header()? {
            let object = reader.nested(|reader| decode_descendant(header, T::TYPE, reader))?;
            self.0 = Content::Descendant(object);
        }
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
            Ok(exact) => Content::Exact(*exact),
            Err(descendant) => Content::Descendant(descendant),
        };
        Ok(())
    }
}

/// An object of the declared type with every field at its default, as the reference has it for what
/// the model does not call optional.
impl<T: Struct> Default for Ref<T> {
    fn default() -> Self {
        Self(Content::Exact(T::default()))
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
