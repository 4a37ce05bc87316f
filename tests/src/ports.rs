//! Ports that nobody uses.

use fastrand::Rng;
use std::collections::BTreeSet;
use std::net::{Ipv4Addr, TcpListener};
use std::sync::{Mutex, PoisonError};

/// Below the ports that systems give to outgoing connections, so that no connection takes one before its node does.
const RANGE: std::ops::Range<u16> = 10_000..32_000;

/// A port of 127.0.0.1 on which nobody listens, given out once in this process.
///
/// # Panics
/// When no port is free.
pub fn free_port() -> u16 {
    static GIVEN: Mutex<Option<(Rng, BTreeSet<u16>)>> = Mutex::new(None);
    let mut given = GIVEN.lock().unwrap_or_else(PoisonError::into_inner);
    // Processes that test at the same time draw other ports.
    let begin = || (Rng::with_seed(u64::from(std::process::id())), BTreeSet::new());
    let (random, given) = given.get_or_insert_with(begin);
    let is_free = |port: u16| TcpListener::bind((Ipv4Addr::LOCALHOST, port)).is_ok();
    let mut drawn = std::iter::repeat_with(|| random.u16(RANGE)).take(10_000);
    drawn.find(|port| is_free(*port) && given.insert(*port)).expect("a port is free")
}
