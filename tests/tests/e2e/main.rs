//! End to end: nodes as real processes, real sockets, real signals. Each test has its own nodes, ports and directory.

#![allow(clippy::unwrap_used, reason = "a test fails by a panic, in its helpers too")]

mod access;
mod allocation;
mod calls;
mod foreign;
mod idl;
mod journal;
mod link;
mod lmcp;
mod observe;
mod relay;
mod run;
mod serial;
mod stream;
mod zenoh_client;
