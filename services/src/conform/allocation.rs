//! ResourceAllocation (ICD 5.1.3) as far as it can be seen from outside.

use super::command::Step;
use super::ledger::{Debt, Ledger};
use super::sample::Sample;
use super::transition::is_terminal;
use super::{Bounds, Clause};
use aldis_envelope::{Guid, Monotonic};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

const SERVICE: &str = "UMAA::SO::ResourceAllocation::";
pub(super) const ALLOCATION: &str = "UMAA::SO::ResourceAllocation::ResourceAllocation";
const PRIORITY: &str = "UMAA::SO::ResourceAllocation::ResourceAllocationPriority";

/// How many services that allocate are followed: a vehicle has one.
const ARBITERS_MAX: usize = 1000;

/// A consumer in control by an allocation command that is executed.
#[derive(Debug, Clone, Copy)]
struct Holder {
    arbiter: Guid,
    resource: Guid,
    consumer: Guid,
}

/// A consumer that was in control.
#[derive(Debug, Clone, Copy)]
struct Former {
    /// Since when reports no longer name it.
    since: Monotonic,
    /// When the arbiter knew that all have heard so: another consumer was given control.
    confirmed: Option<Monotonic>,
}

impl Former {
    /// Whether a provider may still go by it: the change is not confirmed, and not too long ago for that to matter.
    fn may_be_believed(&self, now: Monotonic, bounds: Bounds) -> bool {
        match self.confirmed {
            // What was decided before that may be written after it.
            Some(confirmed) => now - confirmed < bounds.slack + bounds.written,
            None => now - self.since < bounds.slack + bounds.follow,
        }
    }
}

/// A consumer whose allocation was interrupted: its resource was taken from it, unless reports go on to name it.
#[derive(Debug)]
struct Interrupted {
    loser: Guid,
    /// The list that was in force.
    list: Vec<Guid>,
    since: Monotonic,
}

/// What an arbiter has reported last.
#[derive(Debug, Default)]
struct Arbiter {
    /// Every resource, with the consumer in control if there is one.
    holders: BTreeMap<Guid, Option<Guid>>,
    /// Who was in control of what before: a provider may not have heard of the change.
    former: BTreeMap<(Guid, Guid), Former>,
    /// Consumers from low to high.
    priorities: BTreeMap<Guid, Vec<Guid>>,
    /// The providers of a resource.
    sources: BTreeMap<Guid, Vec<Guid>>,
}

/// Everything that arbiters do and say.
#[derive(Debug, Default)]
pub(super) struct Allocations {
    arbiters: BTreeMap<Guid, Arbiter>,
    /// By session.
    executing: BTreeMap<Guid, Holder>,
    /// By resource, until it is given to somebody or free.
    interrupted: BTreeMap<Guid, Interrupted>,
}

fn debt(clause: Clause, resource: Guid, who: Guid) -> Debt {
    (clause, String::new(), resource, who)
}

/// The place on a list from low to high; none where it is not on it.
fn rank(list: &[Guid], consumer: Guid) -> Option<usize> {
    list.iter().position(|listed| *listed == consumer)
}

/// Whether a resource is taken from a consumer for one of higher priority, by the list then or by the list now: a new one may
/// have come in between.
fn judge_take_over(resource: Guid, taken: &Interrupted, (winner, now): (Guid, &[Guid]), ledger: &mut Ledger) {
    let loser = taken.loser;
    let goes_before = |list: &[Guid]| rank(list, winner) > rank(list, loser);
    ledger.judge(Clause::TakeOver, goes_before(now) || goes_before(&taken.list), || {
        format!("resource {resource} is taken from {loser} for {winner}, which is not of higher priority")
    });
}

