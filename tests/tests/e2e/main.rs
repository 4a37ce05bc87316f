//! End to end: nodes as real processes, real sockets, real signals. Each test has its own nodes, ports and directory.

mod access;
mod calls;
mod foreign;
mod relay;
mod run;
mod stream;
mod zenoh_client;
