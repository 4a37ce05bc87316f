//! The calls that the services of a node have open.

use aldis_envelope::{Address, Call, CallId, EntityId, Monotonic, Refusal, Role, ServiceId, Source};
use std::collections::{BTreeMap, BTreeSet};

/// How many calls may be open at once on a node. More are refused to the caller, by name.
pub const CALLS_MAX: usize = 4_096;

/// Which services are alive, by their tokens: a hint, and the same token may come twice.
#[derive(Debug, Default)]
pub struct Alive {
    services: BTreeSet<Source>,
    known: bool,
}

impl Alive {
    /// A token appeared or vanished.
    pub fn set(&mut self, source: Source, alive: bool) {
        if alive {
            self.services.insert(source)
        } else {
            self.services.remove(&source)
        };
    }

    /// The tokens of the session's start are all told, or the session is gone and they are forgotten.
    pub fn set_known(&mut self, known: bool) {
        self.known = known;
        if !known {
            self.services.clear();
        }
    }

    /// Whether the tokens of the session's start are all told.
    pub fn is_known(&self) -> bool {
        self.known
    }

    /// The services of an entity that are alive.
    pub fn of_entity(&self, entity: EntityId) -> impl Iterator<Item = Source> + '_ {
        let first = ServiceId::NODE;
        self.services.range(Source::new(entity, first)..).copied().take_while(move |s| s.entity == entity)
    }

    /// Every service that is alive.
    pub fn all(&self) -> impl Iterator<Item = Source> + '_ {
        self.services.iter().copied()
    }

    /// The nodes that are alive, by their entities.
    pub fn nodes(&self) -> impl Iterator<Item = EntityId> + '_ {
        self.services.iter().filter(|s| s.service == ServiceId::NODE).map(|s| s.entity)
    }

    /// Whether nobody is at an address, as far as tokens can tell: they know ids, not mailboxes.
    pub fn is_nobody_at(&self, address: &Address) -> bool {
        self.known
            && match address {
                Address::Name(_) => false,
                Address::Service(to) => !self.services.contains(to),
                Address::EntityServices(entity) | Address::Entity(entity) => {
                    self.of_entity(*entity).next().is_none()
                }
            }
    }
}

/// A call that waits for answers.
#[derive(Debug)]
struct Open {
    to: Address,
    deadline: Monotonic,
    answers: u64,
    /// Who has not said its last word, where it is known who will.
    expected: Option<BTreeSet<Source>>,
    refused: Option<Refusal>,
}

/// How a call ended: who called, which call, and the outcome.
pub type Ended = (ServiceId, CallId, Result<(), Refusal>);

/// All open calls of a node.
#[derive(Debug, Default)]
pub struct Calls {
    open: BTreeMap<(ServiceId, CallId), Open>,
    deadlines: BTreeSet<(Monotonic, ServiceId, CallId)>,
}

impl Calls {
    /// Opens a call, or says at once why it cannot be answered.
    ///
    /// # Errors
    /// [`Refusal::Overloaded`] over [`CALLS_MAX`], [`Refusal::NobodyThere`] where the tokens say so.
    pub fn open(
        &mut self,
        caller: ServiceId,
        id: CallId,
        to: &Address,
        deadline: Monotonic,
        alive: &Alive,
    ) -> Result<(), Refusal> {
        if self.open.len() >= CALLS_MAX {
            return Err(Refusal::Overloaded(format!("{CALLS_MAX} calls of this node are open")));
        }
        if alive.is_nobody_at(to) {
            return Err(Refusal::NobodyThere);
        }
        let expected = expected(to, alive);
        self.deadlines.insert((deadline, caller, id));
        self.open
            .insert((caller, id), Open { to: to.clone(), deadline, answers: 0, expected, refused: None });
        Ok(())
    }

    /// Takes an answer. None when nobody waits for it; otherwise whether the call ended by it.
    pub fn answer(&mut self, caller: ServiceId, from: Source, call: &Call) -> Option<Option<Ended>> {
        let open = self.open.get_mut(&(caller, call.id))?;
        let last = match &call.role {
            Role::Request { .. } => return None,
            Role::Reply { last } => {
                open.answers += 1;
                *last
            }
            Role::Refused { reason } => {
                open.refused = Some(reason.clone());
                true
            }
        };
        let all = match &mut open.expected {
            None => false,
            Some(expected) => {
                if last {
                    expected.remove(&from);
                }
                expected.is_empty()
            }
        };
        Some(if all { self.end(caller, call.id, Refusal::NoAnswer) } else { None })
    }

    /// The tokens changed, or are now all told: calls to nobody end.
    pub fn tokens_changed(&mut self, alive: &Alive) -> Vec<Ended> {
        let nobody: Vec<_> = self
            .open
            .iter()
            .filter(|(_, open)| open.answers == 0 && alive.is_nobody_at(&open.to))
            .map(|(&key, _)| key)
            .collect();
        for open in self.open.values_mut() {
            if let (Address::EntityServices(_) | Address::Entity(_), None) = (&open.to, &open.expected)
                && alive.known
            {
                open.expected = expected(&open.to, alive);
            }
        }
        nobody.into_iter().filter_map(|(caller, id)| self.end(caller, id, Refusal::NobodyThere)).collect()
    }

