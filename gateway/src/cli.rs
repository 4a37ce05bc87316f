//! The command line.

mod allocation;
mod assign;
mod bench;
mod call;
mod check;
mod command;
mod conform;
mod content;
mod demo;
#[cfg(feature = "dds")]
mod domain;
mod exit;
mod fleet;
mod health;
mod idl;
mod link;
mod lmcp;
mod log;
mod member;
mod plan;
mod publish;
mod queue;
mod record;
mod replay;
mod retained;
mod route;
mod run;
mod sim;
mod simulate;
mod subscribe;
mod telemetry;
mod uxas;
mod within;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// How long joining the bus may take before it is said to be out of reach.
const JOIN_WITHIN: std::time::Duration = std::time::Duration::from_secs(5);

const AFTER_HELP: &str = "\
Two commands to begin with:
  aldis demo                          a shore station and three boats in one process
  aldis run configs/shore.toml        a node; in other terminals:
  aldis sub afrl.cmasi                what comes by
  aldis call eid400sid1 --ping        is vehicle 400 there?

Exit codes: 0 done; 1 it failed; 2 wrong usage or configuration, nothing was started;
3 nobody is there; 4 no answer before the deadline; 5 the bus is out of reach.";

/// A gateway for fleets of unmanned vehicles: UMAA and UxAS messages in envelopes over Zenoh.
#[derive(Parser)]
#[command(name = "aldis", version, after_help = AFTER_HELP, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// A shore station and three boats in one process.
    Demo(demo::Demo),
    /// Run a node until it is stopped (SIGINT or SIGTERM).
    Run(run::Run),
    /// Say what is wrong with configurations, if anything.
    Check(check::Check),
    /// Print the access control of the routers for these nodes.
    Acl(check::Acl),
    /// Print the JSON Schema of a configuration.
    Schema(check::Schema),
    /// Publish a message.
    Pub(publish::Publish),
    /// Show messages as they come.
    Sub(subscribe::Subscribe),
    /// Call a service, a mailbox or all services of an entity.
    Call(call::CallArgs),
    /// Show who is there.
    Fleet(fleet::FleetArgs),
    /// Take control of a resource, and hold it.
    Allocate(allocation::Allocate),
    /// Have a running `aldis allocate` give its resource back.
    Release(allocation::Release),
    /// Show or set who may control which resource.
    Priority(allocation::Priority),
    /// Follow UMAA commands.
    #[command(name = "command")]
    Flow(command::CommandArgs),
    /// Watch UMAA traffic and report what of the ICD was held and broken.
    Conform(conform::Conform),
    /// Record envelopes into a file.
    Record(record::Record),
    /// Send a recording again.
    Replay(replay::Replay),
    /// Show the latest health report of every resource.
    Health(health::HealthArgs),
    /// Show the log that a node keeps of the fleet.
    Log(log::LogArgs),
    /// Read folders of IDL: topics, types, keys, or what is wrong.
    Idl(idl::IdlArgs),
    /// Read, write and check LMCP messages in files.
    Lmcp(lmcp::Lmcp),
    /// Say which vehicle does which task, in which way and order.
    Assign(assign::Assign),
    /// Find a way around zones, with turns no tighter than the vehicle makes.
    Route(route::Route),
    /// Plan what a scenario asks for, offline: assignments, missions, a picture.
    Plan(plan::Plan),
    /// Links of nodes, and bad links to try them on.
    Link(link::LinkArgs),
    /// DDS domains, and the routes of bridges to them.
    #[cfg(feature = "dds")]
    #[command(name = "dds")]
    Domain(domain::DdsArgs),
    /// Commands that wait to cross a link.
    Queue(queue::QueueArgs),
    /// Simulate in virtual time.
    Sim(sim::Sim),
    /// Plan a scenario and let simulated vehicles do it, until all tasks are complete.
    Simulate(simulate::Simulate),
    /// Bring configurations of OpenUxAS over.
    Uxas(uxas::Uxas),
    /// Measure this machine, side by side with the limit.
    Bench(bench::Bench),
}

/// Runs what the command line says.
pub(crate) fn main() -> ExitCode {
    let cli = Cli::parse();
    let done = match cli.command {
        Command::Demo(args) => args.run(),
        Command::Run(args) => args.run(),
        Command::Check(args) => args.run(),
        Command::Acl(args) => args.run(),
        Command::Schema(args) => args.run(),
        Command::Pub(args) => args.run(),
        Command::Sub(args) => args.run(),
        Command::Call(args) => args.run(),
        Command::Fleet(args) => args.run(),
        Command::Allocate(args) => args.run(),
        Command::Release(args) => args.run(),
        Command::Priority(args) => args.run(),
        Command::Flow(args) => args.run(),
        Command::Conform(args) => args.run(),
        Command::Record(args) => args.run(),
        Command::Replay(args) => args.run(),
        Command::Health(args) => args.run(),
        Command::Log(args) => args.run(),
        Command::Idl(args) => args.run(),
        Command::Lmcp(args) => args.run(),
        Command::Assign(args) => args.run(),
        Command::Route(args) => args.run(),
        Command::Plan(args) => args.run(),
        Command::Link(args) => args.run(),
        #[cfg(feature = "dds")]
        Command::Domain(args) => args.run(),
        Command::Queue(args) => args.run(),
        Command::Sim(args) => args.run(),
        Command::Simulate(args) => args.run(),
        Command::Uxas(args) => args.run(),
        Command::Bench(args) => args.run(),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}

/// Writes a line for people or machines; a reader that is gone ends the program quietly, as programs in pipes do.
pub(crate) fn print_line(line: impl std::fmt::Display) {
    use std::io::Write;
    if writeln!(std::io::stdout().lock(), "{line}").is_err() {
        std::process::exit(0);
    }
}
