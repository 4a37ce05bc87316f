//! The configuration that is written.

use super::Remark;
use std::fmt::Write;

/// A configuration in the making.
pub(super) struct Out {
    file: String,
    entity: u64,
    log: Option<&'static str>,
    tables: String,
}

impl Out {
    pub(super) fn new(file: &str, entity: u64) -> Self {
        Self { file: file.to_owned(), entity, log: None, tables: String::new() }
    }

    /// The least important that is logged.
    pub(super) fn log(&mut self, level: &'static str) {
        self.log = Some(level);
    }

    /// Begins a table of an array: `[[service]]`.
    pub(super) fn table(&mut self, array: &str, title: &str) {
        let _ = write!(self.tables, "\n# {}\n[[{array}]]\n", one_line(title));
    }

    /// A key whose value is TOML already.
    pub(super) fn key(&mut self, key: &str, value: impl std::fmt::Display) {
        // Writing to a String cannot fail.
        let _ = writeln!(self.tables, "{key} = {value}");
    }

    /// The whole file.
    pub(super) fn finish(self, remarks: &[Remark]) -> String {
        let Self { file, entity, log, tables } = self;
        let mut out = format!("# Made from {}.\n", one_line(&file));
        for Remark { line, text } in remarks {
            let _ = writeln!(out, "# Line {line}: {}.", one_line(text));
        }
        let _ = write!(out, "\nname = \"uxas-{entity}\"\nentities = [{entity}]\n");
        if let Some(level) = log {
            let _ = write!(out, "\n[log]\nlevel = \"{level}\"\n");
        }
        out.push_str(&tables);
        out
    }
}

/// A text as it stands in TOML.
pub(super) fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => {
                let _ = write!(out, "\\u{:04X}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// A list of texts as it stands in TOML.
pub(super) fn list<'a>(texts: impl IntoIterator<Item = &'a str>) -> String {
    let texts: Vec<_> = texts.into_iter().map(quoted).collect();
    format!("[{}]", texts.join(", "))
}

/// Nothing of a comment may leave its line.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