    /// Ends what has waited long enough.
    pub fn expire(&mut self, now: Monotonic) -> Vec<Ended> {
        let mut ended = Vec::new();
        while let Some(&(deadline, caller, id)) = self.deadlines.first()
            && deadline <= now
        {
            ended.extend(self.end(caller, id, Refusal::NoAnswer));
        }
        ended
    }

    /// Whether a call still waits.
    pub fn is_open(&self, caller: ServiceId, id: CallId) -> bool {
        self.open.contains_key(&(caller, id))
    }

    /// When the next call ends by time.
    pub fn next_deadline(&self) -> Option<Monotonic> {
        self.deadlines.first().map(|&(deadline, ..)| deadline)
    }

    fn end(&mut self, caller: ServiceId, id: CallId, unanswered: Refusal) -> Option<Ended> {
        let open = self.open.remove(&(caller, id))?;
        self.deadlines.remove(&(open.deadline, caller, id));
        let outcome = if open.answers > 0 { Ok(()) } else { Err(open.refused.unwrap_or(unanswered)) };
        Some((caller, id, outcome))
    }
}

/// Who is to answer: one service, or all that are alive; for a mailbox nobody knows.
fn expected(to: &Address, alive: &Alive) -> Option<BTreeSet<Source>> {
    match to {
        Address::Name(_) => None,
        Address::Service(one) => Some(BTreeSet::from([*one])),
        Address::EntityServices(entity) | Address::Entity(entity) => {
            alive.known.then(|| alive.of_entity(*entity).collect())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    const CALLER: ServiceId = ServiceId::LOG;

    fn source(entity: u64, service: u64) -> Source {
        Source::new(EntityId::new(entity).unwrap(), ServiceId::new(service).unwrap())
    }

    fn at(seconds: u64) -> Monotonic {
        Monotonic::since_start(Duration::from_secs(seconds))
    }

    fn reply(id: u64, last: bool) -> Call {
        Call { id: CallId(id), role: Role::Reply { last } }
    }

    fn alive(services: &[(u64, u64)]) -> Alive {
        let mut alive = Alive::default();
        services.iter().for_each(|&(e, s)| alive.set(source(e, s), true));
        alive.set_known(true);
        alive
    }

    #[test]
    fn nobody_is_told_at_once_and_silence_at_the_deadline() {
        let mut calls = Calls::default();
        let alive = alive(&[(400, 1)]);
        let nobody = Address::new("eid400sid2").unwrap();
        assert_eq!(calls.open(CALLER, CallId(1), &nobody, at(5), &alive), Err(Refusal::NobodyThere));
        let silent = Address::new("eid400sid1").unwrap();
        assert_eq!(calls.open(CALLER, CallId(2), &silent, at(5), &alive), Ok(()));
        assert_eq!(calls.next_deadline(), Some(at(5)));
        assert_eq!(calls.expire(at(4)), []);
        assert_eq!(calls.expire(at(5)), [(CALLER, CallId(2), Err(Refusal::NoAnswer))]);
        assert_eq!(calls.answer(CALLER, source(400, 1), &reply(2, true)), None, "too late");
    }

    #[test]
    fn a_call_before_the_tokens_are_told_waits_for_them() {
        let mut calls = Calls::default();
        let mut alive = Alive::default();
        let to = Address::new("eid400sid2").unwrap();
        assert_eq!(calls.open(CALLER, CallId(1), &to, at(5), &alive), Ok(()));
        alive.set(source(400, 1), true);
        assert_eq!(calls.tokens_changed(&alive), []);
        alive.set_known(true);
        assert_eq!(calls.tokens_changed(&alive), [(CALLER, CallId(1), Err(Refusal::NobodyThere))]);
        assert_eq!(calls.next_deadline(), None);
    }

    #[test]
    fn a_call_to_all_services_ends_with_the_last_of_them() {
        let mut calls = Calls::default();
        let alive = alive(&[(400, 1), (400, 2), (401, 1)]);
        let to = Address::new("eid400sidall").unwrap();
        calls.open(CALLER, CallId(1), &to, at(5), &alive).unwrap();
        assert_eq!(calls.answer(CALLER, source(400, 1), &reply(1, false)), Some(None));
        assert_eq!(calls.answer(CALLER, source(400, 1), &reply(1, true)), Some(None));
        let refused = Call { id: CallId(1), role: Role::Refused { reason: Refusal::NobodyThere } };
        assert_eq!(calls.answer(CALLER, source(400, 2), &refused), Some(Some((CALLER, CallId(1), Ok(())))));
    }

    #[test]
    fn a_mailbox_collects_until_the_deadline() {
        let mut calls = Calls::default();
        let to = Address::new("AircraftPathPlanner").unwrap();
        calls.open(CALLER, CallId(1), &to, at(5), &alive(&[])).unwrap();
        for service in 1..4 {
            assert_eq!(calls.answer(CALLER, source(400, service), &reply(1, true)), Some(None));
        }
        assert_eq!(calls.expire(at(5)), [(CALLER, CallId(1), Ok(()))]);
    }
}
