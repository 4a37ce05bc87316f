//! Whole seas under random orders, cancels, take-overs, crashes and silent links, checked from outside: first that nothing
//! wrong is ever seen, then, once all is whole again, that every command ends and all is cleaned up.

use super::asking::Handle;
use super::bus::source;
use super::sea::{
    AUTOPILOT, Allocating, Controlling, Ordering, Sea, add, allocating, arbiter, ask, captain, controlling,
    guid, sea_with, settings, steersman,
};
use super::vector::{VectorCommand, steer};
use crate::umaa::allocation::{Plan, Resource};
use crate::umaa::command::table::{Transition, transitions};
use crate::umaa::command::{Consumer, ConsumerSettings, Told};
use aldis_envelope::umaa::{ResourceAllocationPriorityCommand, Sequence};
use aldis_envelope::{DateTime, Guid, Source};
use proptest::prelude::*;
use std::collections::BTreeSet;
use std::time::Duration;

/// What a command goes through, by its trouble.
const TROUBLES: [&str; 12] = [
    "",
    "",
    "",
    "dead at validation",
    "slow to validate",
    "rejected",
    "slow to start",
    "aground",
    "dead",
    "not to be stopped",
    "not to be recovered",
    "interrupted at validation",
];

/// Who may be silent towards whom.
const LINKS: [(usize, usize); 5] = [(0, 1), (1, 2), (1, 3), (0, 2), (0, 3)];

#[derive(Debug, Clone)]
enum Step {
    /// Allocate, then steer.
    Order {
        captain: u64,
        seconds: u32,
        trouble: usize,
    },
    /// Steer without asking for control.
    Pirate {
        seconds: u32,
    },
    /// Ask for control alone, or for more of it.
    Allocate {
        captain: u64,
        tenths: u32,
    },
    /// Cancel a task of a captain.
    Cancel {
        captain: u64,
        task: usize,
    },
    /// Steer another course with a command that runs.
    Update {
        captain: u64,
        task: usize,
        seconds: u32,
    },
    /// Release or renew what was allocated alone.
    Release {
        captain: u64,
    },
    Renew {
        captain: u64,
        tenths: u32,
    },
    /// Turn the list round.
    Prioritize {
        turned: bool,
    },
    Crash(usize),
    ShutDown(usize),
    Restart(usize),
    Silence(usize),
    Heal(usize),
    Run {
        milliseconds: u64,
    },
}

fn step() -> impl Strategy<Value = Step> {
    let captain = || 1..=2_u64;
    prop_oneof![
        6 => (captain(), 0..12_u32, 0..TROUBLES.len())
            .prop_map(|(captain, seconds, trouble)| Step::Order { captain, seconds, trouble }),
        1 => (1..6_u32).prop_map(|seconds| Step::Pirate { seconds }),
        3 => (captain(), 0..60_u32).prop_map(|(captain, tenths)| Step::Allocate { captain, tenths }),
        3 => (captain(), 0..8_usize).prop_map(|(captain, task)| Step::Cancel { captain, task }),
        2 => (captain(), 0..8_usize, 1..6_u32)
            .prop_map(|(captain, task, seconds)| Step::Update { captain, task, seconds }),
        2 => captain().prop_map(|captain| Step::Release { captain }),
        2 => (captain(), 0..60_u32).prop_map(|(captain, tenths)| Step::Renew { captain, tenths }),
        1 => any::<bool>().prop_map(|turned| Step::Prioritize { turned }),
        2 => (0..6_usize).prop_map(Step::Crash),
        1 => (0..6_usize).prop_map(Step::ShutDown),
        4 => (0..6_usize).prop_map(Step::Restart),
        1 => (0..LINKS.len()).prop_map(Step::Silence),
        2 => (0..LINKS.len()).prop_map(Step::Heal),
        10 => (0..3000_u64).prop_map(|milliseconds| Step::Run { milliseconds }),
        6 => (0..10_u64).prop_map(|milliseconds| Step::Run { milliseconds }),
    ]
}

struct Play {
    sea: Sea,
    places: [Source; 6],
    controlling: [Handle<Controlling>; 2],
    allocating: [Handle<Allocating>; 2],
    pirate: Handle<Consumer<VectorCommand>>,
    ordering: Handle<Ordering>,
    silent: BTreeSet<usize>,
    down: BTreeSet<usize>,
    was_silent: bool,
}

/// The services that only ask for control.
fn asker(number: u64) -> Source {
    source(number, 101)
}

