//! `aldis lmcp verify`: messages and XML files that must come back as they were.

use super::super::exit::Failure;
use super::super::print_line;
use super::input;
use aldis_envelope::lmcp::{self, DecodeError};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Check that messages and XML files come back as they were.
///
/// Of folders all files are taken whose names end with `.lmcp` or `.xml`, at any depth. A message is decoded and encoded
/// again, which must give the same bytes; where a `.json` file of the same name stands beside it, its fields must equal
/// that. Each object of an XML file, a scenario's too, goes through LMCP and XML and must come back the same.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis lmcp verify messages/
  aldis lmcp verify state.lmcp scenario.xml
  aldis lmcp verify scenarios/ --json | jq .failures

With --json one object:
  files, identical, fields_equal, without_json                     of messages
  xml: { files, well_formed, objects, timed, stable, warnings }    of XML files
  failures: [{ file, line, why }]

Exit codes: 0 all came back; 1 some did not, and are named; 2 a file cannot be read.")]
pub(super) struct Verify {
    /// Files and folders.
    #[arg(required = true)]
    paths: Vec<PathBuf>,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

/// What has been found out.
#[derive(Default)]
struct Found {
    files: usize,
    identical: usize,
    fields_equal: usize,
    without_json: usize,
    xml_files: usize,
    well_formed: usize,
    objects: usize,
    timed: usize,
    stable: usize,
    warnings: usize,
    failures: Vec<Failed>,
}

/// A file that did not come back.
struct Failed {
    file: String,
    line: Option<usize>,
    why: String,
}

impl Verify {
    pub(super) fn run(self) -> Result<(), Failure> {
        let mut files = Vec::new();
        for path in &self.paths {
            collect(path, &mut files)?;
        }
        if files.is_empty() {
            return Err(Failure::Usage("there is no .lmcp or .xml file in what was named".into()));
        }
        let mut found = Found::default();
        for file in &files {
            found.check(file)?;
        }
        found.print(self.json);
        match found.failures.len() {
            0 => Ok(()),
            named => {
                let why = format!("of {} files not all came back as they were: {named} named", files.len());
                Err(Failure::Failed(why))
            }
        }
    }
}

/// The files to check, sorted within each folder.
fn collect(path: &Path, files: &mut Vec<PathBuf>) -> Result<(), Failure> {
    if !path.is_dir() {
        files.push(path.to_owned());
        return Ok(());
    }
    let failed = |why: std::io::Error| Failure::Usage(format!("cannot read {}: {why}", path.display()));
    let entries = std::fs::read_dir(path).map_err(failed)?;
    let mut inside = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, _>>().map_err(failed)?;
    inside.sort();
    for path in inside {
        if path.is_dir() || path.extension().is_some_and(|it| it == "lmcp" || it == "xml") {
            collect(&path, files)?;
        }
    }
    Ok(())
}

impl Found {
    /// Checks a file: a message where it begins as one, else XML.
    fn check(&mut self, file: &Path) -> Result<(), Failure> {
        let bytes = input::read(file)?;
        if bytes.starts_with(&lmcp::MAGIC) || file.extension().is_some_and(|it| it == "lmcp") {
            self.check_messages(file, &bytes)
        } else {
            self.check_xml(file, &bytes);
            Ok(())
        }
    }

    fn fail(&mut self, file: &Path, line: Option<usize>, why: impl std::fmt::Display) {
        self.failures.push(Failed { file: file.display().to_string(), line, why: why.to_string() });
    }

    fn check_messages(&mut self, file: &Path, bytes: &[u8]) -> Result<(), Failure> {
        self.files += 1;
        let expected = expected(file)?;
        self.without_json += usize::from(expected.is_none());
        match verify(bytes, expected.as_ref()) {
            Err(why) => self.fail(file, None, why),
            Ok((identical, fields_equal)) => {
                self.identical += usize::from(identical);
                self.fields_equal += usize::from(fields_equal == Some(true));
                if !identical {
                    self.fail(file, None, "encoding gives other bytes");
                }
                if fields_equal == Some(false) {
                    self.fail(file, None, "the fields are not those of the JSON file beside it");
                }
            }
        }
        Ok(())
    }

    fn check_xml(&mut self, file: &Path, bytes: &[u8]) {
        self.xml_files += 1;
        match lmcp::verify_xml(bytes) {
            Err(why) => self.fail(file, Some(why.line), why.fault),
            Ok(verified) => {
                self.well_formed += 1;
                self.objects += verified.objects;
                self.timed += verified.timed;
                self.stable += verified.objects - verified.unstable.len();
                self.warnings += verified.warnings.len() + verified.more_warnings;
                for (line, info) in verified.unstable {
                    self.fail(file, Some(line), format_args!("{info} does not come back the same"));
                }
            }
        }
    }

    fn print(&self, json: bool) {
        if json {
            let failures = self.failures.iter();
            let failures: Vec<_> = failures
                .map(|failed| json!({ "file": failed.file, "line": failed.line, "why": failed.why }))
                .collect();
            print_line(json!({
                "files": self.files, "identical": self.identical, "fields_equal": self.fields_equal,
                "without_json": self.without_json,
                "xml": {
                    "files": self.xml_files, "well_formed": self.well_formed, "objects": self.objects,
                    "timed": self.timed, "stable": self.stable, "warnings": self.warnings,
                },
                "failures": failures,
            }));
            return;
        }
        for Failed { file, line, why } in &self.failures {
            match line {
                Some(line) => print_line(format_args!("{file}:{line}: {why}")),
                None => print_line(format_args!("{file}: {why}")),
            }
        }
        let Self { files, identical, fields_equal, without_json, .. } = self;
        if *files > 0 {
            let with_json = files - without_json;
            print_line(format_args!(
                "{files} message files: {identical} identical, fields of {fields_equal} equal to the {with_json} JSON files"
            ));
        }
        let Self { xml_files, well_formed, objects, stable, warnings, .. } = self;
        if *xml_files > 0 {
            print_line(format_args!(
                "{xml_files} XML files: {well_formed} well-formed, {stable} of {objects} objects stable, {warnings} elements passed over"
            ));
        }
    }
}

/// The JSON form that stands beside a message.
fn expected(file: &Path) -> Result<Option<Value>, Failure> {
    let beside = file.with_extension("json");
    if !beside.is_file() {
        return Ok(None);
    }
    let json = serde_json::from_slice(&input::read(&beside)?);
    json.map(Some).map_err(|why| Failure::Usage(format!("{}: {why}", beside.display())))
}

/// Whether all messages of a file are encoded to the same bytes, and whether the fields of the one are as expected.
fn verify(bytes: &[u8], expected: Option<&Value>) -> Result<(bool, Option<bool>), DecodeError> {
    let mut verified = (true, None);
    let mut offset = 0;
    for message in lmcp::split(bytes) {
        let message = message?;
        let one = lmcp::verify(message, expected.unwrap_or(&Value::Null)).map_err(|why| why.after(offset))?;
        verified.0 &= one.identical;
        verified.1 = expected.map(|_| one.fields_equal && offset == 0);
        offset += message.len();
    }
    Ok(verified)
}
