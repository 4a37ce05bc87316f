//! Objects from JSON.

use serde::de::DeserializeOwned;
use thiserror::Error;

use super::cursor::Cursor;
use super::member;
use crate::lmcp::error::{FieldPath, Within};
use crate::lmcp::memory::{Full, Memory, shown};
use crate::lmcp::object::Object;
use crate::lmcp::registry::type_of;
use crate::lmcp::schema::{EnumInfo, TypeInfo};
use crate::lmcp::value::{List, Reference, Slot, Text};

/// Why JSON is not the form of an object.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{fault}{}", Within(path))]
pub struct JsonError {
    /// What is wrong.
    pub fault: JsonFault,
    /// In which field; empty for the root object itself.
    pub path: FieldPath,
}

/// What is wrong with the JSON form of an object.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum JsonFault {
    /// Text that is not JSON.
    #[error("line {line}: {expected} expected")]
    Syntax {
        /// The line, counted from 1.
        line: usize,
        /// What should stand there.
        expected: &'static str,
    },
    /// Objects and arrays are nested too deep.
    #[error("objects and arrays nested too deep")]
    Depth,
    /// The objects would take more memory than a text of this length is allowed.
    #[error("the objects take more memory than the text is allowed")]
    Memory,
    /// A value of another kind, or a number beyond the field's range.
    #[error("{0} expected")]
    Expected(&'static str),
    /// A type that is not declared here.
    #[error("type {0} is not known")]
    UnknownType(Box<str>),
    /// Another version of the type's series than the one declared here.
    #[error("version {found} where {known} is known")]
    Version {
        /// The version that the JSON tells.
        found: Box<str>,
        /// The version declared here.
        known: u16,
    },
    /// A field that the type does not have.
    #[error("{info} has no field {field}")]
    UnknownField {
        /// The type.
        info: &'static str,
        /// The field.
        field: Box<str>,
    },
    /// An object of a type that the field does not hold.
    #[error("the field does not hold {0}")]
    Kind(&'static str),
    /// An array of a fixed length with another one.
    #[error("{expected} elements expected and {found} found")]
    Count {
        /// The length that the model fixes.
        expected: usize,
        /// The length of the JSON array.
        found: usize,
    },
}

pub(super) type Read<T> = Result<T, Box<JsonError>>;

pub(super) fn fail<T>(fault: JsonFault) -> Read<T> {
    Err(Box::new(JsonError { fault, path: FieldPath::default() }))
}

impl From<Full> for Box<JsonError> {
    fn from(_: Full) -> Self {
        Self::new(JsonError { fault: JsonFault::Memory, path: FieldPath::default() })
    }
}

/// The object whose JSON form this is. Fields that are not there keep their default; only `_type` and `fields` are
/// needed of the rest, in any order.
///
/// # Errors
/// Names the field and what was expected there; the line of what is not JSON.
pub fn from_json(text: &[u8]) -> Result<Box<dyn Object>, JsonError> {
    let read = || {
        let mut reader = JsonReader::new(text)?;
        let object = reader.read_root()?;
        reader.at_end()?;
        Ok(object)
    };
    read().map_err(|error: Box<JsonError>| *error)
}

/// The objects of some text: one, several in a row, or arrays of them. Each may stand by itself, or as the member
/// `object` of a description.
///
/// # Errors
/// As [`from_json`], with the number of the object, counted from 1.
pub fn read_json(text: &[u8]) -> Result<Vec<Box<dyn Object>>, (usize, JsonError)> {
    let mut objects = Vec::new();
    let read = JsonReader::new(text).and_then(|mut reader| reader.read_all(&mut objects));
    match read {
        Ok(()) => Ok(objects),
        Err(error) => Err((objects.len() + 1, *error)),
    }
}

/// The longest number that is parsed in place.
const NUMBER_MAX: usize = 24;

struct JsonReader<'a> {
    cursor: Cursor<'a>,
    memory: Memory,
}

/// What the members of an object's map tell.
struct Members {
    info: &'static TypeInfo,
    /// Where its fields are.
    fields: usize,
    /// Where it ends.
    end: usize,
}

impl<'a> JsonReader<'a> {
    fn new(bytes: &'a [u8]) -> Read<Self> {
        match str::from_utf8(bytes) {
            Ok(text) => Ok(Self { cursor: Cursor::new(text), memory: Memory::of_text(text.len()) }),
            Err(error) => {
                let line = 1 + bytes[..error.valid_up_to()].iter().filter(|&&byte| byte == b'\n').count();
                fail(JsonFault::Syntax { line, expected: "UTF-8" })
            }
        }
    }