fn lists() -> [Vec<Guid>; 2] {
    let low_to_high = [captain(1), asker(1), captain(2), asker(2)].map(guid);
    let mut turned = low_to_high;
    turned.reverse();
    [low_to_high.to_vec(), turned.to_vec()]
}

impl Play {
    fn new() -> Self {
        let [priorities, _] = lists();
        let resource = Resource {
            id: AUTOPILOT,
            name: "autopilot".into(),
            priorities,
            related_sources: vec![guid(steersman())],
        };
        let mut sea = sea_with(settings(resource));
        let bus = &mut sea.bus;
        let one = [controlling(bus, captain(1)), controlling(bus, captain(2))];
        let other = [allocating(bus, asker(1)), allocating(bus, asker(2))];
        let (at, chief) = (source(3, 100), source(2, 102));
        let settings = ConsumerSettings::default;
        let pirate = add(bus, at, move || Consumer::new(at, super::bus::guids(), settings()));
        let ordering = add(bus, chief, move || Ordering::new(chief, super::bus::guids(), settings()));
        let places = [arbiter(), steersman(), captain(1), captain(2), asker(1), asker(2)];
        let (silent, down, was_silent) = (BTreeSet::new(), BTreeSet::new(), false);
        Self { sea, places, controlling: one, allocating: other, pirate, ordering, silent, down, was_silent }
    }

    fn take(&mut self, step: Step) {
        match step {
            Step::Order { captain: number, seconds, trouble } => {
                // One course in twelve is none.
                let course = f64::from(seconds) * 33.0;
                let command = steer(course, seconds, TROUBLES[trouble]);
                self.controlling[number as usize - 1].wish(move |consumer, now, out| {
                    let plan = Plan {
                        arbiter: guid(arbiter()),
                        resource: AUTOPILOT,
                        duration: Some(Duration::from_secs(3)),
                        provider: guid(steersman()),
                        command,
                    };
                    let _ = consumer.start(now, plan, out);
                });
                self.sea.bus.wake(captain(number));
            }
            Step::Pirate { seconds } => {
                self.pirate.wish(move |consumer, now, out| {
                    let _ = consumer.start(now, guid(steersman()), steer(0.0, seconds, ""), out);
                });
                self.sea.bus.wake(source(3, 100));
            }
            Step::Allocate { captain, tenths } => {
                self.allocating[captain as usize - 1].wish(move |consumer, now, out| {
                    let _ = consumer.start(now, guid(arbiter()), ask(Some(f64::from(tenths) / 10.0)), out);
                });
                self.sea.bus.wake(asker(captain));
            }
            Step::Cancel { captain: number, task } => {
                self.controlling[number as usize - 1].wish(move |consumer, now, out| {
                    let tasks = consumer.tasks();
                    if let Some(task) = tasks.get(task) {
                        consumer.cancel(now, *task, out);
                    }
                });
                self.sea.bus.wake(captain(number));
            }
            Step::Update { captain: number, task, seconds } => {
                self.controlling[number as usize - 1].wish(move |consumer, now, out| {
                    let tasks = consumer.tasks();
                    if let Some(task) = tasks.get(task) {
                        let _ = consumer.update(now, *task, steer(99.0, seconds, ""), out);
                    }
                });
                self.sea.bus.wake(captain(number));
            }
            Step::Release { captain } => self.last(captain, |consumer, session, now, out| {
                consumer.cancel(now, session, out);
            }),
            Step::Renew { captain, tenths } => self.last(captain, move |consumer, session, now, out| {
                let _ = consumer.update(now, session, ask(Some(f64::from(tenths) / 10.0)), out);
            }),
            Step::Prioritize { turned } => {
                let [list, other] = lists();
                let priorities = Sequence::new(if turned { other } else { list }).unwrap();
                self.ordering.wish(move |consumer, now, out| {
                    let command = ResourceAllocationPriorityCommand {
                        priorities,
                        resource_id: AUTOPILOT,
                        time_stamp: DateTime::default(),
                        source: Guid::NIL,
                        session_id: Guid::NIL,
                        destination: Guid::NIL,
                    };
                    let _ = consumer.start(now, guid(arbiter()), command, out);
                });
                self.sea.bus.wake(source(2, 102));
            }
            Step::Crash(place) => {
                if self.may_end(place) && self.down.insert(place) {
                    self.sea.bus.crash(self.places[place]);
                }
            }
            Step::ShutDown(place) => {
                if self.may_end(place) && self.down.insert(place) {
                    self.sea.bus.shut_down(self.places[place]);
                }
            }
            Step::Restart(place) => {
                if self.down.remove(&place) {
                    self.restart(place);
                }
            }
            Step::Silence(link) => self.silence(link),
            Step::Heal(link) => {
                if self.silent.remove(&link) {
                    let (one, other) = LINKS[link];
                    self.sea.bus.heal(self.places[one], self.places[other]);
                }
            }
            Step::Run { milliseconds } => self.sea.bus.run_for(Duration::from_millis(milliseconds)),
        }
        self.is_safe();
    }

