//! What is wrong with a configuration: file, line, column, the line itself and a cure, drawn by miette.

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};
use std::fmt;
use std::ops::Range;
use std::sync::Arc;

/// A mistake that typed reading cannot see, or that is told better by what it means: where it is, what it is, what
/// to do about it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Fault {
    /// Keys and indices from the top of the file, joined by dots: `bridge.1.service`. Empty is the whole file.
    pub(crate) path: String,
    /// What is wrong.
    pub(crate) message: String,
    /// What to do.
    pub(crate) help: String,
}

impl Fault {
    pub(crate) fn new(path: impl Into<String>, message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { path: path.into(), message: message.into(), help: help.into() }
    }

    /// The same fault, its path below another one.
    pub(crate) fn below(mut self, parent: &str) -> Self {
        self.path = if self.path.is_empty() { parent.to_owned() } else { format!("{parent}.{}", self.path) };
        self
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; {}", self.message, self.help)
    }
}

/// Why a configuration is refused. It holds the first mistake; what else was found hangs below it and is drawn after
/// it.
#[derive(Debug, Clone)]
pub(crate) struct ConfigError(Box<Mistake>);

#[derive(Debug, Clone)]
struct Mistake {
    message: String,
    help: String,
    label: Option<LabeledSpan>,
    source: Arc<NamedSource<String>>,
    more: Vec<ConfigError>,
}

impl ConfigError {
    /// The file itself cannot be read: there is no line to show.
    pub(crate) fn unreadable(file: &str, error: &std::io::Error) -> Self {
        Self(Box::new(Mistake {
            message: format!("cannot read the configuration `{file}`: {error}"),
            help: "give the path of a readable configuration, such as `configs/shore.toml`".to_owned(),
            label: None,
            source: Arc::new(NamedSource::new(file, String::new())),
            more: Vec::new(),
        }))
    }

    /// A mistake at some bytes of the text.
    pub(crate) fn at(
        source: &Arc<NamedSource<String>>,
        span: Range<usize>,
        message: String,
        help: String,
    ) -> Self {
        let label = Some(LabeledSpan::underline(first_line(source.inner(), span)));
        Self(Box::new(Mistake { message, help, label, source: Arc::clone(source), more: Vec::new() }))
    }

    /// The first of several mistakes, holding the others; none where there are none.
    pub(crate) fn all(mut mistakes: Vec<Self>) -> Option<Self> {
        if mistakes.is_empty() {
            return None;
        }
        let mut first = mistakes.remove(0);
        first.0.more.append(&mut mistakes);
        Some(first)
    }

    /// What is wrong, in one line.
    pub(crate) fn message(&self) -> &str {
        &self.0.message
    }

    /// What to do about it.
    pub(crate) fn cure(&self) -> &str {
        &self.0.help
    }

    /// The file, as it was named.
    pub(crate) fn file(&self) -> &str {
        self.0.source.name()
    }

    /// Line and column, both from 1; none where the file cannot be read.
    pub(crate) fn position(&self) -> Option<(usize, usize)> {
        let text = self.0.source.inner();
        let before = text.get(..self.0.label.as_ref()?.offset())?;
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().map_or(0, |l| l.chars().count()) + 1;
        Some((line, column))
    }

    /// The mistakes found after this one.
    pub(crate) fn more(&self) -> &[ConfigError] {
        &self.0.more
    }
}

/// Of a span over several lines only the first is shown: a whole table underlined tells nothing.
fn first_line(text: &str, span: Range<usize>) -> Range<usize> {
    let start = span.start.min(text.len());
    let end = span.end.clamp(start, text.len());
    let line_end = text.get(start..end).and_then(|t| t.find('\n')).map_or(end, |n| start + n);
    start..line_end
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.message)
    }
}

impl std::error::Error for ConfigError {}

impl Diagnostic for ConfigError {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        Some(Box::new(&self.0.help))
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.0.label.as_ref()?;
        Some(&*self.0.source)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let label = self.0.label.clone()?;
        Some(Box::new(std::iter::once(label)))
    }

    fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn Diagnostic> + 'a>> {
        if self.0.more.is_empty() {
            return None;
        }
        Some(Box::new(self.0.more.iter().map(|e| e as &dyn Diagnostic)))
    }
}
