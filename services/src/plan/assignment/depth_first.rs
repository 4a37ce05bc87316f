//! Depth-first branch and bound over what a process allows next.
//!
//! States are pruned that cannot beat the best plan, and those that another dominates: same done, same places, no time later.

use super::problem::Problem;
use super::relax::Relaxation;
use super::schedule::Routes;
use crate::plan::algebra::Algebra;
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// A search for the best plan, which can be stopped after any number of nodes and go on later.
pub(super) trait Search: Send {
    /// Whether everything was searched.
    fn is_done(&self) -> bool;

    /// The least value that what is still open could have.
    fn open_bound(&self) -> Option<(i64, i64)>;

    /// Looks at about `nodes` states for plans of less than `best`, which each one found becomes. Gives the nodes used.
    fn search(
        &mut self,
        problem: &Problem,
        nodes: u64,
        best: &mut (i64, i64),
        found: &mut dyn FnMut(Routes),
    ) -> u64;
}

/// A plan that is not complete.
pub(super) trait State: Sized + Send {
    /// Where it is, beside what was done.
    type Places: Ord + Send;
    /// What was added last: it settles the order of children of one bound.
    type Last: Ord;

    /// The most states remembered for dominance; what is beyond is searched without.
    const REMEMBERED_MAX: usize;

    /// The least value that a plan which begins so can have.
    fn bound(&self) -> (i64, i64);
    /// What was done, by its places in the process.
    fn done(&self) -> u128;
    fn places(&self) -> Self::Places;
    fn last(&self) -> Self::Last;
    /// Its times: of two states in the same places the one is better of which none is later.
    fn times(&self) -> impl Iterator<Item = &i64>;
    /// The state after a vehicle does one thing more; none where it cannot.
    fn child(&self, problem: &Problem, relaxation: &Relaxation, vehicle: usize, next: usize) -> Option<Self>;
    /// When each vehicle has ended, where nothing more is to be done.
    fn ends(&self) -> Vec<i64>;
    fn routes(&self, problem: &Problem) -> Routes;
}

/// States seen, by what was done and where.
type Seen<Places> = BTreeMap<(u128, Places), Vec<Vec<i64>>>;

/// A search that can be stopped after any number of nodes and go on later.
pub(super) struct DepthFirst<S: State> {
    algebra: Algebra<u128>,
    relaxation: Relaxation,
    stack: Vec<S>,
    seen: Seen<S::Places>,
    remembered: usize,
}

impl<S: State> DepthFirst<S> {
    /// A search from a state in which nothing is done.
    pub(super) fn new(root: S, algebra: Algebra<u128>, relaxation: Relaxation) -> Self {
        Self { algebra, relaxation, stack: vec![root], seen: BTreeMap::new(), remembered: 0 }
    }

    /// Whether another state is at least as good; if not, this one is remembered.
    fn is_dominated(&mut self, state: &S) -> bool {
        let at_least = |known: &Vec<i64>| known.iter().zip(state.times()).all(|(known, time)| known <= time);
        let at_most = |known: &Vec<i64>| known.iter().zip(state.times()).all(|(known, time)| known >= time);
        let key = (state.done(), state.places());
        if let Some(front) = self.seen.get_mut(&key) {
            if front.iter().any(at_least) {
                return true;
            }
            let before = front.len();
            front.retain(|known| !at_most(known));
            self.remembered -= before - front.len();
            front.push(state.times().copied().collect());
            self.remembered += 1;
        } else if self.remembered < S::REMEMBERED_MAX {
            self.seen.insert(key, vec![state.times().copied().collect()]);
            self.remembered += 1;
        }
        false
    }
}

impl<S: State> Search for DepthFirst<S> {
    fn is_done(&self) -> bool {
        self.stack.is_empty()
    }

    fn open_bound(&self) -> Option<(i64, i64)> {
        self.stack.iter().map(S::bound).min()
    }

    fn search(
        &mut self,
        problem: &Problem,
        nodes: u64,
        best: &mut (i64, i64),
        found: &mut dyn FnMut(Routes),
    ) -> u64 {
        let mut used = 0;
        while used < nodes {
            let Some(state) = self.stack.pop() else { break };
            used += 1;
            if state.bound() >= *best || self.is_dominated(&state) {
                continue;
            }
            let mut children = Vec::new();
            let open = self.algebra.next(&state.done(), &mut |next| {
                for vehicle in 0..problem.vehicles.len() {
                    children.extend(state.child(problem, &self.relaxation, vehicle, next));
                }
            });
            if open {
                used += children.len() as u64;
                children.retain(|child| child.bound() < *best);
                // The best is searched first: it is taken from the end.
                children.sort_by_key(|child| Reverse((child.bound(), child.last())));
                self.stack.append(&mut children);
            } else {
                let ends = state.ends();
                *best = problem.value(ends.iter().copied().max().unwrap_or(0), ends.iter().sum());
                found(state.routes(problem));
            }
        }
        used
    }
}