impl Allocations {
    /// A report of an arbiter.
    pub(super) fn report(&mut self, topic: &str, sample: &Sample, ledger: &mut Ledger) {
        let (Some(name), Some(source)) = (topic.strip_prefix(SERVICE), sample.guid("source")) else { return };
        let member = match name {
            "ResourceAllocationReport" => "controlInfo",
            "ResourceAllocationConfigReport" => "resources",
            "ResourceAllocationPriorityReport" => "priorities",
            _ => return,
        };
        let entries: Vec<_> = sample.list(member).collect();
        let resources: Vec<_> = entries.iter().filter_map(|entry| entry.guid("resourceID")).collect();
        let different: BTreeSet<_> = resources.iter().collect();
        ledger.judge(Clause::ResourceOnce, different.len() == resources.len(), || {
            format!("{} resources in {} entries", different.len(), resources.len())
        });
        if self.arbiters.len() >= ARBITERS_MAX && !self.arbiters.contains_key(&source) {
            ledger.unfollowed();
            return;
        }
        let entries = resources.into_iter().zip(entries);
        let arbiter = self.arbiters.entry(source).or_default();
        match name {
            "ResourceAllocationConfigReport" => {
                arbiter.sources = entries.map(|(id, entry)| (id, entry.guids("relatedSources"))).collect();
            }
            "ResourceAllocationPriorityReport" => {
                arbiter.priorities = entries.map(|(id, entry)| (id, entry.guids("priorities"))).collect();
                arbiter
                    .priorities
                    .keys()
                    .for_each(|id| ledger.pay(&debt(Clause::PriorityReport, *id, source)));
            }
            _ => {
                let holder = |entry: &Sample| {
                    entry.value()["controlSession"]["controllingConsumer"].as_str()?.parse().ok()
                };
                let (now, bounds) = (ledger.now(), ledger.bounds);
                arbiter.former.retain(|_, former| former.may_be_believed(now, bounds));
                let holders: BTreeMap<Guid, Option<Guid>> =
                    entries.map(|(id, entry)| (id, holder(&entry))).collect();
                for (resource, before) in std::mem::take(&mut arbiter.holders) {
                    if let Some(before) =
                        before.filter(|before| holders.get(&resource) != Some(&Some(*before)))
                    {
                        let former = Former { since: now, confirmed: None };
                        arbiter.former.insert((resource, before), former);
                    }
                }
                let list =
                    |resource: &Guid| arbiter.priorities.get(resource).map(Vec::as_slice).unwrap_or_default();
                for (resource, holder) in &holders {
                    // A report from before the interruption may come after it.
                    let is_of_before = |taken: &Interrupted| {
                        *holder == Some(taken.loser) && now - taken.since < bounds.slack
                    };
                    if !self.interrupted.get(resource).is_some_and(is_of_before)
                        && let Some(taken) = self.interrupted.remove(resource)
                        && let Some(winner) = holder.filter(|holder| *holder != taken.loser)
                    {
                        judge_take_over(*resource, &taken, (winner, list(resource)), ledger);
                    }
                }
                arbiter.holders = holders;
                self.control_reported(source, ledger);
            }
        }
    }

    fn control_reported(&mut self, source: Guid, ledger: &mut Ledger) {
        let Some(arbiter) = self.arbiters.get(&source) else { return };
        let reports: Vec<_> = arbiter.holders.iter().map(|(resource, holder)| (*resource, *holder)).collect();
        for (resource, holder) in reports {
            let others = self.arbiters.iter().filter(|(other, _)| **other != source);
            let other = others
                .filter_map(|(_, other)| *other.holders.get(&resource)?)
                .find(|other| Some(*other) != holder);
            ledger.judge(Clause::OneHolder, holder.is_none() || other.is_none(), || {
                format!("resource {resource}: {source} reports another holder than another service")
            });
            ledger.pay_where(|(clause, _, of, who)| {
                *clause == Clause::ReportCleared && *of == resource && Some(*who) != holder
            });
        }
    }

    /// A report is disposed: nobody holds anything by it.
    pub(super) fn report_gone(&mut self, topic: &str, key: &Sample) {
        if topic.strip_prefix(SERVICE) == Some("ResourceAllocationReport")
            && let Some(arbiter) = key.guid("source").and_then(|source| self.arbiters.get_mut(&source))
        {
            arbiter.holders.clear();
        }
    }

    /// A command has come to a state.
    pub(super) fn step(&mut self, step: &Step, ledger: &mut Ledger) {
        let Some(command) = &step.command else { return };
        match step.family.as_str() {
            ALLOCATION if step.to == "EXECUTING" => self.allocated(step, command, ledger),
            ALLOCATION if is_terminal(&step.to) => self.ended(step, ledger),
            PRIORITY if step.to == "COMPLETED" => self.prioritized(step, command, ledger),
            ALLOCATION | PRIORITY => {}
            _ if step.to == "EXECUTING" && !step.retained => self.guarded(step, command, ledger),
            _ => {}
        }
    }

    /// An arbiter has given control.
    fn allocated(&mut self, step: &Step, command: &Sample, ledger: &mut Ledger) {
        let (Some(resource), Some(consumer)) = (command.guid("resourceID"), command.guid("source")) else {
            return;
        };
        let holder = Holder { arbiter: step.provider, resource, consumer };
        if !step.retained {
            self.judge_allocation(step, &holder, ledger);
        }
        // The control that ended goes on with this session.
        ledger.forgive(&debt(Clause::ReportCleared, resource, consumer));
        let expiry = debt(Clause::Expiry, resource, step.session);
        ledger.forgive(&expiry);
        if let Some(seconds) = command.value()["duration"].as_f64()
            && let Ok(duration) = Duration::try_from_secs_f64(seconds)
        {
            let text = format!("resource {resource}: control of {consumer} did not end after {seconds} s");
            ledger.owe(expiry, duration + ledger.bounds.answer, text);
        }
        self.executing.insert(step.session, holder);
        // Control is given when all have heard whom the report names, and so nobody before it any more (strong consistency).
        let now = ledger.now();
        if let Some(arbiter) = self.arbiters.get_mut(&step.provider) {
            let formers =
                arbiter.former.iter_mut().filter(|((of, who), _)| (*of, *who) != (resource, consumer));
            formers.filter(|((of, _), _)| *of == resource).for_each(|(_, former)| {
                former.confirmed.get_or_insert(now);
            });
        }
    }

