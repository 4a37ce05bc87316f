//! The same load over plain Zenoh, through the same relay: two sessions that reach each other by it alone.

use super::real::{BYTES, MEET_WITHIN, Real, Score, bytes, failed, free_address, relay};
use crate::cli::bench::service_node::configuration;
use crate::cli::exit::Failure;
use crate::config::bus::zenoh_config;
use serde_json::Value;
use std::net::SocketAddr;
use std::sync::mpsc;
use std::time::{Duration, Instant};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::{Session, Wait};

const KEY: &str = "bench/order";
/// Zenoh sends no shorter datagrams than this when it opens a session.
const MTU: usize = 1_500;

fn open(bus: &str) -> Result<Session, Failure> {
    let config = zenoh_config(&configuration(1, bus)?.bus).map_err(failed)?;
    zenoh::open(config).wait().map_err(failed)
}

/// Why a kind of plain Zenoh is not measured here.
fn refusal(against: &str) -> Option<&'static str> {
    match against {
        "zenoh-udp" => None,
        "zenoh-tcp" => Some(
            "TCP does not pass a relay of datagrams: what is lost would have to be lost below the kernel's TCP. Two network \
             namespaces with netem between them show it; `--against zenoh-udp` works here",
        ),
        "zenoh-quic" => Some("this program is built without Zenoh's QUIC; `--against zenoh-udp` works here"),
        _ => Some("there are zenoh-udp, zenoh-tcp and zenoh-quic"),
    }
}

/// Whether a kind of plain Zenoh can be measured here.
pub(super) fn check(against: &str) -> Result<(), Failure> {
    refusal(against).map_or(Ok(()), |why| Err(Failure::Usage(format!("--against {against}: {why}"))))
}

/// Measures plain Zenoh over UDP.
pub(super) fn run(real: &Real) -> Result<Value, Failure> {
    let listen: SocketAddr = free_address()?;
    let (relay, passed) = relay(real, MTU, listen)?;
    let far = open(&format!("mode = \"peer\"\nlisten = [\"udp/{listen}\"]"))?;
    let (tell, told) = mpsc::channel();
    let subscriber = far
        .declare_subscriber(KEY)
        .callback(move |sample| {
            // Nobody listens any more where the measurement has ended.
            let _ = tell.send(sample.payload().to_bytes().into_owned());
        })
        .wait()
        .map_err(failed)?;
    let near = open(&format!("mode = \"peer\"\nconnect = [\"udp/{}\"]", relay.address))?;
    let publisher = near
        .declare_publisher(KEY)
        .congestion_control(CongestionControl::Block)
        .priority(Priority::RealTime)
        .express(true)
        .wait()
        .map_err(failed)?;
    let send = |content: &[u8]| publisher.put(content.to_vec()).wait().map_err(failed);
    let until = Instant::now() + MEET_WITHIN;
    while told.recv_timeout(Duration::from_millis(500)).is_err() {
        if Instant::now() > until {
            return Err(Failure::Failed("two sessions of plain Zenoh do not meet through the relay".into()));
        }
        send(&[0; BYTES])?;
    }
    while told.recv_timeout(Duration::from_secs(3)).is_ok() {}
    let before = bytes(&passed);
    let mut score = Score::default();
    let paced = real.pace(&mut score, send, |score, wait| {
        if let Ok(content) = told.recv_timeout(wait) {
            score.came(&content);
        }
        Ok(())
    });
    subscriber.undeclare().wait().map_err(failed)?;
    paced?;
    Ok(score.object(bytes(&passed) - before))
}