    /// Something with the allocation that was last told of.
    fn last(
        &mut self,
        captain: u64,
        act: impl FnOnce(&mut Allocating, Guid, aldis_envelope::Now, &mut crate::Outbox) + Send + 'static,
    ) {
        let handle = &self.allocating[captain as usize - 1];
        let session = handle.heard().iter().rev().find_map(|told| match told {
            Told::State { session, .. } => Some(*session),
            _ => None,
        });
        if let Some(session) = session {
            handle.wish(move |consumer, now, out| act(consumer, session, now, out));
            self.sea.bus.wake(asker(captain));
        }
    }

    /// A process takes time to start: session ids are made from it.
    fn restart(&mut self, place: usize) {
        self.sea.bus.run_for(Duration::from_millis(1));
        self.sea.bus.start(self.places[place]);
    }

    /// An arbiter that starts again while a consumer is out of reach cannot know that consumer's commands: what the statuses of
    /// its former life say then is mended when the link is heard again, and not checked here.
    fn may_end(&self, place: usize) -> bool {
        let out_of_reach = self.silent.iter().any(|&link| LINKS[link].0 == 0 && LINKS[link].1 > 1);
        place != 0 || !out_of_reach
    }

    fn silence(&mut self, link: usize) {
        let (one, other) = LINKS[link];
        let arbiter_is_down = self.down.contains(&0) && one == 0;
        if !arbiter_is_down && self.silent.insert(link) {
            self.was_silent = true;
            self.sea.bus.silence(self.places[one], self.places[other]);
        }
    }

    fn is_safe(&self) {
        assert_eq!(self.sea.bus.checker.violations, Vec::<String>::new());
        // A provider that is down cannot end what its status says that it executes; one out of contact does not.
        if !self.was_silent && self.down.is_empty() {
            assert_eq!(self.sea.bus.checker.strangers(|_, _| true), Vec::<String>::new());
        }
    }

    /// All is whole again: everything ends within a bound.
    fn ends(mut self) -> BTreeSet<Transition> {
        for link in std::mem::take(&mut self.silent) {
            let (one, other) = LINKS[link];
            self.sea.bus.heal(self.places[one], self.places[other]);
        }
        for place in std::mem::take(&mut self.down) {
            self.restart(place);
        }
        self.sea.bus.run_for(Duration::from_secs(180));
        assert_eq!(self.sea.bus.checker.violations, Vec::<String>::new());
        assert_eq!(self.sea.bus.checker.left(), Vec::<String>::new());
        assert_eq!(self.sea.holder(), None);
        self.sea.bus.checker.transitions.clone()
    }
}

fn play(steps: Vec<Step>) -> BTreeSet<Transition> {
    let mut play = Play::new();
    steps.into_iter().for_each(|step| play.take(step));
    play.ends()
}

/// How many plays a run has: a few in everyday tests, more by `PROPTEST_CASES`.
fn cases() -> u32 {
    std::env::var("PROPTEST_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(40)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn whatever_happens_is_lawful_and_ends(steps in prop::collection::vec(step(), 1..60)) {
        play(steps);
    }
}

/// What random plays seldom come to: an update of a command that is still looked at, and one that lasts too long.
fn rare() -> Vec<Step> {
    vec![
        Step::Order { captain: 1, seconds: 1, trouble: 4 },
        Step::Run { milliseconds: 100 },
        Step::Update { captain: 1, task: 0, seconds: 1 },
        Step::Run { milliseconds: 5000 },
        Step::Order { captain: 1, seconds: 0, trouble: 0 },
        Step::Run { milliseconds: 100 },
    ]
}

#[test]
fn every_legal_transition_is_seen() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let steps = prop::collection::vec(step(), 60);
    let mut seen = play(rare());
    for _ in 0..60 {
        let tree = steps.new_tree(&mut runner).unwrap();
        seen.extend(play(proptest::strategy::ValueTree::current(&tree)));
        if seen.len() == transitions().count() {
            break;
        }
    }
    let missing: Vec<_> = transitions().filter(|transition| !seen.contains(transition)).collect();
    assert_eq!(missing, []);
}
