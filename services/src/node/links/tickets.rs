//! What became of what crosses: callers are told, and people where nobody else is.

use super::super::{Node, Origin, Work};
use super::{Attached, CALLERS_MAX, Caller};
use crate::event::{Effect, LinkId};
use crate::link::{Reason, Ticket, TicketState};
use crate::service::Level;
use aldis_envelope::aldis::{self, link as told};
use aldis_envelope::{
    Address, Call, ContentType, Envelope, Label, Message, Name, Now, Refusal, Role, ServiceId, Source,
};
use std::sync::Arc;
use std::time::Duration;

impl Attached {
    /// The ticket of a message. Who calls is remembered.
    pub(super) fn ticket(&mut self, origin: Origin, envelope: &Envelope) -> Ticket {
        let ticket = Ticket(self.next_ticket);
        self.next_ticket += 1;
        let message = &envelope.message;
        if let Some(Call { id, role: Role::Request { .. } }) = message.call.as_deref()
            && self.callers.len() < CALLERS_MAX
        {
            let caller = Caller {
                source: message.label.source(),
                call: *id,
                to: message.label.address.clone(),
                descriptor: message.label.attributes.descriptor.clone(),
                wants_word: matches!(origin, Origin::Bus),
            };
            self.callers.insert(ticket, caller);
        }
        ticket
    }
}

fn milliseconds(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}

fn call_state(state: &TicketState) -> told::CallState {
    match state {
        TicketState::Accepted { estimate } => told::CallState::Accepted(estimate.map(milliseconds)),
        TicketState::OnAir { tries } => told::CallState::OnAir(*tries),
        TicketState::Delivered { after, tries } => told::CallState::Delivered(milliseconds(*after), *tries),
        TicketState::Expired { tries } => told::CallState::Expired(*tries),
        TicketState::Cancelled { tries } => told::CallState::Cancelled(*tries),
        TicketState::Refused(reason) => told::CallState::Refused(reason.to_string()),
    }
}

/// What a caller is told at once; what only its deadline tells is left to that.
fn refusal(state: &TicketState) -> Option<Refusal> {
    match state {
        TicketState::Refused(reason @ Reason::QueueFull(_)) => Some(Refusal::Overloaded(reason.to_string())),
        TicketState::Refused(reason) => Some(Refusal::Failed(reason.to_string())),
        TicketState::Cancelled { .. } => Some(Refusal::Failed("it was taken back on its way".into())),
        _ => None,
    }
}

impl Node {
    /// Word of a message that is to cross.
    pub(super) fn link_ticket(
        &mut self,
        now: Now,
        place: usize,
        ticket: Ticket,
        state: TicketState,
        effects: &mut Vec<Effect>,
    ) {
        let attached = &mut self.links.all[place];
        let ended = !matches!(state, TicketState::Accepted { .. } | TicketState::OnAir { .. });
        let caller = attached.callers.get(&ticket).cloned();
        if ended {
            attached.callers.remove(&ticket);
        }
        match caller {
            Some(caller) => self.tell_caller(place, &caller, &state),
            None => self.tell_people(now, place, &state, effects),
        }
        self.settle(now, effects);
    }

    fn tell_caller(&mut self, place: usize, caller: &Caller, state: &TicketState) {
        let (id, own) = (LinkId(place), Source::new(self.entity(), ServiceId::NODE));
        let to = Address::Service(caller.source);
        let mut say = |message| self.work.push_back(Work::new(Origin::Link(id), message));
        if let Some(reason) = refusal(state) {
            let from = match caller.to {
                Address::Service(called) => called,
                _ => own,
            };
            let label = Label::limitedcast(to.clone(), ContentType::Aldis, caller.descriptor.clone(), from);
            let call = Some(Box::new(Call { id: caller.call, role: Role::Refused { reason } }));
            say(Message { call, ..Message::new(Arc::new(label), bytes::Bytes::new()) });
        }
        if caller.wants_word
            && let Ok(name) = Name::new(told::TICKET)
        {
            let label = Label::limitedcast(to, ContentType::Aldis, name.into(), own);
            let peer = self.links.all[place].spec.link.peer;
            let word = told::CallTicket { call: caller.call, peer, state: call_state(state) };
            let message = Message::new(Arc::new(label), aldis::encode(&word).into());
            self.work.push_back(Work::new(Origin::Link(id), message));
        }
    }

    /// What is no call has nobody who waits for word.
    fn tell_people(&mut self, now: Now, place: usize, state: &TicketState, effects: &mut Vec<Effect>) {
        let name = &self.links.all[place].spec.name;
        let (kind, text) = match state {
            TicketState::Refused(reason) => {
                ("refused", format!("{name}: a message is not carried: {reason}"))
            }
            TicketState::Expired { tries } => (
                "expired",
                format!("{name}: a command's lifespan ended before it arrived, sent {tries} times"),
            ),
            _ => return,
        };
        self.say(now, Level::Warning, &format!("{name} {kind}"), text, effects);
    }
}
