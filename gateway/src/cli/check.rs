//! `aldis check`, `aldis acl` and `aldis schema`: configurations without running them.

use super::exit::Failure;
use super::print_line;
use crate::config::{self, Config, ConfigError};
use serde_json::json;
use std::path::PathBuf;

/// Say what is wrong with configurations, if anything.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  aldis check configs/*.toml")]
pub(crate) struct Check {
    /// The configurations.
    #[arg(required = true)]
    configs: Vec<PathBuf>,
    /// One JSON object a file: `file`, `ok`, `warnings` of what starves on links, and where it is wrong `message`, `line`, `column`, `help`,
    /// and `more` mistakes.
    #[arg(long)]
    json: bool,
}

impl Check {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let mut wrong = 0;
        for path in &self.configs {
            let loaded = Config::load(path);
            wrong += usize::from(loaded.is_err());
            match loaded {
                Ok(config) if self.json => {
                    let warnings = super::link::starving(&config);
                    print_line(
                        json!({ "file": path.display().to_string(), "ok": true, "warnings": warnings }),
                    );
                }
                Ok(config) => {
                    let (name, entity) = (config.name.as_str(), config.entities.own());
                    print_line(format_args!("{}: {name}, entity {entity}: good", path.display()));
                    for warning in super::link::starving(&config) {
                        print_line(format_args!("  warning: {warning}"));
                    }
                }
                Err(error) if self.json => {
                    let place = error.position();
                    print_line(json!({
                        "file": error.file(), "ok": false, "message": error.message(), "help": error.cure(),
                        "more": error.more().iter().map(ConfigError::message).collect::<Vec<_>>(), "line": place.map(|(line, _)| line), "column": place.map(|(_, column)| column),
                    }));
                }
                Err(error) => eprintln!("{:?}", miette::Report::new(error)),
            }
        }
        match wrong {
            0 => Ok(()),
            n => Err(Failure::Usage(format!("{n} of {} configurations are wrong", self.configs.len()))),
        }
    }
}

/// Print the access control of the routers for these nodes: Zenoh's `access_control`, as JSON.
///
/// Deny by default; each node may put, reply and show tokens for its own entities alone. A router loads it with
/// `zenoh_config` in its `[bus]` table.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  aldis acl configs/shore.toml configs/vehicle-400.toml > access-control.json5"
)]
pub(crate) struct Acl {
    /// The configurations of all nodes that join.
    #[arg(required = true)]
    configs: Vec<PathBuf>,
}

impl Acl {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let configs = self.configs.iter().map(|path| Config::load(path)).collect::<Result<Vec<_>, _>>()?;
        let acl = config::acl(&configs).map_err(|why| Failure::Usage(why.to_string()))?;
        print_line(format_args!("{acl:#}"));
        Ok(())
    }
}

/// Print the JSON Schema of a configuration, for editors.
#[derive(clap::Args)]
pub(crate) struct Schema {}

impl Schema {
    pub(crate) fn run(self) -> Result<(), Failure> {
        print_line(format_args!("{:#}", config::schema()));
        Ok(())
    }
}
