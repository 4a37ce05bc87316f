//! `aldis uxas`: what OpenUxAS left.

use super::exit::Failure;
use crate::config::{Config, uxas_file};
use clap::Subcommand;
use serde_json::json;
use std::path::PathBuf;

/// Bring configurations of OpenUxAS over.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  aldis uxas import cfg_WaterwaySearch.xml > waterway.toml\n  aldis run cfg_WaterwaySearch.xml"
)]
pub(crate) struct Uxas {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// Write the configuration that does the same, and say what has no equivalent.
    Import(Import),
}

/// Write the configuration that does the same, and say what has no equivalent.
///
/// The configuration goes to standard output, what is to be said to standard error; both say the same in comments of the
/// configuration.
#[derive(clap::Args)]
struct Import {
    /// The configuration of OpenUxAS.
    config: PathBuf,
    /// Write to this file in place of standard output.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// One JSON object: `toml`, and `remarks` with `line` and `text`.
    #[arg(long)]
    json: bool,
}

impl Uxas {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let What::Import(import) = self.what;
        import.run()
    }
}

impl Import {
    fn run(self) -> Result<(), Failure> {
        let imported = uxas_file::import(&self.config).map_err(|why| Failure::Usage(why.to_string()))?;
        // What is written must load.
        Config::of_uxas(&self.config, &imported)?;
        if self.json {
            let remarks: Vec<_> =
                imported.remarks.iter().map(|r| json!({ "line": r.line, "text": r.text })).collect();
            super::print_line(json!({ "toml": imported.toml, "remarks": remarks }));
            return Ok(());
        }
        for remark in &imported.remarks {
            eprintln!("aldis: {}:{}: {}", self.config.display(), remark.line, remark.text);
        }
        match &self.output {
            None => super::print_line(imported.toml.trim_end()),
            Some(output) => std::fs::write(output, imported.toml)
                .map_err(|why| Failure::Failed(format!("cannot write {}: {why}", output.display())))?,
        }
        Ok(())
    }
}
