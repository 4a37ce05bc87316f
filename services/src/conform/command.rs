//! Commands and what is said of them (ICD 4.1), for every service alike: by the names of their topics they belong together.

mod session;

use super::ledger::Ledger;
use super::sample::Sample;
use super::{Clause, FOLLOWED_MAX};
use aldis_envelope::{Guid, Monotonic};
use session::Session;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// What a topic is in a command's family (4.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The commands themselves.
    Command,
    /// Their statuses.
    Status,
    /// Their acknowledgements.
    Ack,
    /// Their execution statuses.
    ExecutionStatus,
}

/// A topic as a part of a family: the family's name, such as `UMAA::SO::ResourceAllocation::ResourceAllocation`, and its role.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Part {
    pub(super) family: String,
    pub(super) role: Role,
}

/// The part that a topic plays by its name (3.4); none where it is a report.
pub(super) fn part_of(topic: &str) -> Option<Part> {
    let endings = [
        ("CommandStatus", Role::Status),
        ("CommandAckReport", Role::Ack),
        ("ExecutionStatusReport", Role::ExecutionStatus),
        ("Command", Role::Command),
    ];
    let found = endings.iter().find_map(|(ending, role)| Some((topic.strip_suffix(ending)?, *role)));
    found.map(|(family, role)| Part { family: family.to_owned(), role })
}

/// The role of a topic of UMAA in a command's family; none where it is a report, or no topic of UMAA. Version 6.0 names topics
/// by their types.
pub fn role_of(topic: &str) -> Option<Role> {
    let name = topic.strip_suffix("Type").unwrap_or(topic);
    part_of(name).filter(|_| name.starts_with("UMAA::")).map(|part| part.role)
}

/// A step of a command that was seen: for those who watch what commands do.
#[derive(Debug, Clone)]
pub(super) struct Step {
    pub(super) family: String,
    pub(super) provider: Guid,
    pub(super) session: Guid,
    /// The command as it was last seen.
    pub(super) command: Option<Sample>,
    pub(super) to: String,
    pub(super) reason: String,
    /// Whether it is history: what came before it may not be known.
    pub(super) retained: bool,
}

/// Family, session, provider.
type SessionId = (String, Guid, Guid);

/// All commands that are known.
#[derive(Debug)]
pub(super) struct Commands {
    execution_statuses: BTreeSet<String>,
    sessions: BTreeMap<SessionId, Session>,
    /// Sessions that were cancelled before they were answered, and when to forget them.
    unanswered: VecDeque<(Monotonic, SessionId)>,
}

impl Commands {
    pub(super) fn new(execution_statuses: BTreeSet<String>) -> Self {
        Self { execution_statuses, sessions: BTreeMap::new(), unanswered: VecDeque::new() }
    }

    /// A sample of a command or about one. What the command did by it.
    pub(super) fn put(
        &mut self,
        part: &Part,
        sample: &Sample,
        retained: bool,
        ledger: &mut Ledger,
    ) -> Option<Step> {
        self.forget(ledger.now());
        let session_id = sample.guid("sessionID")?;
        let source = sample.guid("source")?;
        let provider = if part.role == Role::Command { sample.guid("destination")? } else { source };
        let sound = match part.role {
            Role::Command => self.unique(&part.family, session_id, (provider, source), ledger),
            _ => retained || self.answered_by(&part.family, session_id, provider, ledger),
        };
        if !sound {
            return None;
        }
        let id = (part.family.clone(), session_id, provider);
        if self.sessions.len() >= FOLLOWED_MAX && !self.sessions.contains_key(&id) {
            ledger.unfollowed();
            return None;
        }
        let has_execution_status =
            self.execution_statuses.contains(&format!("{}ExecutionStatusReport", part.family));
        let new = || Session::new(id.clone(), has_execution_status);
        let session = self.sessions.entry(id.clone()).or_insert_with(new);
        match part.role {
            Role::Command => session.command(sample, retained, ledger),
            Role::Ack => session.ack(sample, retained, ledger),
            Role::ExecutionStatus => session.execution_status(sample, retained, ledger),
            Role::Status => return session.status(sample, retained, ledger),
        }
        None
    }

