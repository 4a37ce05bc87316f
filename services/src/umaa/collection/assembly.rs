//! One collection, put together from samples of two topics.

use super::shape::{Damage, Elements, Shape};
use aldis_envelope::{DateTime, Guid};
use std::collections::VecDeque;
use std::sync::Arc;

/// How many samples are remembered one by one while no metadata says where an update ended. Beyond it the older ones are
/// folded together: the stable state before them is let go, a state that ended among them is never told, the next one is.
const STEPS_MAX: usize = 10_000;
/// How much metadata waits for its elements. Beyond it the oldest is forgotten: a newer state follows it.
const AWAITED_MAX: usize = 64;

/// What one sample of the elements' topic does.
#[derive(Debug)]
enum Step<S: Shape> {
    Put(Arc<S::Sample>),
    Remove(Guid),
}

/// An element and its timestamp, or none where it is disposed: what metadata points at.
type Mark = (Guid, Option<DateTime>);

impl<S: Shape> Step<S> {
    fn mark(&self) -> Mark {
        match self {
            Self::Put(sample) => {
                let (id, timestamp) = S::stamp_of(sample);
                (id, Some(timestamp))
            }
            Self::Remove(id) => (*id, None),
        }
    }

    /// Carries it out. Whether elements came, went or changed places.
    fn carry_out(self, elements: &mut Elements<S>) -> bool {
        match self {
            Self::Put(sample) => {
                let next = S::next_of(&sample);
                let old = elements.insert(S::stamp_of(&sample).0, sample);
                old.is_none_or(|old| S::next_of(&old) != next)
            }
            Self::Remove(id) => elements.remove(&id).is_some(),
        }
    }
}

/// Metadata that waits for its elements.
#[derive(Debug)]
struct Awaited<S: Shape> {
    metadata: S::Metadata,
    /// The timestamp of the report that it stood in.
    time_stamp: DateTime,
    /// How many steps since the beginning lead to the state that it speaks of, once that one has come.
    at: Option<u64>,
}

impl<S: Shape> Awaited<S> {
    fn new(metadata: S::Metadata, time_stamp: DateTime) -> Self {
        Self { metadata, time_stamp, at: None }
    }

    fn mark(&self) -> Mark {
        let end = S::end_of(&self.metadata);
        (end.element, end.timestamp)
    }

    /// Whether the report is as new as all samples up to this timestamp.
    fn bounds(&self, newest: Option<DateTime>) -> bool {
        newest <= Some(self.time_stamp)
    }
}

/// A state that the metadata calls whole.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Outcome {
    /// It is.
    Stable,
    /// It is not.
    Damaged(Damage),
}

/// Samples come one after another; where an update ended, only metadata says, sooner or later. So the samples since the last
/// state that was found are kept apart as steps, and metadata points at one of them.
#[derive(Debug)]
pub(super) struct Assembly<S: Shape> {
    /// The elements up to the last state that was found.
    base: Elements<S>,
    /// How many steps led to it, what the last of them did, and the latest timestamp among them.
    folded: u64,
    base_end: Option<Mark>,
    base_newest: Option<DateTime>,
    /// What came after it, and the latest timestamp of all.
    steps: VecDeque<Step<S>>,
    newest: Option<DateTime>,
    /// The elements after all steps.
    current: Elements<S>,
    /// Elements from before a gap that have not come again.
    former: Elements<S>,
    awaited: VecDeque<Awaited<S>>,
    /// What was said last of the state that was found last, or that was given up.
    judged: Option<Awaited<S>>,
    /// The order of the base, as it was when it was whole last.
    order: Vec<Guid>,
    /// Whether the base is whole.
    whole: bool,
    /// Whether that order holds for the base still.
    in_order: bool,
    /// How many steps there were when the history of elements had been read: what is missing later is missing.
    history: Option<u64>,
    /// Whether reading it again would help.
    wants_history: bool,
    /// What is wrong with the state that was judged last, if anything.
    damage: Option<Damage>,
}

impl<S: Shape> Assembly<S> {
    /// A collection of which nothing is known. `live` says that its history is.
    pub(super) fn new(live: bool) -> Self {
        Self {
            base: Elements::<S>::new(),
            folded: 0,
            base_end: None,
            base_newest: None,
            steps: VecDeque::new(),
            newest: None,
            current: Elements::<S>::new(),
            former: Elements::<S>::new(),
            awaited: VecDeque::new(),
            judged: None,
            order: Vec::new(),
            whole: false,
            in_order: false,
            history: live.then_some(0),
            wants_history: !live,
            damage: None,
        }
    }

