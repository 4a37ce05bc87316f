//! A document as a tree of elements, or the line where it is not well formed.

use quick_xml::XmlVersion;
use quick_xml::escape::resolve_xml_entity;
use quick_xml::events::{BytesRef, BytesStart, Event};
use quick_xml::reader::Reader;
use thiserror::Error;

use crate::lmcp::reader::DEPTH_MAX;

/// How deep elements may be nested: an object and its field are one each, and a scenario file has
/// some around them. Reading recurses as deep.
const ELEMENTS_MAX: usize = 2 * DEPTH_MAX as usize + 16;

/// Why a document is not read.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("line {line}: {fault}")]
pub struct XmlError {
    /// The line, counted from 1.
    pub line: usize,
    /// What is wrong there.
    pub fault: XmlFault,
}

/// What makes a document ill-formed.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum XmlFault {
    /// A byte that is not UTF-8.
    #[error("not UTF-8")]
    Encoding,
    /// A fault of syntax.
    #[error("{0}")]
    Syntax(String),
    /// Two hyphens in a comment, as in a comment within another.
    #[error("two hyphens in a comment")]
    Comment,
    /// A reference to an entity that XML does not define.
    #[error("entity &{0}; is not known")]
    Entity(String),
    /// The document ends within an element.
    #[error("the document ends within the element {0}")]
    Unclosed(String),
    /// Something stands beside the root element.
    #[error("more than one root element")]
    Junk,
    /// There is no element at all.
    #[error("no root element")]
    NoRoot,
    /// Elements are nested too deep.
    #[error("elements nested too deep")]
    Depth,
}

/// One element.
#[derive(Debug, Default)]
pub(super) struct Element {
    pub(super) name: String,
    attributes: Vec<(String, String)>,
    pub(super) children: Vec<Element>,
    /// The text directly within, without the blanks around it.
    pub(super) text: String,
    /// How much of the text is to be kept although it may be blank.
    kept: usize,
    pub(super) line: usize,
}

impl Element {
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    /// Adds text as it stands in the document; blanks before the first other character are left out.
    fn add_text(&mut self, text: &str) {
        let text = if self.text.is_empty() { text.trim_start_matches(BLANK) } else { text };
        self.text.push_str(text);
    }

    /// Adds text that was written so that it stays, be it blank.
    fn keep_text(&mut self, text: &str) {
        self.text.push_str(text);
        self.kept = self.text.len();
    }

    fn trim_end(&mut self) {
        let end = self.text.trim_end_matches(BLANK).len();
        self.text.truncate(end.max(self.kept));
    }
}

/// What XML calls white space.
pub(super) const BLANK: [char; 4] = [' ', '\t', '\r', '\n'];

/// The root element of a document.
pub(super) fn parse(document: &[u8]) -> Result<Element, XmlError> {
    let text = match str::from_utf8(document) {
        Ok(text) => text,
        Err(error) => {
            let line = line_at(document, error.valid_up_to());
            return Err(XmlError { line, fault: XmlFault::Encoding });
        }
    };
    let mut reader = Reader::from_str(text);
    let mut builder = Builder { text, lines: Lines { at: 0, line: 1 }, open: Vec::new(), root: None };
    loop {
        let start = reader.buffer_position() as usize;
        match reader.read_event() {
            Ok(Event::Eof) => return builder.finish(),
            Ok(event) => builder.on_event(start, &event)?,
            Err(error) => {
                let fault = XmlFault::Syntax(error.to_string());
                return builder.fail(reader.error_position() as usize, fault);
            }
        }
    }
}

fn line_at(document: &[u8], position: usize) -> usize {
    1 + document[..position.min(document.len())].iter().filter(|&&byte| byte == b'\n').count()
}

/// Counts lines as reading goes on.
struct Lines {
    at: usize,
    line: usize,
}

impl Lines {
    fn advance(&mut self, text: &str, position: usize) -> usize {
        let passed = text.as_bytes().get(self.at..position).unwrap_or_default();
        self.line += passed.iter().filter(|&&byte| byte == b'\n').count();
        self.at = self.at.max(position);
        self.line
    }
}

/// Builds the tree from what the reader meets.
struct Builder<'a> {
    text: &'a str,
    lines: Lines,
    /// The elements that are not closed yet, outermost first.
    open: Vec<Element>,
    root: Option<Element>,
}