    fn at_end(&mut self) -> Read<()> {
        if self.cursor.peek().is_some() { self.cursor.fail("the end") } else { Ok(()) }
    }

    fn read_all(&mut self, objects: &mut Vec<Box<dyn Object>>) -> Read<()> {
        while let Some(next) = self.cursor.peek() {
            if next == b'[' {
                self.cursor.enter()?;
                let mut first = true;
                while self.cursor.next_element(&mut first)? {
                    self.read_described(objects)?;
                }
            } else {
                self.read_described(objects)?;
            }
        }
        Ok(())
    }

    /// An object, or the member `object` of a description.
    fn read_described(&mut self, objects: &mut Vec<Box<dyn Object>>) -> Read<()> {
        self.memory.grow(objects)?;
        let start = self.cursor.place();
        let (mut inner, mut first) = (None, true);
        if self.cursor.peek() == Some(b'{') {
            self.cursor.enter()?;
            while let Some(key) = self.cursor.next_member(&mut first)? {
                if key == member::DESCRIBED {
                    inner = Some(self.cursor.place());
                }
                self.cursor.skip()?;
            }
        }
        let end = self.cursor.place();
        self.cursor.go_to(inner.unwrap_or(start));
        objects.push(self.read_root()?);
        if inner.is_some() {
            self.cursor.go_to(end);
        }
        Ok(())
    }

    fn read_root(&mut self) -> Read<Box<dyn Object>> {
        let members = self.members()?;
        self.memory.take(members.info.size)?;
        let mut object = (members.info.default)();
        self.memory.take(object.apart())?;
        self.read_fields(&members, object.as_mut())?;
        Ok(object)
    }

    /// Passes over an object's map and tells what is in it.
    fn members(&mut self) -> Read<Members> {
        if self.cursor.peek() != Some(b'{') {
            return fail(JsonFault::Expected("an object"));
        }
        self.cursor.enter()?;
        let (mut name, mut version, mut fields, mut first) = (None, None, None, true);
        while let Some(key) = self.cursor.next_member(&mut first)? {
            let place = self.cursor.place();
            let next = self.cursor.peek();
            match key {
                member::TYPE if next == Some(b'"') => name = Some(self.cursor.scalar()?.trim_matches('"')),
                member::FIELDS if next == Some(b'{') => {
                    fields = Some(place);
                    self.cursor.skip()?;
                }
                member::VERSION if !matches!(next, Some(b'{' | b'[')) => {
                    version = Some(self.cursor.scalar()?)
                }
                _ => self.cursor.skip()?,
            }
        }
        let Some(name) = name else { return fail(JsonFault::Expected("a map with _type")) };
        let Some(info) = type_of(name) else { return fail(JsonFault::UnknownType(shown(name))) };
        let known = info.series.version;
        if let Some(found) = version.filter(|found| found.parse() != Ok(known)) {
            return fail(JsonFault::Version { found: shown(found), known });
        }
        let Some(fields) = fields else { return fail(JsonFault::Expected("a map with fields")) };
        Ok(Members { info, fields, end: self.cursor.place() })
    }

    fn read_fields(&mut self, members: &Members, object: &mut dyn Object) -> Read<()> {
        let info = members.info;
        self.cursor.go_to(members.fields);
        self.cursor.enter()?;
        let mut first = true;
        while let Some(key) = self.cursor.next_member(&mut first)? {
            let (Some(field), Some(slot)) = (info.field(key), object.slot(key)) else {
                return fail(JsonFault::UnknownField { info: info.full_name, field: shown(key) });
            };
            if let Err(mut error) = self.read_value(slot) {
                error.path.push_field(field.name);
                return Err(error);
            }
        }
        self.cursor.go_to(members.end);
        Ok(())
    }