    /// A sample of an element. Whether it is news.
    pub(super) fn put(&mut self, sample: Arc<S::Sample>) -> bool {
        let (id, _) = S::stamp_of(&sample);
        if self.current.get(&id) == Some(&sample) {
            return false;
        }
        self.current.insert(id, sample.clone());
        let news = self.former.remove(&id).is_none_or(|former| former != sample);
        self.step(Step::Put(sample));
        news
    }

    /// An element is disposed. Whether it was known.
    pub(super) fn remove(&mut self, id: Guid) -> bool {
        let known = self.current.remove(&id).is_some() | self.former.remove(&id).is_some();
        self.step(Step::Remove(id));
        known
    }

    fn step(&mut self, step: Step<S>) {
        let (number, mark) = (self.steps_in_all() + 1, step.mark());
        self.newest = self.newest.max(mark.1);
        for awaited in self.awaited.iter_mut().filter(|awaited| awaited.at.is_none()) {
            let is_meant = awaited.mark() == mark && (mark.1.is_some() || awaited.bounds(self.newest));
            awaited.at = is_meant.then_some(number);
        }
        self.steps.push_back(step);
        self.judge_again(mark);
        if self.steps.len() > STEPS_MAX {
            self.fold(self.folded + STEPS_MAX as u64 / 2);
        }
    }

    fn steps_in_all(&self) -> u64 {
        self.folded + self.steps.len() as u64
    }

    /// Makes the steps up to that one part of the base.
    fn fold(&mut self, to: u64) {
        while self.folded < to
            && let Some(step) = self.steps.pop_front()
        {
            let mark = step.mark();
            (self.base_end, self.base_newest) = (Some(mark), self.base_newest.max(mark.1));
            let moved = step.carry_out(&mut self.base);
            self.folded += 1;
            (self.whole, self.in_order) = (false, self.in_order && !moved);
        }
    }

    /// A report says how the collection is; the report's own timestamp bounds what it speaks of.
    pub(super) fn metadata(&mut self, metadata: S::Metadata, time_stamp: DateTime) {
        match self.awaited.back_mut().or(self.judged.as_mut()) {
            Some(latest) if latest.metadata == metadata => {
                latest.time_stamp = latest.time_stamp.max(time_stamp);
                let mark = latest.mark();
                self.judge_again(mark);
            }
            _ => self.wait_for(Awaited::new(metadata, time_stamp)),
        }
    }

    /// The latest step that a mark points at. A disposal has no timestamp: it is meant only where no sample that is newer than
    /// the report comes before it.
    fn find(&self, awaited: &Awaited<S>) -> Option<u64> {
        let mark = awaited.mark();
        let bounds = |newest| mark.1.is_some() || awaited.bounds(newest);
        let in_base = self.base_end == Some(mark) && bounds(self.base_newest);
        let mut found = in_base.then_some(self.folded);
        let mut newest = self.base_newest;
        for (step, number) in self.steps.iter().zip(self.folded + 1..) {
            newest = newest.max(step.mark().1);
            if !bounds(newest) {
                break;
            }
            if step.mark() == mark {
                found = Some(number);
            }
        }
        found
    }

    /// Metadata that ends with a disposal may mean a later one of the same element than was there when it came, or may stand
    /// for two updates that say the same. So it is judged again where that element is disposed again, in time.
    fn judge_again(&mut self, mark: Mark) {
        let Some(judged) = self.judged.take_if(|judged| judged.mark() == mark && mark.1.is_none()) else {
            return;
        };
        match self.find(&judged).filter(|number| *number > self.folded) {
            Some(number) if self.awaited.is_empty() => {
                self.awaited.push_back(Awaited { at: Some(number), ..judged })
            }
            _ => self.judged = Some(judged),
        }
    }

    fn wait_for(&mut self, mut awaited: Awaited<S>) {
        let mark = awaited.mark();
        awaited.at = self.find(&awaited);
        // Nobody will tell of a disposal before the history was read, but a history that is read now shows what it led to.
        let beyond_history = self.whole && self.history.is_some_and(|history| self.folded >= history);
        self.wants_history |= awaited.at.is_none() && !beyond_history && self.may_be_past(mark);
        self.awaited.push_back(awaited);
        if self.awaited.len() > AWAITED_MAX {
            self.awaited.pop_front();
        }
    }

    /// The history of elements has been read, and the read was begun after the metadata that is here came.
    pub(super) fn caught_up(&mut self) -> Option<Outcome> {
        (self.history, self.wants_history) = (Some(self.steps_in_all()), false);
        let unseen = self.awaited.back().is_some_and(|awaited| self.may_be_whole(awaited));
        if unseen { self.judge(self.awaited.len() - 1, self.steps_in_all()) } else { None }
    }

