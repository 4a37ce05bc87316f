//! `aldis run`: a node until it is stopped.

use super::exit::Failure;
use super::telemetry;
use crate::config::Config;
use crate::config::uxas_file::{self, Remark};
use crate::runtime::{self, Control};
use std::path::PathBuf;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::mpsc;

/// Run a node until it is stopped (SIGINT or SIGTERM).
///
/// The node ends in order: it disposes its health reports and withdraws its tokens, within a bound of five seconds.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  aldis run configs/shore.toml\n  aldis run cfg_WaterwaySearch.xml")]
pub(crate) struct Run {
    /// The node's configuration; one of OpenUxAS where the name ends in `.xml`.
    config: PathBuf,
}

impl Run {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let (config, remarks) = self.load()?;
        let outside = runtime::outside(&config).map_err(|why| Failure::Usage(why.to_string()))?;
        telemetry::start(&config.log);
        for remark in remarks {
            tracing::warn!("{}:{}: {}", self.config.display(), remark.line, remark.text);
        }
        tracing::info!(
            "{}: entity {} of fleet {}",
            config.name.as_str(),
            config.entities.own(),
            config.fleet
        );
        let (control, controlled) = mpsc::unbounded_channel();
        watch_signals(move || {
            let _ = control.send(Control::Shutdown);
        })?;
        runtime::run(runtime::node_config(&config), outside, controlled)
            .map_err(|why| Failure::Failed(why.to_string()))
    }
}

impl Run {
    /// The configuration, and what is to be said of one of OpenUxAS.
    fn load(&self) -> Result<(Config, Vec<Remark>), Failure> {
        if self.config.extension().is_none_or(|extension| extension != "xml") {
            return Ok((Config::load(&self.config)?, Vec::new()));
        }
        let imported = uxas_file::import(&self.config).map_err(|why| Failure::Usage(why.to_string()))?;
        Ok((Config::of_uxas(&self.config, &imported)?, imported.remarks))
    }
}

/// Asks for an orderly end at the first signal.
pub(crate) fn watch_signals(end: impl FnOnce() + Send + 'static) -> Result<(), Failure> {
    let failed = |why: std::io::Error| Failure::Failed(format!("cannot watch for signals: {why}"));
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(failed)?;
    // Watched from here on, not from when the thread comes to it.
    let (mut interrupt, mut terminate) = {
        let _context = runtime.enter();
        (signal(SignalKind::interrupt()).map_err(failed)?, signal(SignalKind::terminate()).map_err(failed)?)
    };
    let watch = move || {
        runtime.block_on(async {
            tokio::select! {
                _ = interrupt.recv() => {}
                _ = terminate.recv() => {}
            }
            end();
        });
    };
    std::thread::Builder::new().name("signals".into()).spawn(watch).map_err(failed)?;
    Ok(())
}