    fn read_value(&mut self, slot: Slot<'_>) -> Read<()> {
        match slot {
            Slot::Object(reference) => return self.read_reference(reference),
            Slot::List(list) => return self.read_list(list),
            _ => {}
        }
        // An object or array is no value of any other field.
        let json = match self.cursor.peek() {
            Some(b'{' | b'[') => "",
            _ => self.cursor.scalar()?,
        };
        // A long number is parsed in a buffer.
        let meanwhile = if json.len() > NUMBER_MAX { 3 * json.len() } else { 0 };
        self.memory.take(meanwhile)?;
        self.memory.give_back(meanwhile);
        match slot {
            Slot::Bool(value) => set(value, parsed(json), "a truth value"),
            Slot::Byte(value) => set(value, parsed(json), "an integer from 0 to 255"),
            Slot::Int32(value) => set(value, parsed(json), "a 32-bit integer"),
            Slot::UInt32(value) => set(value, parsed(json), "an unsigned 32-bit integer"),
            Slot::Int64(value) => set(value, parsed(json), "a 64-bit integer"),
            Slot::Real32(value) => set(value, real(json).and_then(narrow), "a 32-bit number"),
            Slot::Real64(value) => set(value, real(json), "a number"),
            Slot::Enum(value, info) => {
                set(value, enumeration(json, info), "a number or name of the enumeration")
            }
            Slot::Text(value) => {
                let text = self.text(json)?;
                set(value, text, "a text")
            }
            Slot::Object(_) | Slot::List(_) => Ok(()),
        }
    }

    /// A text; what takes its escapes out takes three times its length meanwhile.
    fn text(&mut self, json: &str) -> Read<Option<Text>> {
        let Some(inside) = json.strip_prefix('"').and_then(|json| json.strip_suffix('"')) else {
            return Ok(None);
        };
        let text = if inside.contains('\\') {
            let meanwhile = 3 * json.len();
            self.memory.take(meanwhile)?;
            let text = parsed::<String>(json).map(Text::from);
            self.memory.give_back(meanwhile);
            text
        } else {
            self.memory.take(crate::lmcp::value::text_apart(inside.len()))?;
            return Ok(Some(Text::new(inside)));
        };
        self.memory.take(text.as_ref().map_or(0, |text| crate::lmcp::value::text_apart(text.len())))?;
        Ok(text)
    }

    fn read_reference(&mut self, reference: &mut dyn Reference) -> Read<()> {
        if self.cursor.peek() == Some(b'n') && self.cursor.scalar()? == "null" {
            reference.clear();
            return Ok(());
        }
        let members = self.members()?;
        self.memory.take(reference.size_apart(members.info))?;
        let Some(object) = reference.make(members.info) else {
            return fail(JsonFault::Kind(members.info.full_name));
        };
        self.memory.take(object.apart())?;
        self.read_fields(&members, object)
    }

    fn read_list(&mut self, list: &mut dyn List) -> Read<()> {
        let Some(found) = self.cursor.count()? else { return fail(JsonFault::Expected("an array")) };
        list.truncate(0);
        self.memory.take(found.saturating_mul(list.element_size()))?;
        list.reserve(found);
        self.cursor.enter()?;
        let (mut first, mut index) = (true, 0);
        while self.cursor.next_element(&mut first)? {
            match list.place(index) {
                Some(place) => self.read_value(place).map_err(|mut error| {
                    error.path.push_index(index);
                    error
                })?,
                None => self.cursor.skip()?,
            }
            index += 1;
        }
        match list.length() {
            expected if expected != found => fail(JsonFault::Count { expected, found }),
            _ => Ok(()),
        }
    }
}

fn set<T>(place: &mut T, value: Option<T>, expected: &'static str) -> Read<()> {
    match value {
        Some(value) => {
            *place = value;
            Ok(())
        }
        None => fail(JsonFault::Expected(expected)),
    }
}

fn parsed<T: DeserializeOwned>(json: &str) -> Option<T> {
    serde_json::from_str(json).ok()
}

/// A number, or the name of one. No name is written with escapes.
fn enumeration(json: &str, info: &EnumInfo) -> Option<i32> {
    match json.strip_prefix('"') {
        Some(name) => info.value_of(name.strip_suffix('"')?),
        None => parsed(json),
    }
}

fn real(json: &str) -> Option<f64> {
    match json {
        "\"NaN\"" => Some(f64::NAN),
        "\"inf\"" => Some(f64::INFINITY),
        "\"-inf\"" => Some(f64::NEG_INFINITY),
        _ => parsed(json),
    }
}

/// The nearest 32-bit number; none when that is infinite for a finite one.
fn narrow(value: f64) -> Option<f32> {
    let narrow = value as f32;
    (narrow.is_finite() || !value.is_finite()).then_some(narrow)
}