impl Builder<'_> {
    fn fail<T>(&self, position: usize, fault: XmlFault) -> Result<T, XmlError> {
        Err(XmlError { line: line_at(self.text.as_bytes(), position), fault })
    }

    fn on_event(&mut self, start: usize, event: &Event<'_>) -> Result<(), XmlError> {
        match event {
            Event::Start(tag) => self.on_start(start, tag),
            Event::Empty(tag) => {
                self.on_start(start, tag)?;
                self.on_end();
                Ok(())
            }
            Event::End(_) => {
                self.on_end();
                Ok(())
            }
            Event::Text(text) => {
                let content = text.xml10_content();
                self.on_text(start, &content, Element::add_text)
            }
            Event::CData(text) => self.on_text(start, &text.xml10_content(), Element::keep_text),
            Event::GeneralRef(reference) => self.on_reference(start, reference),
            Event::Comment(text) => self.on_comment(start, text),
            Event::Decl(_) | Event::PI(_) | Event::DocType(_) | Event::Eof => Ok(()),
        }
    }

    fn on_start(&mut self, start: usize, tag: &BytesStart<'_>) -> Result<(), XmlError> {
        if self.open.is_empty() && self.root.is_some() {
            return self.fail(start, XmlFault::Junk);
        }
        if self.open.len() == ELEMENTS_MAX {
            return self.fail(start, XmlFault::Depth);
        }
        let line = self.lines.advance(self.text, start);
        let name = tag.name().into_inner().to_owned();
        let mut element = Element { name, line, ..Element::default() };
        for attribute in tag.attributes() {
            let attribute = attribute.map_err(quick_xml::Error::from);
            let pair = attribute.and_then(|it| Ok((it.key, it.normalized_value(XmlVersion::Implicit1_0)?)));
            match pair {
                Ok((key, value)) => {
                    element.attributes.push((key.into_inner().to_owned(), value.into_owned()))
                }
                Err(error) => return self.fail(start, XmlFault::Syntax(error.to_string())),
            }
        }
        self.open.push(element);
        Ok(())
    }

    fn on_end(&mut self) {
        let Some(mut element) = self.open.pop() else { return };
        element.trim_end();
        match self.open.last_mut() {
            Some(parent) => parent.children.push(element),
            None => self.root = Some(element),
        }
    }

    fn on_text(&mut self, start: usize, text: &str, add: fn(&mut Element, &str)) -> Result<(), XmlError> {
        match self.open.last_mut() {
            Some(element) => add(element, text),
            None => {
                // A byte order mark is no text.
                let outside = text.trim_start_matches('\u{feff}');
                let blank = outside.trim_start_matches(BLANK);
                if !blank.is_empty() {
                    return self.fail(start + text.len() - blank.len(), XmlFault::Junk);
                }
            }
        }
        Ok(())
    }

    /// A comment holds no two hyphens, those that end it included.
    fn on_comment(&mut self, start: usize, text: &str) -> Result<(), XmlError> {
        let hyphens = text.find("--").or_else(|| text.ends_with('-').then_some(text.len()));
        match hyphens {
            Some(place) => self.fail(start + "<!--".len() + place, XmlFault::Comment),
            None => Ok(()),
        }
    }

    fn on_reference(&mut self, start: usize, reference: &BytesRef<'_>) -> Result<(), XmlError> {
        match reference.resolve_char_ref() {
            Ok(Some(character)) => {
                self.on_text(start, character.encode_utf8(&mut [0; 4]), Element::keep_text)
            }
            Ok(None) => match resolve_xml_entity(reference) {
                Some(text) => self.on_text(start, text, Element::keep_text),
                None => self.fail(start, XmlFault::Entity(reference.to_string())),
            },
            Err(error) => self.fail(start, XmlFault::Syntax(error.to_string())),
        }
    }

    fn finish(mut self) -> Result<Element, XmlError> {
        let end = self.text.len();
        if let Some(open) = self.open.pop() {
            return self.fail(end, XmlFault::Unclosed(open.name));
        }
        match self.root.take() {
            Some(root) => Ok(root),
            None => self.fail(end, XmlFault::NoRoot),
        }
    }
}