    /// Whether the elements may be those of an update that ended with a disposal before the history was read.
    fn may_be_whole(&self, awaited: &Awaited<S>) -> bool {
        let end = S::end_of(&awaited.metadata);
        self.may_be_past(awaited.mark())
            && self.current.len() == end.size.get()
            && awaited.bounds(self.newest)
    }

    /// Whether metadata points at a disposal that may have been before the history was read.
    fn may_be_past(&self, (element, timestamp): Mark) -> bool {
        timestamp.is_none() && !self.current.contains_key(&element)
    }

    /// Whether reading the history would help.
    pub(super) fn wants_history(&self) -> bool {
        self.wants_history
    }

    /// Whether there is metadata without a stable state, and what is wrong with the state that it was held against.
    pub(super) fn unsettled(&self) -> Option<Option<Damage>> {
        let told = self.judged.is_some() || !self.awaited.is_empty();
        (told && !self.whole).then_some(self.damage)
    }

    /// Elements may have been missed: what is known is held for the former state until it comes again.
    pub(super) fn gap(&mut self) {
        let mut former = std::mem::take(&mut self.current);
        former.append(&mut self.former);
        let told = self.judged.take().into_iter().chain(std::mem::take(&mut self.awaited));
        let awaited = told.map(|told| Awaited::new(told.metadata, told.time_stamp)).collect();
        *self = Self { former, awaited, ..Self::new(false) };
    }

    /// The next state that awaited metadata points at, if its samples have all come.
    pub(super) fn advance(&mut self) -> Option<Outcome> {
        loop {
            let mut awaited = self.awaited.iter().enumerate();
            let (index, at) = awaited.find_map(|(index, awaited)| Some((index, self.reached(awaited)?)))?;
            if let Some(outcome) = self.judge(index, at) {
                return Some(outcome);
            }
        }
    }

    /// Looks at the state after so many steps in all with the metadata that points at it. What came before that is done with.
    fn judge(&mut self, index: usize, at: u64) -> Option<Outcome> {
        self.fold(at);
        let judged = self.awaited.drain(..=index).next_back()?;
        let outcome = self.look_at(&judged.metadata);
        let ended_by_disposal = judged.mark().1.is_none();
        self.judged = Some(judged);
        match outcome {
            Ok(()) => {
                (self.whole, self.damage) = (true, None);
                Some(Outcome::Stable)
            }
            Err(damage) => {
                (self.whole, self.damage) = (false, Some(damage));
                // History gives of each element the latest sample alone, and no disposals: a state that the next update has
                // begun to change is not to be had, and nothing is wrong. Nor where a disposal is meant that is yet to come.
                let certain = self.history.is_some_and(|history| at > history) && !ended_by_disposal;
                self.wants_history |= certain;
                certain.then_some(Outcome::Damaged(damage))
            }
        }
    }

    /// Whether the base is what metadata says. As long as elements only change their values, their order need not be worked
    /// out again.
    fn look_at(&mut self, metadata: &S::Metadata) -> Result<(), Damage> {
        let size = S::end_of(metadata).size.get();
        let start = S::start_of(metadata).filter(|_| size > 0);
        let same_start = start.is_none() || start == self.order.first().copied();
        if !(self.in_order && same_start && size == self.order.len()) {
            self.in_order = false;
            self.order = S::order(metadata, &self.base)?;
            self.in_order = true;
        }
        Ok(())
    }

    /// How many steps lead to the state of some metadata; none where its samples have not all come, or are folded away.
    fn reached(&self, awaited: &Awaited<S>) -> Option<u64> {
        let end = S::end_of(&awaited.metadata);
        if let Some(at) = awaited.at {
            return (at >= self.folded).then_some(at);
        }
        // Nothing is nothing, however it came to be, once the history is known.
        match self.history.filter(|_| end.size.get() == 0 && end.timestamp.is_none()) {
            Some(history) if self.base.is_empty() && self.folded >= history => Some(self.folded),
            Some(_) if self.current.is_empty() => Some(self.steps_in_all()),
            _ => None,
        }
    }

    /// Whether nothing is known of the collection.
    pub(super) fn is_forgotten(&self) -> bool {
        self.judged.is_none() && self.awaited.is_empty() && self.current.is_empty() && self.former.is_empty()
    }

    /// Takes the elements from before a gap that a stable state no longer has.
    pub(super) fn gone(&mut self) -> Vec<Guid> {
        let former = std::mem::take(&mut self.former);
        former.into_keys().filter(|id| !self.current.contains_key(id)).collect()
    }

    /// The elements of the latest stable state in their order; none where there is no such state.
    pub(super) fn stable(&self) -> Option<impl ExactSizeIterator<Item = &Arc<S::Sample>>> {
        self.whole.then(|| self.order.iter().map(|id| &self.base[id]))
    }
}
