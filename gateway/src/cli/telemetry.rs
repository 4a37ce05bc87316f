//! What the program writes about itself, to standard error: as text or JSON.

use crate::config::{Level, Log, LogFormat};
use tracing_subscriber::EnvFilter;

/// What Zenoh 1.10.2 says at every orderly end, as an error: that it does not know a token which it told itself.
const NOISE: &str = "zenoh::net::routing::hat=off";

/// Starts the log. `RUST_LOG` overrules the level. Zenoh speaks of errors alone.
pub(crate) fn start(log: &Log) {
    let level = match log.level {
        Level::Error => "error",
        Level::Warn => "warn",
        Level::Info => "info",
        Level::Debug => "debug",
        Level::Trace => "trace",
    };
    let filter = EnvFilter::try_from_default_env()
        .unwrap_or_else(|_| EnvFilter::new(format!("error,{NOISE},aldis={level}")));
    let builder =
        tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).with_target(false);
    // A second start in one process keeps the first.
    let _ = match log.format {
        LogFormat::Text => builder.with_ansi(false).try_init(),
        LogFormat::Json => builder.json().try_init(),
    };
}
