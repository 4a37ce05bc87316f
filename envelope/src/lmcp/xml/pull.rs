//! A document piece by piece, or the line where it is not well formed. Nothing is kept of what was passed.

use std::borrow::Cow;

use quick_xml::XmlVersion;
use quick_xml::escape::resolve_xml_entity;
use quick_xml::events::{BytesRef, BytesStart, Event};
use quick_xml::reader::Reader;
use thiserror::Error;

use super::SERIES;
use crate::lmcp::memory::{Full, Memory, shown};
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
    Syntax(Box<str>),
    /// Two hyphens in a comment, as in a comment within another.
    #[error("two hyphens in a comment")]
    Comment,
    /// A reference to an entity that XML does not define.
    #[error("entity &{0}; is not known")]
    Entity(Box<str>),
    /// The document ends within an element.
    #[error("the document ends within the element {0}")]
    Unclosed(Box<str>),
    /// Something stands beside the root element.
    #[error("more than one root element")]
    Junk,
    /// There is no element at all.
    #[error("no root element")]
    NoRoot,
    /// Elements are nested too deep.
    #[error("elements nested too deep")]
    Depth,
    /// What is read would take more memory than a document of this length is allowed.
    #[error("the objects take more memory than the document is allowed")]
    Memory,
}

/// What XML calls white space.
pub(super) const BLANK: [char; 4] = [' ', '\t', '\r', '\n'];

