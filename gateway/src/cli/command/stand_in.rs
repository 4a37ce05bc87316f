//! `aldis command stand-in`: a provider that fails every command in the way that it is told, to try consumers against.

use super::super::exit::Failure;
use super::super::member::{Desk, Join, Member};
use super::super::print_line;
use super::super::run::watch_signals;
use super::super::within::Within;
use aldis_envelope::umaa::{NoExecutionStatus, ResourceAllocationPriorityCommand};
use aldis_envelope::{Monotonic, Now, ServiceId, Source};
use aldis_services::umaa::command::{
    Commanded, Everybody, Executor, Failure as Failed, FailureKind, Progress, Provider, ProviderSettings,
    SessionId, Stop, Stopped, Verdict,
};
use aldis_services::{Input, Outbox};
use serde_json::json;
use std::collections::BTreeMap;
use std::sync::mpsc;
use std::time::Duration;

type Stood = ResourceAllocationPriorityCommand;

/// Stand in for a provider of ResourceAllocationPriorityCommand, and fail every command in the way that is told.
///
/// A real provider fails seldom, and in few of the ways that figure 5 of the ICD has. With this one a consumer can be tried
/// against each. It sets no priorities. Where it is stopped (SIGINT or SIGTERM), it fails what is open and ends.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis command stand-in --fails resource-failed
  aldis command stand-in --as 400 --sid 120 --fails timeout --after 500ms")]
pub(super) struct StandIn {
    /// How every command fails.
    #[arg(long, value_enum)]
    fails: Way,
    /// How long a command is executed before, where it is.
    #[arg(long, default_value = "1s")]
    after: Within,
    /// The service of the entity that provides.
    #[arg(long, default_value = "110", value_name = "SID")]
    sid: ServiceId,
    /// One JSON object a line.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    join: Join,
}

/// A reason of figure 5, with the state from which it is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Way {
    /// From ISSUED.
    ValidationFailed,
    /// From COMMANDED.
    ResourceRejected,
    /// From EXECUTING; so are those that follow.
    ObjectiveFailed,
    /// The resource fails.
    ResourceFailed,
    /// Something of higher priority takes over.
    Interrupted,
    /// The service itself fails.
    ServiceFailed,
    /// The time limit of the execution is over.
    Timeout,
}

impl Way {
    fn failure(self) -> Failed {
        let kind = match self {
            Self::ValidationFailed => FailureKind::Invalid,
            Self::ResourceRejected => FailureKind::Rejected,
            Self::ObjectiveFailed => FailureKind::Objective,
            Self::ResourceFailed => FailureKind::Resource,
            Self::Interrupted => FailureKind::Interrupted,
            Self::ServiceFailed => FailureKind::Service,
            Self::Timeout => FailureKind::TimedOut,
        };
        Failed::new(kind, "as this stand-in was told")
    }
}

/// Executes nothing, and fails.
struct Script {
    way: Way,
    after: Duration,
    ends: BTreeMap<SessionId, Monotonic>,
}

impl Executor<Stood> for Script {
    fn validate(&mut self, _: Now, _: Commanded<'_, Stood>, _: &mut Outbox) -> Verdict {
        match self.way {
            Way::ValidationFailed => Verdict::Failed(self.way.failure()),
            _ => Verdict::Valid,
        }
    }

    fn start(
        &mut self,
        now: Now,
        commanded: Commanded<'_, Stood>,
        _: &mut Outbox,
    ) -> Progress<NoExecutionStatus> {
        if self.way == Way::ResourceRejected {
            return Progress::Failed(self.way.failure());
        }
        self.ends.insert(commanded.id, now.monotonic + self.after);
        Progress::Running(None)
    }

    fn progress(
        &mut self,
        now: Now,
        commanded: Commanded<'_, Stood>,
        _: &mut Outbox,
    ) -> Progress<NoExecutionStatus> {
        let is_over = self.ends.get(&commanded.id).is_none_or(|at| *at <= now.monotonic);
        // The provider's own time limit ends what times out.
        if is_over && self.way != Way::Timeout {
            self.ends.remove(&commanded.id);
            return Progress::Failed(self.way.failure());
        }
        Progress::Running(None)
    }

    fn stop(&mut self, _: Now, commanded: Commanded<'_, Stood>, _: Stop, _: &mut Outbox) -> Stopped {
        self.ends.remove(&commanded.id);
        Stopped::Now
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.ends.values().min().copied().filter(|_| self.way != Way::Timeout)
    }
}

/// The provider, and whom to tell that it serves.
struct Stage {
    provider: Provider<Stood, Script, Everybody>,
    tell: mpsc::Sender<bool>,
}

impl Desk for Stage {
    fn take(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        self.provider.handle(now, &input, out);
        if let Input::HistoryComplete(_) = input {
            // The command no longer listens where it has been cut off.
            let _ = self.tell.send(true);
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.provider.next_deadline()
    }
}

impl StandIn {
    pub(super) fn run(&self) -> Result<(), Failure> {
        let source = Source::new(self.join.own()?, self.sid);
        let settings = ProviderSettings {
            execute_within: (self.fails == Way::Timeout).then_some(self.after.0),
            ..ProviderSettings::default()
        };
        let script = Script { way: self.fails, after: self.after.0, ends: BTreeMap::new() };
        let provider = Provider::new(source, self.join.guids()?, settings, script, Everybody);
        let prefixes = provider.subscriptions();
        let (tell, told) = mpsc::channel();
        let stop = tell.clone();
        watch_signals(move || {
            let _ = stop.send(false);
        })?;
        let member = Member::join_as(&self.join, self.sid, prefixes, Stage { provider, tell })?;
        let mut done = told.recv_timeout(super::super::JOIN_WITHIN * 2);
        if done == Ok(true) {
            match self.json {
                true => print_line(json!({ "event": "serving", "service": source.to_string() })),
                false => print_line(format_args!("{source} fails every command: stop it with an interrupt")),
            }
            while done == Ok(true) {
                done = told.recv().map_err(|_| mpsc::RecvTimeoutError::Disconnected);
            }
        }
        member.leave()?;
        done.map(drop).map_err(|_| self.join.unreachable())
    }
}
