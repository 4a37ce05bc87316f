//! From the `[bus]` table to Zenoh's configuration. Everything that decides who can join is set here, so that no
//! default of Zenoh opens a port or a door.

use super::{Bus, Mode, Scouting, Tls};
use crate::config::locator::Locator;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// The first wait before an absent peer is tried again.
const RETRY_FIRST_MS: u32 = 250;
/// The longest wait: a vehicle that comes back into reach is heard again within it.
const RETRY_MAX_MS: u32 = 4000;

/// Why the bus cannot be opened as configured.
#[derive(Debug, thiserror::Error)]
pub(crate) enum BusError {
    /// A file that the configuration names cannot be read.
    #[error("cannot read `bus.{key}` = {}: {error}", path.display())]
    Unreadable {
        /// The key that names it.
        key: &'static str,
        /// The file.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// A file that the configuration names does not hold what it must.
    #[error("`bus.{key}` = {}: {what}", path.display())]
    Unusable {
        /// The key that names it.
        key: &'static str,
        /// The file.
        path: PathBuf,
        /// What is wrong with it, and what to do.
        what: String,
    },
    /// Zenoh refuses a value.
    #[error("Zenoh refuses `{key}`: {reason}")]
    Refused {
        /// The key in Zenoh's configuration.
        key: String,
        /// Why.
        reason: String,
    },
}

/// Zenoh's configuration for a `[bus]` table. Reads the files with the password, the users and the access control.
///
/// # Errors
/// [`BusError`] when a file cannot be read or used, or Zenoh refuses a value. The result holds the password: it is
/// not for logs.
pub(crate) fn zenoh_config(bus: &Bus) -> Result<zenoh::Config, BusError> {
    let mut config = zenoh::Config::default();
    for (key, value) in links(bus).into_iter().chain(scouting(bus.scouting)).chain(quiet()) {
        insert(&mut config, key, &value)?;
    }
    insert(&mut config, "transport/link/tls", &tls(&bus.tls))?;
    insert(&mut config, "transport/auth/usrpwd", &users(bus)?)?;
    if let Some(path) = &bus.zenoh_config {
        insert(&mut config, "access_control", &access_control(path)?)?;
    }
    Ok(config)
}

/// The password of the node's user; none where no user is named.
///
/// # Errors
/// [`BusError`] when the file cannot be read or is empty.
pub(crate) fn password(bus: &Bus) -> Result<Option<String>, BusError> {
    let key = "password_file";
    let Some(path) = &bus.password_file else { return Ok(None) };
    // Editors end files with a line break, and Zenoh trims the passwords of its list of users: the same here.
    let password = read(key, path)?.trim().to_owned();
    if password.is_empty() || password.contains('\n') {
        let what = "the file must hold one line, the password".to_owned();
        return Err(BusError::Unusable { key, path: path.clone(), what });
    }
    Ok(Some(password))
}

type Settings = Vec<(&'static str, Value)>;

fn links(bus: &Bus) -> Settings {
    let locators = |list: &[Locator]| json!(list.iter().map(Locator::as_str).collect::<Vec<_>>());
    // A peer or a router starts without those that it connects to and tries them in the background for ever (-1). A
    // client is nothing without its one router: it tries each locator once (0) and says so, and the caller tries
    // again, because with a time to wait Zenoh would stay with the first absent locator and never try the second.
    let timeout_ms = if bus.mode == Mode::Client { 0 } else { -1 };
    vec![
        ("mode", json!(bus.mode.as_str())),
        // Set even when empty: Zenoh's own default listens on every interface.
        ("listen/endpoints", locators(&bus.listen)),
        // A port in use is an error at once, for the caller to tell and to retry.
        ("listen/timeout_ms", json!(0)),
        ("listen/exit_on_failure", json!(true)),
        ("connect/endpoints", locators(&bus.connect)),
        ("connect/timeout_ms", json!(timeout_ms)),
        ("connect/exit_on_failure", json!(bus.mode == Mode::Client)),
        (
            "connect/retry",
            json!({
                "period_init_ms": RETRY_FIRST_MS, "period_max_ms": RETRY_MAX_MS, "period_increase_factor": 2
            }),
        ),
    ]
}

/// Off unless asked for: who is joined stands in the configuration. Multicast finds the first, gossip the others.
fn scouting(scouting: Scouting) -> Settings {
    let mut settings = vec![
        ("scouting/multicast/enabled", json!(scouting == Scouting::Multicast)),
        ("scouting/gossip/enabled", json!(scouting != Scouting::None)),
    ];
    if scouting == Scouting::None {
        // A router waits so long for those whom it may find before it is open, and hears nothing of what it already
        // passes on between others.
        settings.push(("scouting/delay", json!(0)));
    }
    settings
}

/// What Aldis does itself or does not offer. The queues stay as Zenoh has them: congestion control is a property of
/// each publisher, which takes it from `bus.congestion`, and Zenoh bounds a blocked one to 5 s before it closes the
/// link.
fn quiet() -> Settings {
    vec![
        // Administration is service 1 of a node, under `[allow]`; Zenoh's own would pass it by.
        ("adminspace/enabled", json!(false)),
        // Stamps are the envelope's; Zenoh's would cost 24 bytes a message, on routers by default.
        ("timestamping/enabled", json!(false)),
    ]
}

fn tls(tls: &Tls) -> Value {
    json!({
        "root_ca_certificate": tls.root_ca_certificate,
        "listen_certificate": tls.listen_certificate,
        "listen_private_key": tls.listen_private_key,
        "connect_certificate": tls.connect_certificate,
        "connect_private_key": tls.connect_private_key,
        "enable_mtls": tls.enable_mtls,
        "verify_name_on_connect": tls.verify_name_on_connect,
        // A certificate that ends, ends its link: else a vehicle lost for good stays joined for as long as it stays
        // up.
        "close_link_on_expiration": true,
    })
}

fn users(bus: &Bus) -> Result<Value, BusError> {
    if let Some(path) = &bus.dictionary_file {
        check_dictionary(path)?;
    }
    Ok(json!({
        "user": bus.user.as_ref().map(|user| user.as_str()),
        "password": password(bus)?,
        "dictionary_file": bus.dictionary_file,
    }))
}

/// Zenoh takes an empty list of users for none at all, and lets everybody in.
fn check_dictionary(path: &Path) -> Result<(), BusError> {
    let key = "dictionary_file";
    let unusable = |what: String| BusError::Unusable { key, path: path.to_owned(), what };
    let mut users = 0;
    for (number, line) in read(key, path)?.lines().enumerate() {
        if line.trim().is_empty() {
            continue;
        }
        match line.split_once(':') {
            Some((user, password)) if !user.trim().is_empty() && !password.trim().is_empty() => users += 1,
            _ => return Err(unusable(format!("line {} is not `user:password`", number + 1))),
        }
    }
    match users {
        0 => Err(unusable("the file names no user; write a line `user:password` for each".to_owned())),
        _ => Ok(()),
    }
}

/// The access control of a Zenoh configuration file; it must be switched on, for else the file protects nothing.
fn access_control(path: &Path) -> Result<Value, BusError> {
    let key = "zenoh_config";
    let text = read(key, path)?;
    let unusable = |what: String| BusError::Unusable { key, path: path.to_owned(), what };
    let file =
        zenoh::Config::from_json5(&text).map_err(|e| unusable(format!("not a Zenoh configuration: {e}")))?;
    let section = file.get_json("access_control").map_err(|e| unusable(e.to_string()))?;
    let section: Value = serde_json::from_str(&section).map_err(|e| unusable(e.to_string()))?;
    if section["enabled"] != json!(true) {
        return Err(unusable("no `access_control` is enabled in it; print one with `aldis acl`".to_owned()));
    }
    Ok(section)
}

fn read(key: &'static str, path: &Path) -> Result<String, BusError> {
    std::fs::read_to_string(path).map_err(|error| BusError::Unreadable { key, path: path.to_owned(), error })
}

fn insert(config: &mut zenoh::Config, key: &str, value: &Value) -> Result<(), BusError> {
    let refused = |e: zenoh::Error| BusError::Refused { key: key.to_owned(), reason: e.to_string() };
    config.insert_json5(key, &value.to_string()).map_err(refused)
}

#[cfg(test)]
mod tests;
