//! Objects as XML.

use std::fmt::{self, Write};

use thiserror::Error;

use super::pull::BLANK;
use super::{NULL, SERIES};
use crate::lmcp::error::{FieldPath, Within};
use crate::lmcp::object::{Object, elements};
use crate::lmcp::schema::{FieldInfo, Kind};
use crate::lmcp::value::{List, View};

/// A text has a character that no XML document may hold.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("XML cannot hold {character:?}{}", Within(path))]
pub struct XmlTextError {
    /// The character.
    pub character: char,
    /// The field of the text.
    pub path: FieldPath,
}

/// An object in XML form, its fields in wire order, one line each.
///
/// # Errors
/// Names the field whose text XML cannot hold.
pub fn to_xml(object: &dyn Object) -> Result<String, XmlTextError> {
    let mut writer = XmlWriter { xml: String::new(), depth: 0 };
    writer.object(object).map_err(|error| *error)?;
    Ok(writer.xml)
}

type Written = Result<(), Box<XmlTextError>>;

struct XmlWriter {
    xml: String,
    depth: usize,
}

impl XmlWriter {
    /// One line at the present depth.
    fn line(&mut self, line: fmt::Arguments<'_>) {
        let indent = 2 * self.depth;
        // Writing to a string does not fail.
        let _ = writeln!(self.xml, "{:indent$}{line}", "");
    }

    /// An element with others inside, or an empty one.
    fn element(
        &mut self,
        name: &str,
        attribute: fmt::Arguments<'_>,
        is_empty: bool,
        inside: impl FnOnce(&mut Self) -> Written,
    ) -> Written {
        if is_empty {
            self.line(format_args!("<{name}{attribute}/>"));
            return Ok(());
        }
        self.line(format_args!("<{name}{attribute}>"));
        self.depth += 1;
        inside(self)?;
        self.depth -= 1;
        self.line(format_args!("</{name}>"));
        Ok(())
    }

    fn object(&mut self, object: &dyn Object) -> Written {
        let info = object.type_info();
        let series = info.series.text;
        let is_empty = info.fields().next().is_none();
        self.element(info.name, format_args!(" {SERIES}=\"{series}\""), is_empty, |writer| {
            object.fields().try_for_each(|(field, value)| writer.field(object, field, value))
        })
    }

    fn field(&mut self, object: &dyn Object, field: &'static FieldInfo, value: View<'_>) -> Written {
        let written = match (value, field.kind) {
            (View::Object(None), _) if is_null_by_default(object, field) => return Ok(()),
            (View::Object(held), _) => {
                self.element(field.name, format_args!(""), false, |writer| writer.held(held))
            }
            (View::List(list), Kind::List(kind, _)) => {
                let is_empty = list.length() == 0;
                self.element(field.name, format_args!(""), is_empty, |writer| writer.list(list, kind))
            }
            (value, _) => self.primitive(field.name, value),
        };
        written.map_err(|mut error| {
            error.path.push_field(field.name);
            error
        })
    }

    fn held(&mut self, object: Option<&dyn Object>) -> Written {
        match object {
            Some(object) => self.object(object),
            None => {
                self.line(format_args!("<{NULL}/>"));
                Ok(())
            }
        }
    }

    fn list(&mut self, list: &dyn List, kind: &Kind) -> Written {
        for (index, value) in elements(list).enumerate() {
            let written = match value {
                View::Object(object) => self.held(object),
                value => self.primitive(kind.name().unwrap_or_default(), value),
            };
            written.map_err(|mut error| {
                error.path.push_index(index);
                error
            })?;
        }
        Ok(())
    }

    fn primitive(&mut self, name: &str, value: View<'_>) -> Written {
        match value {
            View::Text(text) => {
                let text = escaped(text)?;
                self.line(format_args!("<{name}>{text}</{name}>"));
            }
            View::Enum(number, info) => match info.name_of(number) {
                Some(text) => self.line(format_args!("<{name}>{text}</{name}>")),
                None => self.line(format_args!("<{name}>{number}</{name}>")),
            },
            value => self.line(format_args!("<{name}>{}</{name}>", Number(value))),
        }
        Ok(())
    }
}

/// A number or truth value as text: the shortest that is read back as the same.
struct Number<'a>(View<'a>);

impl fmt::Display for Number<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            View::Bool(value) => value.fmt(f),
            View::Byte(value) => value.fmt(f),
            View::Int32(value) | View::Enum(value, _) => value.fmt(f),
            View::UInt32(value) => value.fmt(f),
            View::Int64(value) => value.fmt(f),
            View::Real32(value) => value.fmt(f),
            View::Real64(value) => value.fmt(f),
            View::Text(_) | View::Object(_) | View::List(_) => Ok(()),
        }
    }
}

fn is_null_by_default(object: &dyn Object, field: &FieldInfo) -> bool {
    let default = (object.type_info().default)();
    matches!(default.view(field.name), Some(View::Object(None)))
}

/// Text with references for what would be read otherwise: markup, and blanks at either end.
fn escaped(text: &str) -> Result<String, Box<XmlTextError>> {
    let lead = text.len() - text.trim_start_matches(BLANK).len();
    let tail = text.trim_end_matches(BLANK).len();
    let mut escaped = String::with_capacity(text.len());
    for (place, character) in text.char_indices() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '\r' => escaped.push_str("&#13;"),
            _ if BLANK.contains(&character) && (place < lead || place >= tail) => {
                let _ = write!(escaped, "&#{};", u32::from(character));
            }
            '\t' | '\n' => escaped.push(character),
            '\u{fffe}' | '\u{ffff}' | '\0'..' ' => {
                return Err(Box::new(XmlTextError { character, path: FieldPath::default() }));
            }
            _ => escaped.push(character),
        }
    }
    Ok(escaped)
}
