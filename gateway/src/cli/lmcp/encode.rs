//! `aldis lmcp encode`: JSON or XML to LMCP.

use super::super::exit::Failure;
use super::super::print_line;
use super::input::{self, objects_of_json, objects_of_xml};
use aldis_envelope::lmcp::{self, Object};
use serde_json::json;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;

/// JSON or XML to LMCP: messages one after the other.
///
/// JSON is what `aldis lmcp decode` prints, of which `_type` and `fields` are needed; XML is a message file or a
/// scenario, whose objects are written in their order.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis lmcp encode task.xml -o task.lmcp
  aldis lmcp encode scenario.xml -o scenario.lmcp --json
  echo '{\"_type\":\"afrl.cmasi.RemoveTasks\",\"fields\":{\"TaskList\":[7]}}' | aldis lmcp encode - | xxd

Exit codes: 0 all is written; 1 it is no JSON or XML of LMCP objects; 2 it cannot be read or written.")]
pub(super) struct Encode {
    /// The file; `-` is standard input.
    file: PathBuf,
    /// Where to; by default standard output.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// One JSON object at the end, where there is an output file: `messages` and `bytes`.
    #[arg(long, requires = "output")]
    json: bool,
}

impl Encode {
    pub(super) fn run(self) -> Result<(), Failure> {
        if self.output.is_none() && std::io::stdout().is_terminal() {
            return Err(Failure::Usage("LMCP is nothing for a terminal: name a file with -o".into()));
        }
        let objects = self.objects()?;
        let mut bytes = Vec::new();
        for (place, object) in objects.iter().enumerate() {
            let message = lmcp::encode(object.as_ref());
            let failed =
                |why| Failure::Failed(format!("{}: object {}: {why}", self.file.display(), place + 1));
            bytes.extend(message.map_err(failed)?);
        }
        let Some(output) = &self.output else {
            let written = std::io::stdout().lock().write_all(&bytes);
            return written.map_err(|why| Failure::Failed(format!("cannot write: {why}")));
        };
        std::fs::write(output, &bytes)
            .map_err(|why| Failure::Usage(format!("cannot write {}: {why}", output.display())))?;
        if self.json {
            print_line(json!({ "messages": objects.len(), "bytes": bytes.len() }));
        }
        Ok(())
    }

    fn objects(&self) -> Result<Vec<Box<dyn Object>>, Failure> {
        let bytes = input::read(&self.file)?;
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes).trim_ascii_start();
        if text.starts_with(b"<") {
            let placed = objects_of_xml(&self.file, &bytes)?;
            return Ok(placed.into_iter().map(|placed| placed.object).collect());
        }
        objects_of_json(&self.file, &bytes)
    }
}
