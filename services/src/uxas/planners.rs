//! Who answers the mailboxes of route planners, and which of them are gone.
//!
//! | state of a mailbox | what comes | next |
//! | --- | --- | --- |
//! | unknown, answered, gone | an answer | answered |
//! | answered | its planner's token is lost | gone: all that was asked fails |
//! | gone | a request | gone: another planner may answer for a moment, then the request fails |

use aldis_envelope::{Monotonic, Source};
use std::collections::BTreeMap;
use std::time::Duration;

/// How long others may take to answer a mailbox whose planner is gone.
const OTHERS_WITHIN: Duration = Duration::from_millis(50);

/// The planners behind mailboxes.
#[derive(Debug, Default)]
pub struct Planners {
    answering: BTreeMap<&'static str, Source>,
    gone: BTreeMap<&'static str, Source>,
    /// Until when others may answer what was asked after a planner was gone.
    due: BTreeMap<&'static str, Monotonic>,
}

impl Planners {
    /// A mailbox is asked something.
    pub fn asked(&mut self, mailbox: &'static str, now: Monotonic) {
        if self.gone.contains_key(mailbox) {
            self.due.entry(mailbox).or_insert(now + OTHERS_WITHIN);
        }
    }

    /// Somebody answers it.
    pub fn answered(&mut self, mailbox: &'static str, planner: Source) {
        self.answering.insert(mailbox, planner);
        self.gone.remove(mailbox);
        self.due.remove(mailbox);
    }

    /// A service is gone: the mailboxes that it answered last.
    pub fn lost(&mut self, service: Source) -> Vec<&'static str> {
        let mailboxes: Vec<_> = self.answering.iter().filter(|(_, planner)| **planner == service).collect();
        let mailboxes: Vec<_> = mailboxes.into_iter().map(|(&mailbox, _)| mailbox).collect();
        for &mailbox in &mailboxes {
            self.answering.remove(mailbox);
            self.gone.insert(mailbox, service);
        }
        mailboxes
    }

    /// When the next mailbox is given up.
    pub fn deadline(&self) -> Option<Monotonic> {
        self.due.values().copied().min()
    }

    /// The mailboxes that nobody has answered in time, and whose planner is gone.
    pub fn overdue(&mut self, now: Monotonic) -> Vec<(&'static str, Source)> {
        let late: Vec<_> =
            self.due.iter().filter(|(_, at)| **at <= now).map(|(&mailbox, _)| mailbox).collect();
        self.due.retain(|_, at| *at > now);
        late.into_iter().filter_map(|mailbox| Some((mailbox, *self.gone.get(mailbox)?))).collect()
    }
}

/// Why a mailbox does not answer, in words.
pub fn cause(mailbox: &str, planner: Source) -> String {
    format!("the route planner {planner} of {mailbox} is gone: its node has ended or lost contact")
}

#[cfg(test)]
mod tests {
    use super::*;
    use aldis_envelope::{EntityId, ServiceId};

    #[test]
    fn who_is_gone_is_waited_for_a_moment_and_another_may_answer() {
        let planner = |id| Source::new(EntityId::new(id).unwrap(), ServiceId::new(100).unwrap());
        let at = |ms| Monotonic::since_start(Duration::from_millis(ms));
        let mut planners = Planners::default();
        planners.asked("A", at(0));
        assert_eq!(planners.deadline(), None, "nobody is known to be gone");
        planners.answered("A", planner(1));
        planners.answered("B", planner(2));
        assert_eq!((planners.lost(planner(3)), planners.lost(planner(1))), (vec![], vec!["A"]));
        planners.asked("B", at(10));
        assert_eq!(planners.deadline(), None);
        planners.asked("A", at(10));
        planners.asked("A", at(30));
        assert_eq!(planners.deadline(), Some(at(60)));
        assert_eq!(planners.overdue(at(59)), []);
        assert_eq!(planners.overdue(at(60)), [("A", planner(1))]);
        assert_eq!(planners.deadline(), None);
        planners.asked("A", at(70));
        planners.answered("A", planner(4));
        assert_eq!((planners.deadline(), planners.overdue(at(500))), (None, vec![]));
    }
}
