//! IDL 4.2 as UMAA and other users of DDS write it: files to a library of types and the topics that they name.
//!
//! Modules, includes, typedefs, constants, enumerations, bitmasks, structures with inheritance, unions, arrays, sequences and
//! texts with and without bounds, annotations, comments, guards against double inclusion. Pure: files come in as texts.

mod annotation;
mod body;
mod constant;
mod error;
mod lexer;
mod parser;
mod preprocess;
mod scope;
#[cfg(test)]
mod tests;
mod topics;

pub use error::IdlError;

use crate::description::{Draft, Extensibility, Library, Topic};
use parser::Parser;
use scope::Scopes;
use std::collections::{BTreeMap, BTreeSet};

/// The longest file that is read, in bytes.
pub const FILE_BYTES_MAX: usize = 16 << 20;

/// What a set of files declares.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Idl {
    /// All types.
    pub library: Library,
    /// The topics by their names: constants of type `string` whose name ends in `Topic`, and structures annotated `@topic`.
    pub topics: Vec<Topic>,
}

/// Reads files by their paths, each once and after those that it includes. Where nothing is annotated, a type is as extensible as
/// `default` says: appendable by the standard, final as some vendors take it.
///
/// # Errors
/// All mistakes, each with file, line and cure; of one file the first.
pub fn parse(files: &BTreeMap<String, String>, default: Extensibility) -> Result<Idl, Vec<IdlError>> {
    let mut reading =
        Reading { files, default, read: BTreeSet::new(), scopes: Scopes::default(), errors: Vec::new() };
    for file in files.keys() {
        reading.file(file);
    }
    let Reading { mut scopes, mut errors, .. } = reading;
    if !errors.is_empty() {
        return Err(errors);
    }
    let topics = topics::topics(&mut scopes, &mut errors);
    let Scopes { draft, places, .. } = scopes;
    match finish(draft, &places) {
        Ok(library) if errors.is_empty() => Ok(Idl { library, topics }),
        Ok(_) => Err(errors),
        Err(wrong) => Err([errors, wrong].concat()),
    }
}

fn finish(draft: Draft, places: &BTreeMap<String, (String, usize)>) -> Result<Library, Vec<IdlError>> {
    draft.finish().map_err(|errors| {
        let placed = errors.into_iter().map(|error| {
            let (file, line) = places.get(&error.type_name).cloned().unwrap_or_default();
            IdlError { file, line, what: error.to_string() }
        });
        placed.collect()
    })
}

struct Reading<'a> {
    files: &'a BTreeMap<String, String>,
    default: Extensibility,
    read: BTreeSet<&'a str>,
    scopes: Scopes,
    errors: Vec<IdlError>,
}

impl<'a> Reading<'a> {
    /// Reads a file after all that it includes, without a stack of our own callers: includes may be as deep as there are files.
    fn file(&mut self, path: &'a str) {
        let mut open = vec![path];
        let mut begun = BTreeSet::new();
        while let Some(&path) = open.last() {
            if self.read.contains(path) {
                open.pop();
                continue;
            }
            let Some(text) = self.files.get(path) else { return };
            let prepared = match preprocess::prepare(path, text) {
                Ok(prepared) => prepared,
                Err(error) => {
                    self.errors.push(error);
                    self.read.insert(path);
                    continue;
                }
            };
            if begun.insert(path) {
                let included = prepared.includes.iter().map(|(line, name)| self.included(path, *line, name));
                let (found, missing): (Vec<_>, Vec<_>) = included.partition(|included| included.is_ok());
                self.errors.extend(missing.into_iter().filter_map(Result::err));
                // A file that includes what includes it is read once, as guards would have it.
                let wanted = found.into_iter().flatten().filter(|file| !begun.contains(file));
                open.extend(wanted.filter(|file| !self.read.contains(file)).collect::<Vec<_>>());
                continue;
            }
            open.pop();
            self.read.insert(path);
            let parsed = Parser::new(path, &prepared.tokens, self.default, &mut self.scopes).parse();
            self.errors.extend(parsed.err());
        }
    }

    /// The file that an include means: from the root of the folder, from the file's own place, or by the end of its path.
    fn included(&self, from: &str, line: usize, name: &str) -> Result<&'a str, IdlError> {
        let plain = name.replace('\\', "/");
        let beside = match from.rsplit_once('/') {
            Some((folder, _)) => normal(&format!("{folder}/{plain}")),
            None => normal(&plain),
        };
        let end = format!("/{plain}");
        let key = |path: &str| self.files.get_key_value(path).map(|(path, _)| path.as_str());
        key(&beside)
            .or_else(|| key(&normal(&plain)))
            .or_else(|| self.files.keys().map(String::as_str).find(|path| path.ends_with(&end)))
            .ok_or_else(|| IdlError {
                file: from.to_owned(),
                line,
                what: format!("no file `{}` is there: add it to the folder", crate::name::shortened(name)),
            })
    }
}

/// A path without `.` and `..`.
fn normal(path: &str) -> String {
    let mut parts = Vec::new();
    for part in path.split('/') {
        match part {
            "." | "" => {}
            ".." => drop(parts.pop()),
            part => parts.push(part),
        }
    }
    parts.join("/")
}
