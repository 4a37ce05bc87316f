//! Values that a field may hold: how each is read, written, and seen by the text forms.

use super::error::DecodeFault;
use super::object::Object;
use super::reader::{Decoded, Reader};
use super::schema::{EnumInfo, Kind, TypeInfo};
use super::writer::{Encoded, Writer};

/// A text of an object. Up to 24 bytes stand in line, without a box: most keys, labels and names do.
pub type Text = compact_str::CompactString;

/// The longest text that stands in line.
const TEXT_INLINE: usize = size_of::<Text>();

/// What a longer text takes at least.
const TEXT_APART_MIN: usize = TEXT_INLINE + size_of::<usize>();

/// Bytes that a text of that length takes beside itself.
pub(super) fn text_apart(length: usize) -> usize {
    if length > TEXT_INLINE { length.max(TEXT_APART_MIN) } else { 0 }
}

/// A value that a field may hold. Floating-point numbers keep their bits, enumerations any number.
pub trait Value: Sized {
    /// What the schema says of it.
    const KIND: Kind;
    /// The value that an array element has before it is read.
    fn blank() -> Self;
    /// Reads it from the wire. Whatever is read is written back as the same bytes.
    fn decode(&mut self, reader: &mut Reader<'_>) -> Decoded<()>;
    /// Writes it to the wire.
    fn encode(&self, writer: &mut Writer<'_>) -> Encoded;
    /// Shows it.
    fn view(&self) -> View<'_>;
    /// Gives it to be set.
    fn slot(&mut self) -> Slot<'_>;
    /// Bytes of memory that it takes beside itself.
    fn apart(&self) -> usize {
        0
    }
}

/// A value seen without knowing its type.
#[derive(Clone, Copy)]
pub enum View<'a> {
    /// A truth value.
    Bool(bool),
    /// An unsigned 8-bit number.
    Byte(u8),
    /// A signed 32-bit number.
    Int32(i32),
    /// An unsigned 32-bit number.
    UInt32(u32),
    /// A signed 64-bit number.
    Int64(i64),
    /// A 32-bit floating-point number.
    Real32(f32),
    /// A 64-bit floating-point number.
    Real64(f64),
    /// A number that stands for a name of the enumeration, if it is one of the declared.
    Enum(i32, &'static EnumInfo),
    /// A text.
    Text(&'a str),
    /// An object, or null.
    Object(Option<&'a dyn Object>),
    /// Several values of one kind.
    List(&'a dyn List),
}

/// A place for a value, without knowing its type beforehand.
pub enum Slot<'a> {
    /// A truth value.
    Bool(&'a mut bool),
    /// An unsigned 8-bit number.
    Byte(&'a mut u8),
    /// A signed 32-bit number.
    Int32(&'a mut i32),
    /// An unsigned 32-bit number.
    UInt32(&'a mut u32),
    /// A signed 64-bit number.
    Int64(&'a mut i64),
    /// A 32-bit floating-point number.
    Real32(&'a mut f32),
    /// A 64-bit floating-point number.
    Real64(&'a mut f64),
    /// A number that stands for a name of the enumeration, if it is one of the declared.
    Enum(&'a mut i32, &'static EnumInfo),
    /// A text.
    Text(&'a mut Text),
    /// An object, or null.
    Object(&'a mut dyn Reference),
    /// Several values of one kind.
    List(&'a mut dyn List),
}

/// An array, without knowing the type of its elements.
pub trait List {
    /// How many elements there are.
    fn length(&self) -> usize;
    /// The element at `index`.
    fn element(&self, index: usize) -> Option<View<'_>>;
    /// Removes the elements from `length` on, or makes those of a fixed array blank.
    fn truncate(&mut self, length: usize);
    /// The place of the element at `index`; the one after the last is appended. None beyond that,
    /// and beyond the length of a fixed array.
    fn place(&mut self, index: usize) -> Option<Slot<'_>>;
    /// Bytes that room for one more element takes: none in a fixed array.
    fn element_size(&self) -> usize;
    /// Elements for which there is room.
    fn room(&self) -> usize;
    /// Makes room for `more` elements and not for more.
    fn reserve(&mut self, more: usize);
}

/// A field for an object, without knowing its declared type beforehand.
pub trait Reference {
    /// Makes it null.
    fn clear(&mut self);
    /// Puts an object in.
    ///
    /// # Errors
    /// Gives the object back when the field does not hold its type.
    fn put(&mut self, object: Box<dyn Object>) -> Result<(), Box<dyn Object>>;
    /// Makes it an object of that type, every field at its default; none, and nothing is changed, when the field does
    /// not hold the type.
    fn make(&mut self, info: &'static TypeInfo) -> Option<&mut dyn Object>;
    /// Bytes that an object of that type takes beside the field.
    fn size_apart(&self, info: &TypeInfo) -> usize;
}

macro_rules! number {
    ($type:ty, $variant:ident) => {
        impl Value for $type {
            const KIND: Kind = Kind::$variant;
            fn blank() -> Self {
                Self::default()
            }
            #[inline(always)]
            fn decode(&mut self, reader: &mut Reader<'_>) -> Decoded<()> {
                *self = Self::from_be_bytes(*reader.array()?);
                Ok(())
            }
            #[inline(always)]
            fn encode(&self, writer: &mut Writer<'_>) -> Encoded {
                writer.put(&self.to_be_bytes());
                Ok(())
            }
            fn view(&self) -> View<'_> {
                View::$variant(*self)
            }
            fn slot(&mut self) -> Slot<'_> {
                Slot::$variant(self)
            }
        }
    };
}

number!(u8, Byte);
number!(i32, Int32);
number!(u32, UInt32);
number!(i64, Int64);
number!(f32, Real32);
number!(f64, Real64);

impl Value for bool {
    const KIND: Kind = Kind::Bool;
    fn blank() -> Self {
        false
    }
    #[inline]
    fn decode(&mut self, reader: &mut Reader<'_>) -> Decoded<()> {
        *self = reader.flag(DecodeFault::Bool)?;
        Ok(())
    }
    #[inline]
    fn encode(&self, writer: &mut Writer<'_>) -> Encoded {
        writer.put(&[u8::from(*self)]);
        Ok(())
    }
    fn view(&self) -> View<'_> {
        View::Bool(*self)
    }
    fn slot(&mut self) -> Slot<'_> {
        Slot::Bool(self)
    }
}

impl Value for Text {
    const KIND: Kind = Kind::Text;
    fn blank() -> Self {
        Self::const_new("")
    }
    #[inline]
    fn decode(&mut self, reader: &mut Reader<'_>) -> Decoded<()> {
        let length = reader.u16()?.into();
        if let Some(text) = reader.short_text(length) {
            *self = text;
            return Ok(());
        }
        let bytes = reader.bytes(length)?;
        let Ok(text) = str::from_utf8(bytes) else { return reader.fail_back(length, DecodeFault::Text) };
        if length > TEXT_INLINE {
            reader.allocate(text_apart(length))?;
        }
        *self = Text::new(text);
        Ok(())
    }
    #[inline]
    fn encode(&self, writer: &mut Writer<'_>) -> Encoded {
        writer.text(self)
    }
    fn view(&self) -> View<'_> {
        View::Text(self)
    }
    fn slot(&mut self) -> Slot<'_> {
        Slot::Text(self)
    }
    fn apart(&self) -> usize {
        text_apart(self.len())
    }
}

/// An enumeration of the model: a number, of which some have names. A number without a name is kept,
/// so that what came in another version of the model goes out again unchanged.
pub trait Enumeration: Copy {
    /// Its name and values.
    const INFO: &'static EnumInfo;
    /// The first declared value, which is the default.
    const FIRST: Self;
    /// The number.
    fn number(&self) -> i32;
    /// The number, to be set.
    fn number_mut(&mut self) -> &mut i32;
}

impl<T: Enumeration> Value for T {
    const KIND: Kind = Kind::Enum(T::INFO);
    fn blank() -> Self {
        T::FIRST
    }
    #[inline]
    fn decode(&mut self, reader: &mut Reader<'_>) -> Decoded<()> {
        self.number_mut().decode(reader)
    }
    #[inline]
    fn encode(&self, writer: &mut Writer<'_>) -> Encoded {
        self.number().encode(writer)
    }
    fn view(&self) -> View<'_> {
        View::Enum(self.number(), T::INFO)
    }
    fn slot(&mut self) -> Slot<'_> {
        Slot::Enum(self.number_mut(), T::INFO)
    }
}