    /// Forgets what nobody has answered in time.
    fn forget(&mut self, now: Monotonic) {
        while self.unanswered.front().is_some_and(|(due, _)| *due < now) {
            let Some((_, id)) = self.unanswered.pop_front() else { return };
            if self.sessions.get(&id).is_some_and(Session::is_unanswered) {
                self.sessions.remove(&id);
            }
        }
    }

    /// The active commands of a family with that session: provider and consumer.
    fn active(&self, family: &str, session: Guid) -> impl Iterator<Item = (Guid, Guid)> + '_ {
        let id = |provider| (family.to_owned(), session, provider);
        let known = self.sessions.range(id(Guid::NIL)..=id(Guid([u8::MAX; 16])));
        known.filter_map(|((_, _, provider), known)| Some((*provider, known.active_source()?)))
    }

    /// An active command has its session id alone (4.1).
    fn unique(&self, family: &str, session: Guid, ends: (Guid, Guid), ledger: &mut Ledger) -> bool {
        let other = self.active(family, session).find(|other| *other != ends);
        ledger.judge(Clause::SessionUnique, other.is_none(), || {
            let (provider, consumer) = other.unwrap_or_default();
            format!(
                "session {session} of {} is that of an active command of {consumer} to {provider} too",
                ends.1
            )
        });
        other.is_none()
    }

    /// Who speaks about a command is its destination (4.1).
    fn answered_by(&self, family: &str, session: Guid, provider: Guid, ledger: &mut Ledger) -> bool {
        if self.sessions.contains_key(&(family.to_owned(), session, provider)) {
            ledger.held(Clause::Destination);
            return true;
        }
        let meant = self.active(family, session).next();
        if let Some((meant, _)) = meant {
            let text = format!("{provider} speaks about session {session}, which is for {meant}");
            ledger.broken(Clause::Destination, text);
        }
        meant.is_none()
    }

    /// An instance of a command or about one is disposed.
    pub(super) fn disposed(&mut self, part: &Part, key: &Sample, ledger: &mut Ledger) {
        let due = ledger.now() + ledger.bounds.answer + ledger.bounds.slack;
        self.with(part, key, |session| session.disposed(part.role, ledger));
        if let Some(id) = id_of(part, key)
            && self.sessions.get(&id).is_some_and(Session::is_unanswered)
        {
            self.unanswered.push_back((due, id));
        }
    }

    /// Its writer has unregistered.
    pub(super) fn unregistered(&mut self, part: &Part, key: &Sample, ledger: &mut Ledger) {
        if !self.with(part, key, |session| session.unregistered(part.role, ledger)) {
            // Nothing is left of the command: all is cleared up.
            match part.role {
                Role::Command => ledger.held(Clause::ConsumerShutdown),
                Role::Status => ledger.held(Clause::ProviderShutdown),
                Role::Ack | Role::ExecutionStatus => {}
            }
        }
    }

    /// Contact with its writer is lost: nothing is owed by who is gone.
    pub(super) fn lost(&mut self, part: &Part, key: &Sample, ledger: &mut Ledger) {
        self.with(part, key, |session| session.vanished(part.role, ledger));
    }

    /// Whether the command is known.
    fn with(&mut self, part: &Part, key: &Sample, act: impl FnOnce(&mut Session)) -> bool {
        let Some(id) = id_of(part, key) else { return false };
        let Some(known) = self.sessions.get_mut(&id) else { return false };
        act(known);
        if known.is_over() {
            self.sessions.remove(&id);
        }
        true
    }
}

fn id_of(part: &Part, key: &Sample) -> Option<SessionId> {
    let provider = if part.role == Role::Command { "destination" } else { "source" };
    Some((part.family.clone(), key.guid("sessionID")?, key.guid(provider)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_the_role() {
        let of = |name: &str| role_of(&format!("UMAA::SO::X::{name}"));
        assert_eq!(of("XCommand"), Some(Role::Command));
        assert_eq!(of("XCommandType"), Some(Role::Command));
        assert_eq!(of("XCommandStatus"), Some(Role::Status));
        assert_eq!(of("XCommandStatusType"), Some(Role::Status));
        assert_eq!(of("XCommandAckReport"), Some(Role::Ack));
        assert_eq!(of("XExecutionStatusReport"), Some(Role::ExecutionStatus));
        assert_eq!(of("XReport"), None);
        assert_eq!(role_of("afrl.cmasi.VehicleActionCommand"), None);
    }
}
