//! Objects from XML.

use std::fmt;
use std::str::FromStr;

use super::tree::{self, Element, XmlError};
use super::{NULL, SERIES};
use crate::lmcp::object::Object;
use crate::lmcp::registry::{descendants, type_in};
use crate::lmcp::schema::{EnumInfo, FieldInfo, Kind, TypeInfo};
use crate::lmcp::value::{List, Reference, Slot};

/// What a document holds.
#[derive(Debug, Clone, Default)]
pub struct Document {
    /// Its objects in document order: the root element, or those at any depth of a scenario file. An
    /// object within another is part of that one.
    pub objects: Vec<Placed>,
    /// What was passed over.
    pub warnings: Vec<Warning>,
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
        series: String,
        /// The element.
        name: String,
    },
    /// An element that is no field of the object's type.
    #[error("{info} has no field {field}")]
    UnknownField {
        /// The type.
        info: &'static str,
        /// The element.
        field: String,
    },
    /// A text that is not a value of the field.
    #[error("{text:?} is not a value of {field}")]
    Value {
        /// The field.
        field: &'static str,
        /// The text.
        text: String,
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
        name: String,
    },
}

/// Reads the objects of a document: a message, a simulator's scenario, or whatever has elements with
/// the attribute `Series` in it.
///
/// # Errors
/// Tells the line where the document is not well formed.
pub fn read_xml(document: &[u8]) -> Result<Document, XmlError> {
    let root = tree::parse(document)?;
    let mut found = Document::default();
    found.find(&root);
    Ok(found)
}

impl Document {
    /// Reads the element as an object, or those within it.
    fn find(&mut self, element: &Element) {
        let Some(series) = element.attribute(SERIES) else {
            return element.children.iter().for_each(|child| self.find(child));
        };
        match type_in(series, &element.name) {
            Some(info) => {
                let object = self.read_object(info, element);
                let time = element.attribute("Time").and_then(|time| time.parse().ok());
                self.objects.push(Placed { object, line: element.line, time });
            }
            None => self.warn_unknown(element),
        }
    }

    fn warn(&mut self, element: &Element, kind: WarningKind) {
        self.warnings.push(Warning { line: element.line, kind });
    }

    fn warn_unknown(&mut self, element: &Element) {
        let series = element.attribute(SERIES).unwrap_or_default().to_owned();
        self.warn(element, WarningKind::UnknownType { series, name: element.name.clone() });
    }

    fn read_object(&mut self, info: &'static TypeInfo, element: &Element) -> Box<dyn Object> {
        let mut object = (info.default)();
        for child in &element.children {
            match (info.field(&child.name), object.slot(&child.name)) {
                (Some(field), Some(slot)) => self.read_field(field, slot, child),
                _ => {
                    let field = child.name.clone();
                    self.warn(child, WarningKind::UnknownField { info: info.full_name, field });
                }
            }
        }
        object
    }

    fn read_field(&mut self, field: &'static FieldInfo, slot: Slot<'_>, element: &Element) {
        match (slot, field.kind) {
            (Slot::Object(reference), Kind::Object(declared)) => {
                self.read_reference(field, declared, reference, element);
            }
            (Slot::List(list), Kind::List(kind, _)) => self.read_list(field, kind, list, element),
            // An element without text stands for a value that is not there, unless it is a text.
            (slot, _) if element.text.is_empty() && !matches!(slot, Slot::Text(_)) => {}
            (slot, _) => {
                self.read_primitive(field, slot, element);
            }
        }
    }

    /// A field that holds an object has it as its one child; without any it keeps its default.
    fn read_reference(
        &mut self,
        field: &'static FieldInfo,
        declared: &'static TypeInfo,
        reference: &mut dyn Reference,
        element: &Element,
    ) {
        let mut children = element.children.iter();
        if let Some(child) = children.next() {
            self.read_held(field, declared, reference, child);
        }
        for surplus in children {
            self.warn_surplus(field, surplus);
        }
    }

    /// Reads an object or a null; false when it is passed over.
    fn read_held(
        &mut self,
        field: &'static FieldInfo,
        declared: &'static TypeInfo,
        reference: &mut dyn Reference,
        element: &Element,
    ) -> bool {
        if element.name == NULL {
            reference.clear();
            return true;
        }
        let info = match element.attribute(SERIES) {
            Some(series) => type_in(series, &element.name),
            None => descendants(declared).find(|info| info.name == element.name),
        };
        let Some(info) = info else {
            self.warn_unknown(element);
            return false;
        };
        let object = self.read_object(info, element);
        if reference.put(object).is_err() {
            self.warn(element, WarningKind::Kind { field: field.name, info: info.full_name });
            return false;
        }
        true
    }

    /// Elements that are passed over leave no gap.
    fn read_list(&mut self, field: &'static FieldInfo, kind: &Kind, list: &mut dyn List, element: &Element) {
        list.truncate(0);
        let mut index = 0;
        for child in &element.children {
            let read = match (list.place(index), kind) {
                (None, _) => {
                    self.warn_surplus(field, child);
                    continue;
                }
                (Some(Slot::Object(reference)), Kind::Object(declared)) => {
                    self.read_held(field, declared, reference, child)
                }
                (Some(slot), _) => self.read_primitive(field, slot, child),
            };
            if read {
                index += 1;
            } else {
                list.truncate(index);
            }
        }
    }

    fn warn_surplus(&mut self, field: &'static FieldInfo, element: &Element) {
        self.warn(element, WarningKind::Surplus { field: field.name, name: element.name.clone() });
    }

    /// Reads a value from the element's text; false when it is passed over.
    fn read_primitive(&mut self, field: &'static FieldInfo, slot: Slot<'_>, element: &Element) -> bool {
        let text = element.text.as_str();
        let read = match slot {
            Slot::Bool(value) => set(value, truth(text)),
            Slot::Byte(value) => set(value, integer(text)),
            Slot::Int32(value) => set(value, integer(text)),
            Slot::UInt32(value) => set(value, integer(text)),
            Slot::Int64(value) => set(value, integer(text)),
            Slot::Real32(value) => set(value, text.parse().ok()),
            Slot::Real64(value) => set(value, text.parse().ok()),
            Slot::Enum(value, info) => set(value, enumeration(text, info)),
            Slot::Text(value) => set(value, Some(text.into())),
            Slot::Object(_) | Slot::List(_) => false,
        };
        if !read {
            let text = text.to_owned();
            self.warn(element, WarningKind::Value { field: field.name, text });
        }
        read
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
    match text.to_ascii_lowercase().as_str() {
        "true" | "1" => Some(true),
        "false" | "0" => Some(false),
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
