//! Every sequence of figures 6 to 20 of the ICD, with a consumer and a provider in Python that know nothing of Aldis but the
//! ICD and the written format. `aldis conform` watches.
//!
//! | figure | sequence | Python's consumer, Aldis' arbiter | Python's provider, Aldis' consumers |
//! | --- | --- | --- | --- |
//! | 6 | the whole of a command | all of `consumer` | all of `provider` |
//! | 7 | start-up, in any order | the consumer first | the provider first, and last |
//! | 8 | start-up of a provider | with commands that wait, and after a crash | after a crash: goes on, or gives up |
//! | 9 | start-up of a consumer | after a crash: goes on, or cancels | without commands of a former life |
//! | 10 | start of a command | each | each |
//! | 11 | execution | each | each |
//! | 12 | update | a shorter duration | a renewal |
//! | 13 | success | the duration has run | the duration has run; a new priority list |
//! | 14 | failure | the resource fails (`aldis command stand-in`); another takes it over | the resource fails |
//! | 15 | time-out | a reader of the report confirms nothing | the resource is too slow |
//! | 16 | cancel | while it is executed | while it is executed |
//! | 17 | clean-up | each | each |
//! | 18 | shutdown, in any order | the provider first; the consumer first | the consumer first; the provider first |
//! | 19 | shutdown of a provider | with a command that is executed | with a command that is executed |
//! | 20 | shutdown of a consumer | with a command that is executed | with a command that is executed |

mod consumer;
mod faults;
mod provider;

use super::harness::{Fleet, Running};
use super::zenoh;
use aldis_tests::Node;
use serde_json::{Value, json};

/// The vehicle with Aldis' arbiter.
fn start_arbiter(fleet: &Fleet) -> Node {
    let tables = "[[resource]]\nname = \"autopilot\"\npriorities = [\"eid300sid100\", \"eid9010sid100\"]\n\
                  [allocation]\nacknowledge_within_ms = 1500\n";
    fleet.start_node("vehicle", "entities = [400]\n", tables)
}

/// A peer in Python that obeys orders.
struct Foreign(Running);

impl Foreign {
    fn order(&mut self, order: Value) {
        self.0.tell(&order);
    }

    /// The next thing of this kind that it tells.
    fn next(&self, event: &str) -> Value {
        loop {
            let told = self.0.next().unwrap_or_else(|| panic!("it ended without a word of {event}"));
            assert_ne!(told["event"], "violation", "{told}");
            if told["event"] == event {
                return told;
            }
        }
    }

    /// The states that a command goes through until this one, with the reasons that figure 5 leaves open.
    fn way(&self, event: &str, last: &str) -> String {
        let mut way = Vec::new();
        loop {
            let told = self.next(event);
            way.push(step(&told));
            if told["state"] == last {
                return way.join(" ");
            }
        }
    }

    /// Ends it in order.
    fn leave(mut self) {
        self.order(json!({ "do": "leave" }));
        self.0.finish();
    }
}

fn step(told: &Value) -> String {
    let (state, reason) = (told["state"].as_str().unwrap_or_default(), told["reason"].as_str());
    match (state, reason.unwrap_or_default()) {
        ("FAILED", reason) | (_, reason @ "UPDATED") => format!("{state}/{reason}"),
        _ => state.to_owned(),
    }
}

/// The clauses with this verdict.
fn clauses<'a>(report: &'a Value, verdict: &str) -> Vec<&'a Value> {
    let all = report["clauses"].as_array().expect("a list").iter();
    all.filter(|clause| clause["verdict"] == verdict).collect()
}

/// What the sequences of the figures put to the test.
const SEEN: [&str; 24] = [
    "answered",
    "first-status",
    "transition",
    "reason",
    "ack-first",
    "ack-matches",
    "update-newer",
    "update-in-time",
    "update-answered",
    "updated-only",
    "cancel-asked",
    "cancel-answered",
    "consumer-clean-up",
    "clean-up-order",
    "provider-clean-up",
    "provider-shutdown",
    "consumer-shutdown",
    "report-shutdown",
    "one-holder",
    "listed",
    "take-over",
    "report-first",
    "report-cleared",
    "expiry",
];

#[test]
fn all_sequences_of_the_figures_hold_between_aldis_and_python() {
    let Some(python) = zenoh() else { return };
    let fleet = Fleet::start_as(1);
    let watch = fleet.watch();
    // One after the other: an arbiter waits for every reader of its report, those too that have just crashed.
    provider::all_figures(&fleet, &python);
    consumer::all_figures(&fleet, &python);
    let report = watch.report();
    assert_eq!(report["clauses_broken"], 0, "{:#?}", clauses(&report, "broken"));
    assert_eq!([&report["unfollowed"], &report["open"]], [0, 0], "something is left on the bus: {report}");
    let held = clauses(&report, "held");
    let unseen: Vec<_> =
        SEEN.iter().filter(|name| !held.iter().any(|held| held["clause"] == **name)).collect();
    assert!(unseen.is_empty(), "never put to the test: {unseen:?}");
}
