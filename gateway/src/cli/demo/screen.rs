//! The live table in the terminal.

use super::board::{Board, CONTENDED, CRASHING, Control};
use super::map::Chart;
use crate::cli::print_line;
use std::fmt::Write;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// After this long without a word a boat is shown as silent: five times its period.
const SILENT_AFTER: Duration = Duration::from_millis(500);

/// Who holds an autopilot, and until when.
fn held(control: &Control) -> String {
    match &control.holder {
        None => "nobody".to_owned(),
        Some((holder, None)) => holder.clone(),
        Some((holder, Some(end))) => format!("{holder} until {end}"),
    }
}

/// Draws the table over the last one.
pub(super) fn draw(board: &mut Board, ran: Duration, chart: &Chart) {
    let mut text = String::from("\x1b[H\x1b[2J");
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "Aldis demo: shore (entity 1) hears three boats, {} s. Ctrl-C ends it.\n",
        ran.as_secs()
    );
    let _ = writeln!(
        text,
        "boat  heard     age ms   rate/s  position              health  calls ok/failed  round trip"
    );
    let now = board.now;
    for (entity, boat) in &mut board.boats {
        let age = boat.heard.map(|heard| now - heard).unwrap_or_default();
        let (states, at) = boat.drawn;
        let elapsed = ran.saturating_sub(at).as_secs_f64();
        if elapsed >= 1.0 {
            boat.rate = (boat.states - states) as f64 / elapsed;
            boat.drawn = (boat.states, ran);
        }
        let heard = if age > SILENT_AFTER { "SILENT" } else { "yes" };
        let position = format!("{:.5} {:.5}", boat.latitude, boat.longitude);
        let health = boat.worst.map_or("?".to_owned(), |worst| format!("{worst:?}"));
        let calls = format!("{}/{}", boat.calls_ok, boat.calls_failed);
        let trip =
            boat.round_trip.map_or(String::new(), |trip| format!("{:.1} ms", trip.as_secs_f64() * 1e3));
        let _ = writeln!(
            text,
            "{entity:<5} {heard:<9} {:>6} {:>8.1}  {position:<21} {health:<7} {calls:<16} {trip}",
            age.as_millis(),
            boat.rate,
        );
        if !boat.last_failure.is_empty() {
            let _ = writeln!(text, "      last failed call: {}", boat.last_failure);
        }
    }
    let (control, recovery) = (&board.control, &board.recovery);
    let _ = writeln!(
        text,
        "\nautopilot of boat {CONTENDED}: held by {}; given {}, expired {}, taken over {}, rejected {}",
        held(control),
        control.given,
        control.expired,
        control.taken_over,
        control.rejected
    );
    let _ = writeln!(
        text,
        "autopilot of boat {CRASHING}: held by {}; given {}, its arbiter crashed {} times and went on with {} commands",
        held(recovery),
        recovery.given,
        board.crashes.load(Ordering::Relaxed),
        recovery.recovered
    );
    text.push('\n');
    text.push_str(&chart.draw(board));
    if let Some(silenced) = board.silenced {
        let _ = writeln!(
            text,
            "\nboat {silenced} is silenced: it keeps moving, and its next word will tell what was left out"
        );
    }
    print_line(text);
}
