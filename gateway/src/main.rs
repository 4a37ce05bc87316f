//! Aldis: a Zenoh-based gateway for fleets of unmanned vehicles.
//!
//! This program only moves bytes: everything that has a meaning is decided in `aldis-services`.

mod bridge;
mod bus;
mod carrier;
mod cli;
mod clock;
mod config;
mod idl_folder;
mod journal;
mod runtime;

fn main() -> std::process::ExitCode {
    cli::main()
}
