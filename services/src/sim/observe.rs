//! What checkers see: everything that crosses a machine's border, and what the workload's own services tell of themselves.

use super::world::NodeHandle;
use crate::counters::Counters;
use crate::journal::JournalEvent;
use crate::service::Note;
use aldis_envelope::{BootId, Envelope, Monotonic, Now};
use std::any::Any;
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

/// Something that a service of a workload tells of itself, where it cannot be seen from outside.
pub trait Fact: Any + Send + fmt::Debug {}

impl dyn Fact {
    /// The fact as what it is.
    pub fn downcast<T: Fact>(&self) -> Option<&T> {
        (self as &dyn Any).downcast_ref()
    }
}

/// Where services tell facts. It is shared by all services of a world.
#[derive(Clone, Default)]
pub struct Facts(Arc<Mutex<Vec<Box<dyn Fact>>>>);

impl Facts {
    /// Tells something; the world shows it to the checkers after the service has returned.
    pub fn tell(&self, fact: impl Fact) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(Box::new(fact));
    }

    pub(super) fn take(&self) -> Vec<Box<dyn Fact>> {
        std::mem::take(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// What is seen of a machine.
#[derive(Debug)]
pub enum Seen<'a> {
    /// Its node has started a life.
    Started(BootId),
    /// Its life ends: by a crash, or because the run is over. The counters are those of this life.
    Ended(&'a Counters),
    /// Its node was told that its session is up.
    BusUp,
    /// Its node was told that its session is down.
    BusDown,
    /// It put an envelope on the bus, which may be down without its knowing.
    Published(&'a Envelope),
    /// An envelope reached it from the bus; its node takes it next.
    Arrived(&'a Envelope),
    /// Its journal tells something.
    Journal(&'a JournalEvent),
    /// It says something to people.
    Said(&'a Note),
    /// A service of the workload tells something.
    Fact(&'a dyn Fact),
    /// All faults have ended for all machines; everything must come right from here on. The machine means nothing.
    Healed,
}

/// Something seen.
#[derive(Debug)]
pub struct Observation<'a> {
    /// When, by the world's true time.
    pub at: Monotonic,
    /// The clocks of the machine. Its monotonic time starts with each life, and both may drift.
    pub clocks: Now,
    /// Where.
    pub node: NodeHandle,
    /// What.
    pub seen: Seen<'a>,
}

/// Something that must not be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Violation {
    /// The checker that found it.
    pub checker: &'static str,
    /// When, by the world's true time.
    pub at: Monotonic,
    /// What is wrong, and where.
    pub what: String,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} at {:.6} s: {}", self.checker, self.at.elapsed().as_secs_f64(), self.what)
    }
}

/// Watches a world from outside and says what must not be.
///
/// A checker shares no code or state with what it watches: it holds a second opinion.
pub trait Checker {
    /// Its name, for violations.
    fn name(&self) -> &'static str;

    /// Sees what happens, in the order in which it happens.
    ///
    /// # Errors
    /// What must not be. The run ends with it, so that the end of the trace shows how it came about.
    fn observe(&mut self, observation: &Observation<'_>) -> Result<(), String>;

    /// Says what is missing at the end of a run. All machines have [`Seen::Ended`] before.
    fn finish(&mut self) -> Vec<String> {
        Vec::new()
    }
}