/// A piece of a document.
pub(super) enum Piece<'a> {
    /// An element begins.
    Open(Tag<'a>),
    /// The element ends that began last.
    Close,
    /// Text directly within it.
    Text(Cow<'a, str>),
    /// Text that was written so that it stays, be it blank.
    Kept(Cow<'a, str>),
    /// The document ends.
    End,
}

/// How an element begins.
pub(super) struct Tag<'a> {
    pub(super) name: &'a str,
    pub(super) line: usize,
    /// Its attribute `Series`; what no series is called is cut short.
    pub(super) series: Option<Box<str>>,
    /// Its attribute `Time`.
    pub(super) time: Option<f64>,
}

/// A document that is read piece by piece.
pub(super) struct Pull<'a> {
    text: &'a str,
    reader: Reader<&'a [u8]>,
    /// The names of the elements that are not closed yet, outermost first.
    open: [&'a str; ELEMENTS_MAX],
    depth: usize,
    /// An empty element was told to begin, not yet to end.
    is_empty: bool,
    has_root: bool,
    /// The line of the byte `counted`.
    line: usize,
    counted: usize,
    pub(super) memory: Memory,
}

type Pulled<T> = Result<T, XmlError>;

impl<'a> Pull<'a> {
    pub(super) fn new(document: &'a [u8], memory: Memory) -> Pulled<Self> {
        let text = str::from_utf8(document).map_err(|error| {
            let line = 1 + document[..error.valid_up_to()].iter().filter(|&&byte| byte == b'\n').count();
            XmlError { line, fault: XmlFault::Encoding }
        })?;
        // Places are counted from behind a byte order mark, as the reader does.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut reader = Reader::from_str(text);
        // Names are compared here, where errors show no more of them than is good.
        reader.config_mut().check_end_names = false;
        reader.config_mut().allow_unmatched_ends = true;
        Ok(Self {
            text,
            reader,
            open: [""; ELEMENTS_MAX],
            depth: 0,
            is_empty: false,
            has_root: false,
            line: 1,
            counted: 0,
            memory,
        })
    }

    fn fail<T>(&self, position: usize, fault: XmlFault) -> Pulled<T> {
        let before = &self.text.as_bytes()[..position.min(self.text.len())];
        Err(XmlError { line: 1 + before.iter().filter(|&&byte| byte == b'\n').count(), fault })
    }

    fn fail_syntax<T>(&self, position: usize, error: &quick_xml::Error) -> Pulled<T> {
        self.fail(position, XmlFault::Syntax(shown(&error.to_string())))
    }

    /// Says that there is no more memory.
    pub(super) fn full<T>(&self, _: Full) -> Pulled<T> {
        self.fail(self.reader.buffer_position() as usize, XmlFault::Memory)
    }

    pub(super) fn take(&mut self, bytes: usize) -> Pulled<()> {
        self.memory.take(bytes).or_else(|full| self.full(full))
    }

    /// The next piece.
    pub(super) fn next(&mut self) -> Pulled<Piece<'a>> {
        if std::mem::take(&mut self.is_empty) {
            return Ok(self.close());
        }
        loop {
            let start = self.reader.buffer_position() as usize;
            let event = match self.reader.read_event() {
                Ok(event) => event,
                Err(error) => return self.fail_syntax(self.reader.error_position() as usize, &error),
            };
            match event {
                Event::Start(tag) => return self.open(start, &tag),
                Event::Empty(tag) => {
                    self.is_empty = true;
                    return self.open(start, &tag);
                }
                Event::End(tag) => return self.end(start, tag.name().into_inner()),
                Event::Text(text) => {
                    let text = text.xml10_content();
                    self.outside(start, &text)?;
                    return Ok(Piece::Text(text));
                }
                Event::CData(text) => {
                    let text = text.xml10_content();
                    self.outside(start, &text)?;
                    return Ok(Piece::Kept(text));
                }
                Event::GeneralRef(reference) => return self.reference(start, &reference),
                Event::Comment(text) => self.check_comment(start, &text)?,
                Event::Decl(_) | Event::PI(_) | Event::DocType(_) => {}
                Event::Eof => return self.finish(),
            }
        }
    }

    fn open(&mut self, start: usize, tag: &BytesStart<'_>) -> Pulled<Piece<'a>> {
        if self.depth == 0 && self.has_root {
            return self.fail(start, XmlFault::Junk);
        }
        if self.depth == ELEMENTS_MAX {
            return self.fail(start, XmlFault::Depth);
        }
        let passed = self.text.as_bytes().get(self.counted..start).unwrap_or_default();
        self.line += passed.iter().filter(|&&byte| byte == b'\n').count();
        self.counted = start;
        let name = start + 1;
        let name = self.text.get(name..name + tag.name().into_inner().len()).unwrap_or_default();
        self.has_root = true;
        self.take(name_kept(name))?;
        self.open[self.depth] = name;
        self.depth += 1;
        // The places of all attributes are noted, to find those that are there twice; a value with references is
        // copied.
        let attributes = tag.attributes_raw();
        let count = attributes.bytes().filter(|&byte| byte == b'=').count();
        let copied = if attributes.contains(['&', '\n', '\r', '\t']) { 5 * attributes.len() } else { 0 };
        let meanwhile = if count > 0 { 64 + 48 * count + copied } else { 0 };
        self.take(meanwhile)?;
        let mut opened = Tag { name, line: self.line, series: None, time: None };
        for attribute in tag.attributes() {
            let attribute = attribute.map_err(quick_xml::Error::from);
            let pair = attribute.and_then(|it| Ok((it.key, it.normalized_value(XmlVersion::Implicit1_0)?)));
            match pair {
                Ok((key, value)) => match key.into_inner() {
                    SERIES => opened.series = Some(shown(&value)),
                    "Time" => opened.time = value.parse().ok(),
                    _ => {}
                },
                Err(error) => return self.fail_syntax(start, &error),
            }
        }
        self.memory.give_back(meanwhile);
        Ok(Piece::Open(opened))
    }

    fn end(&mut self, start: usize, name: &str) -> Pulled<Piece<'a>> {
        match self.depth.checked_sub(1).map(|last| self.open[last]) {
            Some(expected) if expected == name => Ok(self.close()),
            Some(expected) => {
                let (expected, found) = (shown(expected), shown(name));
                let fault = format!("`</{expected}>` expected and `</{found}>` found");
                self.fail(start, XmlFault::Syntax(fault.into()))
            }
            None => {
                let fault = format!("`</{}>` ends no element", shown(name));
                self.fail(start, XmlFault::Syntax(fault.into()))
            }
        }
    }

    fn close(&mut self) -> Piece<'a> {
        self.depth -= 1;
        self.memory.give_back(name_kept(self.open[self.depth]));
        Piece::Close
    }

    /// Beside the root element there are only blanks.
    fn outside(&self, start: usize, text: &str) -> Pulled<()> {
        let blank = text.trim_start_matches(BLANK);
        if self.depth == 0 && !blank.is_empty() {
            return self.fail(start + text.len() - blank.len(), XmlFault::Junk);
        }
        Ok(())
    }

    /// A comment holds no two hyphens, those that end it included.
    fn check_comment(&self, start: usize, text: &str) -> Pulled<()> {
        let hyphens = text.find("--").or_else(|| text.ends_with('-').then_some(text.len()));
        match hyphens {
            Some(place) => self.fail(start + "<!--".len() + place, XmlFault::Comment),
            None => Ok(()),
        }
    }

    fn reference(&self, start: usize, reference: &BytesRef<'_>) -> Pulled<Piece<'a>> {
        let text = match reference.resolve_char_ref() {
            Ok(Some(character)) => Cow::Owned(character.to_string()),
            Ok(None) => match resolve_xml_entity(reference) {
                Some(text) => Cow::Borrowed(text),
                None => return self.fail(start, XmlFault::Entity(shown(reference))),
            },
            Err(error) => return self.fail_syntax(start, &error),
        };
        self.outside(start, &text)?;
        Ok(Piece::Kept(text))
    }

    fn finish(&self) -> Pulled<Piece<'a>> {
        match self.depth.checked_sub(1) {
            Some(last) => self.fail(self.text.len(), XmlFault::Unclosed(shown(self.open[last]))),
            None if !self.has_root => self.fail(self.text.len(), XmlFault::NoRoot),
            None => Ok(Piece::End),
        }
    }

    /// Passes over the rest of the element that began last.
    pub(super) fn skip(&mut self) -> Pulled<()> {
        let outside = self.depth - 1;
        while self.depth > outside {
            self.next()?;
        }
        Ok(())
    }

    /// The next element directly within the one that began last; none, and that one has ended.
    pub(super) fn next_child(&mut self) -> Pulled<Option<Tag<'a>>> {
        loop {
            match self.next()? {
                Piece::Open(tag) => return Ok(Some(tag)),
                Piece::Close | Piece::End => return Ok(None),
                Piece::Text(_) | Piece::Kept(_) => {}
            }
        }
    }

    /// The text directly within the element that began last, without the blanks around it; the element has ended.
    pub(super) fn text(&mut self) -> Pulled<Cow<'a, str>> {
        let mut text = Cow::Borrowed("");
        // How much of the text stays although it may be blank.
        let mut kept = 0;
        loop {
            match self.next()? {
                Piece::Open(_) => self.skip()?,
                Piece::Close | Piece::End => break,
                Piece::Text(piece) if text.is_empty() => {
                    let piece = match piece {
                        Cow::Borrowed(piece) => Cow::Borrowed(piece.trim_start_matches(BLANK)),
                        Cow::Owned(piece) => Cow::Owned(piece.trim_start_matches(BLANK).to_owned()),
                    };
                    self.append(&mut text, piece)?;
                }
                Piece::Text(piece) => self.append(&mut text, piece)?,
                Piece::Kept(piece) => {
                    self.append(&mut text, piece)?;
                    kept = text.len();
                }
            }
        }
        let end = text.trim_end_matches(BLANK).len().max(kept);
        match &mut text {
            Cow::Borrowed(text) => *text = &text[..end],
            Cow::Owned(text) => text.truncate(end),
        }
        Ok(text)
    }

    /// Adds to a text, which stays a part of the document as long as it is one.
    fn append(&mut self, text: &mut Cow<'a, str>, piece: Cow<'a, str>) -> Pulled<()> {
        if text.is_empty() {
            *text = piece;
            // A copy is made where line ends were changed.
            return if let Cow::Owned(copy) = text { self.take(COPY * copy.capacity()) } else { Ok(()) };
        }
        let needed = text.len() + piece.len();
        let room = if let Cow::Owned(text) = text { text.capacity() } else { 0 };
        if needed > room {
            let more = needed.max(room + room / 4);
            self.take(more)?;
            let mut longer = String::with_capacity(more);
            longer.push_str(text);
            *text = Cow::Owned(longer);
            self.memory.give_back(room);
        }
        text.to_mut().push_str(&piece);
        Ok(())
    }
}

/// What a copy of a text takes while it is made, in bytes for each of its own.
const COPY: usize = 2;

/// What the reader keeps of an open element's name, while its list of names grows.
fn name_kept(name: &str) -> usize {
    3 * name.len() + 3 * size_of::<usize>()
}
