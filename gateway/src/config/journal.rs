//! Where the node keeps what must outlive the program.

use super::bridge::in_range;
use super::error::Fault;
use aldis_services::journal::JournalConfig;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The `[journal]` table. Without it nothing outlives the program, and each start counts its life by the wall clock.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Journal {
    /// A directory of its own, made where there is none; relative to the configuration file. One node uses it at a time.
    pub(crate) path: PathBuf,
    /// The most that is kept, in MiB; on disk it may take twice as much. Beyond it what must be kept is refused.
    /// Default: 1024.
    #[serde(default = "limit")]
    #[schemars(range(min = 1, max = 1_048_576))]
    limit_mib: u32,
}

fn limit() -> u32 {
    1024
}

impl Journal {
    pub(super) fn check(&self) -> Result<(), Fault> {
        if self.path.as_os_str().is_empty() {
            let help = "name a directory: path = \"journal\"";
            return Err(Fault::new("path", "the journal has no directory", help));
        }
        in_range("limit_mib", self.limit_mib, 1..=1_048_576, "MiB")
    }

    /// A relative path is taken from the directory of the configuration.
    pub(super) fn resolve(&mut self, directory: &Path) {
        self.path = directory.join(&self.path);
    }

    /// How it is kept, where it is begun with this seed.
    pub(crate) fn config(&self, seed: u64) -> JournalConfig {
        JournalConfig { limit_bytes: u64::from(self.limit_mib) << 20, ..JournalConfig::new(seed) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Config;

    #[test]
    fn a_journal_has_a_directory_and_a_limit() {
        let read = |text: &str| Config::parse("", &format!("name = \"a\"\nentities = [1]\n{text}"));
        assert_eq!(read("").unwrap().journal, None);
        let journal = read("[journal]\npath = \"kept\"").unwrap().journal.unwrap();
        assert_eq!(journal.config(7).limit_bytes, 1 << 30);
        for wrong in ["", "path = \"\"", "path = \"a\"\nlimit_mib = 0", "path = \"a\"\nlimit = 5"] {
            assert!(read(&format!("[journal]\n{wrong}")).is_err(), "{wrong}");
        }
    }
}
