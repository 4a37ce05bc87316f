//! The file as a tree of elements with their lines.

use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

/// How deep elements may be nested: options of tasks are three levels down.
const DEPTH_MAX: usize = 16;

/// One element.
#[derive(Debug, Clone, Default)]
pub(super) struct Element {
    pub(super) name: String,
    /// The line on which it begins, from 1.
    pub(super) line: usize,
    pub(super) attributes: Vec<Attribute>,
    pub(super) children: Vec<Element>,
}

/// One attribute.
#[derive(Debug, Clone)]
pub(super) struct Attribute {
    pub(super) name: String,
    pub(super) value: String,
}

impl Element {
    /// The value of an attribute.
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|a| a.name == name).map(|a| a.value.as_str())
    }

    /// The element with its type, for people.
    pub(super) fn title(&self) -> String {
        match self.attribute("Type") {
            Some(kind) => format!("{} {kind}", self.name),
            None => self.name.clone(),
        }
    }
}

/// Reads a document. Comments may hold two hyphens, as some that come with OpenUxAS do.
///
/// # Errors
/// The line and what is wrong there.
pub(super) fn read(bytes: &[u8]) -> Result<Element, (usize, String)> {
    let text = std::str::from_utf8(bytes)
        .map_err(|why| (1 + newlines(&bytes[..why.valid_up_to()]), "the file is not UTF-8".to_owned()))?;
    let mut reader = Reader::from_str(text);
    let mut open: Vec<Element> = Vec::new();
    let mut root = None;
    loop {
        let position = usize::try_from(reader.buffer_position()).unwrap_or(usize::MAX);
        let line_at = |at: usize| 1 + newlines(&bytes[..at.min(bytes.len())]);
        let event = reader.read_event().map_err(|why| {
            (line_at(usize::try_from(reader.error_position()).unwrap_or(position)), why.to_string())
        })?;
        let line = line_at(position);
        let done = match event {
            Event::Start(_) | Event::Empty(_) if open.is_empty() && root.is_some() => {
                return Err((line, "more than one root element".to_owned()));
            }
            Event::Start(start) if open.len() < DEPTH_MAX => {
                open.push(element(&start, line)?);
                continue;
            }
            Event::Start(_) => return Err((line, "elements nested too deep".to_owned())),
            Event::Empty(start) => element(&start, line)?,
            Event::End(_) => match open.pop() {
                Some(element) => element,
                None => return Err((line, "an end without a beginning".to_owned())),
            },
            Event::Eof if !open.is_empty() => {
                let name = &open[open.len() - 1].name;
                return Err((line, format!("the document ends within the element `{name}`")));
            }
            Event::Eof => return root.ok_or((line, "there is no element".to_owned())),
            _ => continue,
        };
        match open.last_mut() {
            Some(parent) => parent.children.push(done),
            None => root = Some(done),
        }
    }
}

fn newlines(bytes: &[u8]) -> usize {
    bytes.iter().filter(|&&b| b == b'\n').count()
}

fn element(start: &BytesStart<'_>, line: usize) -> Result<Element, (usize, String)> {
    let name = start.name().into_inner().to_owned();
    let mut attributes = Vec::new();
    for attribute in start.attributes() {
        let wrong = |why: quick_xml::Error| (line, format!("an attribute of `{name}`: {why}"));
        let attribute = attribute.map_err(|why| wrong(why.into()))?;
        let value = attribute.normalized_value(XmlVersion::Implicit1_0).map_err(wrong)?;
        attributes.push(Attribute { name: attribute.key.into_inner().to_owned(), value: value.into_owned() });
    }
    Ok(Element { name, line, attributes, children: Vec::new() })
}