    /// Whether control is given as it should be.
    fn judge_allocation(&mut self, step: &Step, holder: &Holder, ledger: &mut Ledger) {
        let Holder { resource, consumer, .. } = *holder;
        let other =
            self.executing.values().find(|other| other.resource == resource && other.consumer != consumer);
        ledger.judge(Clause::OneHolder, other.is_none(), || {
            format!(
                "resource {resource} is given to {consumer} and held by {:?}",
                other.map(|other| other.consumer)
            )
        });

        let known = self.arbiters.get(&step.provider);
        let list = known.and_then(|arbiter| arbiter.priorities.get(&resource));
        let list = list.map(Vec::as_slice).unwrap_or_default();
        ledger.judge(Clause::Listed, rank(list, consumer).is_some(), || {
            format!("resource {resource} is given to {consumer}, which is not on its list")
        });
        // A report that names the winner comes before; where it does not, this is the first that is seen of it.
        let taken = self.interrupted.remove(&resource).filter(|taken| taken.loser != consumer);
        if let Some(taken) = taken {
            judge_take_over(resource, &taken, (consumer, list), ledger);
        }
        let told = known.and_then(|arbiter| *arbiter.holders.get(&resource)?);
        ledger.judge(Clause::ReportFirst, told == Some(consumer), || {
            format!("resource {resource} is given to {consumer} when the report names {told:?}")
        });
    }

    /// An allocation is over.
    fn ended(&mut self, step: &Step, ledger: &mut Ledger) {
        let Some(Holder { arbiter, resource, consumer }) = self.executing.remove(&step.session) else {
            return;
        };
        ledger.pay(&debt(Clause::Expiry, resource, step.session));
        if step.reason == "INTERRUPTED" {
            let list = self.arbiters.get(&arbiter).and_then(|arbiter| arbiter.priorities.get(&resource));
            let (list, since) = (list.cloned().unwrap_or_default(), ledger.now());
            self.interrupted.insert(resource, Interrupted { loser: consumer, list, since });
        }
        let goes_on =
            self.executing.values().any(|other| (other.resource, other.consumer) == (resource, consumer));
        let told = self.arbiters.get(&arbiter).and_then(|arbiter| *arbiter.holders.get(&resource)?);
        if goes_on {
            return;
        }
        if told == Some(consumer) {
            let text =
                format!("resource {resource}: the report still names {consumer}, whose control has ended");
            ledger.owe(debt(Clause::ReportCleared, resource, consumer), ledger.bounds.follow, text);
        } else {
            ledger.held(Clause::ReportCleared);
        }
    }

    /// The arbiter has disposed what it said of a session, or is gone: it owes no end of that control any longer. A provider
    /// that starts again clears up without a last word where the command is gone (4.1.5).
    pub(super) fn forgotten(&mut self, session: Guid, disposed: bool, ledger: &mut Ledger) {
        let Some(Holder { resource, .. }) = self.executing.get(&session) else { return };
        ledger.forgive(&debt(Clause::Expiry, *resource, session));
        if disposed {
            self.executing.remove(&session);
        }
    }

    /// A priority list was set.
    fn prioritized(&mut self, step: &Step, command: &Sample, ledger: &mut Ledger) {
        let Some(resource) = command.guid("resourceID") else { return };
        let list = self.arbiters.get(&step.provider).and_then(|arbiter| arbiter.priorities.get(&resource));
        if list == Some(&command.guids("priorities")) {
            ledger.held(Clause::PriorityReport);
        } else {
            let text = format!("resource {resource}: the report does not have the list that was set");
            ledger.owe(debt(Clause::PriorityReport, resource, step.provider), ledger.bounds.follow, text);
        }
    }

    /// A provider executes a command: it may only where it belongs to no resource, or where the consumer may command it.
    fn guarded(&self, step: &Step, command: &Sample, ledger: &mut Ledger) {
        let Some(consumer) = command.guid("source") else { return };
        for arbiter in self.arbiters.values() {
            let of_provider = arbiter.sources.iter().filter(|(_, sources)| sources.contains(&step.provider));
            for (resource, sources) in of_provider {
                let believed = |former: &Former| former.may_be_believed(ledger.now(), ledger.bounds);
                let holds = arbiter.holders.get(resource) == Some(&Some(consumer))
                    || arbiter.former.get(&(*resource, consumer)).is_some_and(believed);
                ledger.judge(Clause::Guard, holds || sources.contains(&consumer), || {
                    format!(
                        "{} executes a command of {consumer}, which does not control {resource}",
                        step.provider
                    )
                });
            }
        }
    }
}
