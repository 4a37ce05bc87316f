//! `aldis idl`: folders of IDL, without a bus.

use super::exit::Failure;
use super::print_line;
use crate::idl_folder::{self, FolderError};
use aldis_envelope::KeyWidth;
use aldis_envelope::description::{Extensibility, Library, Topic};
use clap::{Subcommand, ValueEnum};
use serde_json::json;
use std::path::PathBuf;

/// Read folders of IDL.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  aldis idl check UMAA-IDL-6.0 --json")]
pub(crate) struct IdlArgs {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// List the topics of a folder with their types and keys, or what cannot be read and where.
    Check(Check),
}

/// List the topics of a folder with their types and keys, or what cannot be read and where.
#[derive(clap::Args)]
struct Check {
    /// The folder; all files `*.idl` below it are read.
    folder: PathBuf,
    /// What a type is that no annotation tells.
    #[arg(long, value_enum, default_value_t = Default::Appendable)]
    default: Default,
    /// One JSON object a topic: `topic`, `type`, `extensibility`, `keys` with `path` and `type`, `key_fits_hash`; then one of the folder:
    /// `ok`, `files`, `topics`, `types`. Or one a mistake: `file`, `line`, `message`.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Default {
    Final,
    Appendable,
}

impl IdlArgs {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let What::Check(check) = self.what;
        check.run()
    }
}

impl Check {
    fn run(self) -> Result<(), Failure> {
        let default = match self.default {
            Default::Final => Extensibility::Final,
            Default::Appendable => Extensibility::Appendable,
        };
        let (idl, files) = match idl_folder::read(&self.folder, default) {
            Ok(read) => read,
            Err(FolderError::Wrong(errors)) => {
                for error in &errors {
                    match self.json {
                        true => print_line(
                            json!({ "file": error.file, "line": error.line, "message": error.what }),
                        ),
                        false => print_line(error),
                    }
                }
                return Err(Failure::Failed(FolderError::Wrong(errors).to_string()));
            }
            Err(error) => return Err(Failure::Usage(error.to_string())),
        };
        idl.topics.iter().for_each(|topic| self.topic(&idl.library, topic));
        let (topics, types) = (idl.topics.len(), idl.library.definitions().count());
        match self.json {
            true => print_line(json!({ "ok": true, "files": files, "topics": topics, "types": types })),
            false => print_line(format_args!("{files} files, {topics} topics, {types} types")),
        }
        Ok(())
    }

    fn topic(&self, library: &Library, topic: &Topic) {
        let keys = library.key_members(&topic.type_name);
        let extensibility = library.structure(&topic.type_name).map(|structure| structure.extensibility);
        let extensibility = format!("{:?}", extensibility.unwrap_or_default()).to_lowercase();
        if self.json {
            let keys: Vec<_> =
                keys.iter().map(|key| json!({ "path": key.path, "type": key.r#type.to_string() })).collect();
            let fits = library.key_width(&topic.type_name) == KeyWidth::Fits16;
            print_line(json!({
                "topic": topic.name, "type": topic.type_name, "extensibility": extensibility, "keys": keys,
                "key_fits_hash": fits,
            }));
            return;
        }
        let keys: Vec<_> = keys.iter().map(|key| format!("{} {}", key.r#type, key.path)).collect();
        let keys = if keys.is_empty() { "no key".to_owned() } else { format!("key {}", keys.join(", ")) };
        print_line(format_args!("{}\n  {}, {extensibility}\n  {keys}", topic.name, topic.type_name));
    }
}
