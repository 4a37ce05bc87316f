//! `aldis demo`: a shore station and three boats in one process, each with a Zenoh session of its own.

mod board;
mod control;
mod crashing;
mod fleet;
mod linked;
mod map;
mod missions;
mod screen;
mod shore;

use super::exit::Failure;
use super::print_line;
use super::telemetry;
use crate::config::{Level, Log, LogFormat};
use crate::runtime::Control;
use board::{Board, SILENCED};
use fleet::Fleet;
use map::Chart;
use missions::Plan;
use serde_json::json;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::mpsc;

/// How often the table is drawn anew.
const DRAW_EVERY: Duration = Duration::from_millis(500);
/// Boat 403 is silenced from 40 % to 60 % of each turn.
const TURN: Duration = Duration::from_secs(20);
/// How long the nodes may take to tell their status at the end.
const STATUS_WITHIN: Duration = Duration::from_secs(10);

/// A shore station and three boats in one process, each with a Zenoh session of its own.
///
/// Shore plans the harbour scenario with the core services of UxAS, asks each boat's arbiter for control (UMAA ResourceAllocation),
/// and the boats do their missions; they tell where they are (LMCP) and how they do (UMAA HealthReport). Shore calls them each second; boat 403 is silenced for a while and comes back. A planner and an operator on shore contend for the
/// autopilot of boat 401 (UMAA ResourceAllocation): the operator takes over by priority, the planner's time runs out. The
/// arbiter of boat 402 crashes now and then and goes on with the command that it was executing.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  aldis demo\n  aldis demo --headless --seconds 15 --json\n  aldis demo --headless --seconds 60 --link L1 --json\n  aldis demo --headless --missions --link L1 --json"
)]
pub(crate) struct Demo {
    /// No table: only the result at the end.
    #[arg(long)]
    headless: bool,
    /// How long. Default: until it is stopped (SIGINT or SIGTERM); with `--headless` 15.
    #[arg(long)]
    seconds: Option<u64>,
    /// Join the boats to shore by emulated bad links in place of one bus: L1, L2, L3, L4 or WiFi. Shore then sends orders, and boat
    /// 403 is cut off in place of being silenced.
    #[arg(long, value_name = "PROFILE")]
    link: Option<String>,
    /// Run until the boats have completed every task of their missions; 900 s at the longest, unless `--seconds` says otherwise.
    #[arg(long)]
    missions: bool,
    /// How many seconds the boats move in one of the clock.
    #[arg(long, default_value_t = 10.0, value_name = "FACTOR")]
    pace: f64,
    /// The result as one JSON object, the last line.
    #[arg(long)]
    json: bool,
}

impl Demo {
    pub(crate) fn run(self) -> Result<(), Failure> {
        telemetry::start(&Log { level: Level::Error, format: LogFormat::Text });
        let at_most = if self.missions { Some(900) } else { self.headless.then_some(15) };
        let seconds = self.seconds.or(at_most).map(Duration::from_secs);
        let plan = Plan::new(self.pace)?;
        let board = Arc::new(Mutex::new(Board::default()));
        let link = self.link.as_deref().map(super::link::profile).transpose()?;
        let fleet = Fleet::start(&board, link.as_ref(), &plan)?;
        let (stop, stopped) = mpsc::unbounded_channel();
        super::run::watch_signals(move || {
            let _ = stop.send(Control::Shutdown);
        })?;
        let ran = self.play(&fleet, &board, (seconds, &plan), stopped);
        linked::drain(&board);
        let statuses = fleet.statuses(if link.is_some() { linked::STATUS_WITHIN } else { STATUS_WITHIN })?;
        fleet.leave()?;
        let board = board.lock().unwrap_or_else(PoisonError::into_inner);
        self.report(&board.result(&statuses, ran), &plan)
    }

    /// Lets the demo run: draws the table, silences a boat and lets it come back. Returns how long it ran.
    fn play(
        &self,
        fleet: &Fleet,
        board: &Arc<Mutex<Board>>,
        (seconds, plan): (Option<Duration>, &Plan),
        mut stopped: mpsc::UnboundedReceiver<Control>,
    ) -> Duration {
        let start = Instant::now();
        let turn = seconds.filter(|_| !self.missions).unwrap_or(TURN);
        let chart = Chart::new(plan);
        let mut silent = false;
        loop {
            let ran = start.elapsed();
            let is_done =
                || self.missions && board.lock().is_ok_and(|board| board.missions.is_complete(plan));
            if seconds.is_some_and(|seconds| ran >= seconds) || is_done() || stopped.try_recv().is_ok() {
                fleet.silence(false);
                return ran;
            }
            let phase = (ran.as_secs_f64() / turn.as_secs_f64()).fract();
            let wanted = (0.4..0.6).contains(&phase);
            if wanted != silent {
                silent = wanted;
                fleet.silence(silent);
            }
            let mut board = board.lock().unwrap_or_else(PoisonError::into_inner);
            board.silenced = silent.then_some(SILENCED);
            if !self.headless {
                screen::draw(&mut board, ran, &chart);
            }
            drop(board);
            let left = seconds.map_or(DRAW_EVERY, |seconds| seconds.saturating_sub(ran));
            // The only thing to wait for is the next picture: a deadline, cut short by a signal.
            let until = Instant::now() + left.min(DRAW_EVERY);
            while Instant::now() < until && stopped.is_empty() && !stopped.is_closed() {
                std::thread::park_timeout(Duration::from_millis(50));
            }
        }
    }

    fn report(&self, result: &board::Outcome, plan: &Plan) -> Result<(), Failure> {
        let mut object = json!({
            "entities": result.entities,
            "envelopes_delivered": result.delivered,
            "envelopes_lost": result.lost,
            "skipped_told": result.skipped_told,
            "calls_ok": result.calls_ok,
            "calls_failed": result.calls_failed,
            "calls_failed_elsewhere": result.calls_failed_elsewhere,
            "allocations": {
                "given": result.control.given, "expired": result.control.expired,
                "taken_over": result.control.taken_over, "rejected": result.control.rejected,
                "ended_otherwise": result.control.otherwise,
            },
            "provider": {
                "crashes": result.crashes, "commands_recovered": result.recovery.recovered,
                "ended_otherwise": result.recovery.otherwise,
            },
            "missions": result.missions.object(plan),
            "silenced": SILENCED,
            "seconds": result.ran.as_secs_f64().round(),
        });
        if let (Some(profile), Some(linked)) = (&self.link, object.as_object_mut()) {
            linked.insert("link".into(), json!(profile));
            linked.extend(result.linked.object());
        }
        if self.json {
            print_line(object);
        } else {
            print_line(format_args!("{object:#}"));
        }
        if result.lost > 0 {
            return Err(Failure::Failed(format!("{} envelopes were lost", result.lost)));
        }
        result.linked.judge()?;
        if self.missions && !result.missions.is_complete(plan) {
            return Err(Failure::Failed(result.missions.incomplete(plan)));
        }
        // On a bad link some calls come back too late.
        if result.calls_failed_elsewhere > 0 && self.link.is_none() {
            let count = result.calls_failed_elsewhere;
            return Err(Failure::Failed(format!("{count} calls to boats that were not silenced failed")));
        }
        Ok(())
    }
}
