//! Comments and directives: what is left of a file for the parser, and what it includes (IDL 4.2, 7.3).

use super::FILE_BYTES_MAX;
use super::error::IdlError;
use super::lexer::{Placed, tokens};
use std::collections::BTreeSet;

/// A file without comments and directives.
pub(super) struct Prepared {
    /// What it includes, each with its line.
    pub(super) includes: Vec<(usize, String)>,
    pub(super) tokens: Vec<Placed>,
}

/// A `#if` that is open.
struct Condition {
    line: usize,
    /// Whether its lines count now.
    holds: bool,
    /// Whether one of its branches has held.
    held: bool,
    /// Whether what is around it counts.
    outer: bool,
}

pub(super) fn prepare(file: &str, text: &str) -> Result<Prepared, IdlError> {
    let error = |line: usize, what: String| IdlError { file: file.to_owned(), line, what };
    if text.len() > FILE_BYTES_MAX {
        return Err(error(
            1,
            format!("{} bytes, {FILE_BYTES_MAX} are read at the most: divide it", text.len()),
        ));
    }
    let text = without_comments(text.trim_start_matches('\u{feff}'))
        .map_err(|line| error(line, "a comment that is not ended: put `*/` at its end".to_owned()))?;
    let mut directives = Directives { defined: BTreeSet::new(), open: Vec::new(), includes: Vec::new() };
    let mut kept = String::with_capacity(text.len());
    for (line, content) in text.lines().enumerate() {
        match content.trim_start().strip_prefix('#') {
            Some(directive) => directives.take(line + 1, directive).map_err(|what| error(line + 1, what))?,
            None if directives.holds() => kept.push_str(content),
            None => {}
        }
        kept.push('\n');
    }
    if let Some(condition) = directives.open.last() {
        return Err(error(
            condition.line,
            "a condition that is not ended: put `#endif` at its end".to_owned(),
        ));
    }
    Ok(Prepared { includes: directives.includes, tokens: tokens(file, &kept)? })
}

struct Directives {
    defined: BTreeSet<String>,
    open: Vec<Condition>,
    includes: Vec<(usize, String)>,
}

impl Directives {
    fn holds(&self) -> bool {
        self.open.last().is_none_or(|condition| condition.holds)
    }

    fn begin(&mut self, line: usize, met: bool) {
        let outer = self.holds();
        self.open.push(Condition { line, holds: outer && met, held: met, outer });
    }

    fn take(&mut self, line: usize, directive: &str) -> Result<(), String> {
        let directive = directive.trim();
        let end = directive.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(directive.len());
        let (name, rest) = directive.split_at(end);
        let rest = rest.trim();
        match name {
            "ifndef" => self.begin(line, !self.defined.contains(rest)),
            "ifdef" => self.begin(line, self.defined.contains(rest)),
            "if" => {
                let met = self.condition(rest)?;
                self.begin(line, met);
            }
            "elif" | "else" => {
                let met = name == "else" || self.condition(rest)?;
                let condition = self.open.last_mut().ok_or("there is no `#if` before it")?;
                condition.holds = condition.outer && !condition.held && met;
                condition.held |= met;
            }
            "endif" => {
                self.open.pop().ok_or("there is no `#if` before it")?;
            }
            _ if !self.holds() => {}
            "include" => self.includes.push((line, included(rest)?)),
            "define" => match rest.split_once(char::is_whitespace) {
                Some((name, value)) if !value.trim().is_empty() => {
                    return Err(format!("the macro `{name}` has a value: write a constant instead"));
                }
                _ => drop(self.defined.insert(rest.to_owned())),
            },
            "undef" => drop(self.defined.remove(rest)),
            "pragma" | "line" | "warning" | "" => {}
            other => return Err(format!("the directive `#{}` is not read", crate::name::shortened(other))),
        }
        Ok(())
    }

    fn condition(&self, text: &str) -> Result<bool, String> {
        let plain: String = text.chars().filter(|c| !matches!(c, '(' | ')') && !c.is_whitespace()).collect();
        let (plain, negated) = plain.strip_prefix('!').map_or((plain.as_str(), false), |rest| (rest, true));
        let met = match plain {
            "0" => false,
            "1" => true,
            _ => match plain.strip_prefix("defined") {
                Some(name) if name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') => {
                    self.defined.contains(name)
                }
                _ => {
                    let shown = crate::name::shortened(text);
                    return Err(format!("the condition `{shown}` is not read: 0, 1 and `defined(NAME)` are"));
                }
            },
        };
        Ok(met != negated)
    }
}

fn included(text: &str) -> Result<String, String> {
    let inner = text
        .strip_prefix('"')
        .and_then(|rest| rest.split_once('"'))
        .or_else(|| text.strip_prefix('<').and_then(|rest| rest.split_once('>')));
    match inner {
        Some((name, _)) if !name.is_empty() => Ok(name.to_owned()),
        _ => Err("`#include` wants a file in quotes".to_owned()),
    }
}

/// The text with spaces in place of comments; the lines stay. The line of a comment that does not end is the error.
fn without_comments(text: &str) -> Result<String, usize> {
    let mut kept = String::with_capacity(text.len());
    let mut rest = text;
    let line_of = |rest: &str| text[..text.len() - rest.len()].matches('\n').count() + 1;
    while let Some(at) = rest.find(['/', '"', '\'']) {
        kept.push_str(&rest[..at]);
        rest = &rest[at..];
        let taken = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if let Some(inside) = rest.strip_prefix("/*") {
            let end = inside.find("*/").ok_or_else(|| line_of(rest))? + 4;
            kept.push(' ');
            kept.extend(rest[..end].chars().filter(|c| *c == '\n'));
            end
        } else {
            let quoted = if rest.starts_with('/') { 1 } else { text_end(rest) };
            kept.push_str(&rest[..quoted]);
            quoted
        };
        rest = &rest[taken..];
    }
    kept.push_str(rest);
    Ok(kept)
}

/// Where a quoted text ends, its quotes included; one that does not is for the lexer to tell.
fn text_end(text: &str) -> usize {
    let quote = text.chars().next();
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            '\n' => return at,
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            c if Some(c) == quote => return at + 1,
            _ => {}
        }
    }
    text.len()
}
