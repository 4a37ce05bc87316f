//! What was held and what was broken, and what is still owed.

use super::report::{ClauseReport, Report};
use super::{Bounds, Clause, FOLLOWED_MAX};
use aldis_envelope::{Guid, Monotonic};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// The first sight of a breach.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Evidence {
    /// When it was seen.
    pub at: Monotonic,
    /// On which topic.
    pub topic: String,
    /// What was wrong.
    pub text: String,
}

/// What is owed: the clause, on which topic's family, by whom, for what.
pub(super) type Debt = (Clause, String, Guid, Guid);

#[derive(Debug)]
struct Owed {
    due: Monotonic,
    topic: String,
    text: String,
}

#[derive(Debug, Default)]
struct Count {
    held: u64,
    broken: u64,
    first: Option<Evidence>,
}

/// Counts, clause by clause.
#[derive(Debug)]
pub(super) struct Ledger {
    pub(super) bounds: Bounds,
    counts: BTreeMap<Clause, Count>,
    owed: BTreeMap<Debt, Owed>,
    /// The same by their dates.
    dues: BTreeSet<(Monotonic, Debt)>,
    unfollowed: u64,
    now: Monotonic,
    topic: String,
}

impl Ledger {
    pub(super) fn new(bounds: Bounds) -> Self {
        let (counts, owed, dues) = (BTreeMap::new(), BTreeMap::new(), BTreeSet::new());
        let (now, topic) = (Monotonic::START, String::new());
        Self { bounds, counts, owed, dues, unfollowed: 0, now, topic }
    }

    /// Time goes on to the observation on a topic: what was owed before it is broken.
    pub(super) fn advance(&mut self, now: Monotonic, topic: &str) {
        self.now = self.now.max(now);
        while let Some((due, _)) = self.dues.first().filter(|(due, _)| *due < self.now) {
            let at = *due;
            let Some((_, debt)) = self.dues.pop_first() else { break };
            let Some(Owed { topic, text, .. }) = self.owed.remove(&debt) else { continue };
            let count = self.counts.entry(debt.0).or_default();
            count.broken += 1;
            count.first.get_or_insert(Evidence { at, topic, text });
            if debt.0 == Clause::Answered {
                // Who answers nothing at all answers no update either: that is one breach.
                self.forgive(&(Clause::UpdateAnswered, debt.1, debt.2, debt.3));
            }
        }
        self.topic.replace_range(.., topic);
    }

    pub(super) fn now(&self) -> Monotonic {
        self.now
    }

    /// There is too much to follow this too.
    pub(super) fn unfollowed(&mut self) {
        self.unfollowed += 1;
    }

    pub(super) fn held(&mut self, clause: Clause) {
        self.counts.entry(clause).or_default().held += 1;
    }

    pub(super) fn broken(&mut self, clause: Clause, text: String) {
        let (at, topic) = (self.now, self.topic.clone());
        let count = self.counts.entry(clause).or_default();
        count.broken += 1;
        count.first.get_or_insert(Evidence { at, topic, text });
    }

    pub(super) fn judge(&mut self, clause: Clause, held: bool, text: impl FnOnce() -> String) {
        if held { self.held(clause) } else { self.broken(clause, text()) }
    }

    /// Something is owed from now on, within so long. What is owed already stays owed by its first date.
    pub(super) fn owe(&mut self, debt: Debt, within: Duration, text: String) {
        if self.owed.len() >= FOLLOWED_MAX {
            self.unfollowed += 1;
        } else if !self.owed.contains_key(&debt) {
            let (due, topic) = (self.now + within, self.topic.clone());
            self.dues.insert((due, debt.clone()));
            self.owed.insert(debt, Owed { due, topic, text });
        }
    }

    pub(super) fn is_owed(&self, debt: &Debt) -> bool {
        self.owed.contains_key(debt)
    }

    /// What was owed has come.
    pub(super) fn pay(&mut self, debt: &Debt) {
        if self.forgive(debt) {
            self.held(debt.0);
        }
    }

    /// Everything of that kind that was owed has come.
    pub(super) fn pay_where(&mut self, paid: impl Fn(&Debt) -> bool) {
        let debts: Vec<_> = self.owed.keys().filter(|debt| paid(debt)).cloned().collect();
        debts.iter().for_each(|debt| self.pay(debt));
    }

    /// What was owed is no longer. Whether it was.
    pub(super) fn forgive(&mut self, debt: &Debt) -> bool {
        let Some(owed) = self.owed.remove(debt) else { return false };
        self.dues.remove(&(owed.due, debt.clone()));
        true
    }

    pub(super) fn into_report(mut self, observations: u64) -> Report {
        let clause = |clause: &Clause| {
            let Count { held, broken, first } = self.counts.remove(clause).unwrap_or_default();
            ClauseReport { clause: *clause, held, broken, first }
        };
        let clauses = Clause::ALL.iter().map(clause).collect();
        Report { observations, open: self.owed.len(), unfollowed: self.unfollowed, clauses }
    }
}
