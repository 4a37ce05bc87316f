//! What a service wants done, in the order in which it said so.

use super::domain::DomainCommand;
use super::{Job, Level, Note, ServiceSpec};
use aldis_envelope::{
    Address, Call, CallId, ContentType, Descriptor, Envelope, Label, Message, Name, Prefix, Refusal, Role,
    Source, Wall,
};
use bytes::Bytes;
use std::sync::Arc;
use std::time::Duration;

/// One wish of a service.
pub enum Action {
    /// Send a message.
    Send(Message),
    /// Send a message and say when every reader has it: with this number, at most so long.
    SendConfirmed(Message, u64, Duration),
    /// Send a message that its source said at this moment.
    SendAt(Message, Wall),
    /// Receive these from now on, and no others.
    Subscribe(Vec<Prefix>),
    /// Be told again what is retained of these.
    TellAgain(Vec<Prefix>),
    /// Do something in the DDS domain that this service bridges.
    Domain(DomainCommand),
    /// Stop (true) or go on reading from peers and bus: what this service hands on is not taken.
    Congested(bool),
    /// Send a request and wait for its answers for so long.
    Call(Message, Duration),
    /// Compute something outside the loop; the number comes back with the result.
    Job(u64, Job),
    /// Say something to people.
    Note(Note),
    /// End this service.
    Retire,
    /// Start another service of the same entity.
    Spawn(ServiceSpec),
    /// End another service of the same entity, and forget it.
    Stop(Source),
}

/// Takes the wishes of a service while it handles an input.
pub struct Outbox {
    source: Source,
    next_call: u64,
    actions: Vec<Action>,
}

impl Outbox {
    pub(crate) fn new(source: Source) -> Self {
        Self { source, next_call: 1, actions: Vec::new() }
    }

    /// The ids of the service itself.
    pub fn source(&self) -> Source {
        self.source
    }

    /// Sends a message. Its source must be the service's own: others are refused and noted.
    pub fn send(&mut self, message: Message) {
        self.actions.push(Action::Send(message));
    }

    /// Sends a message that was said elsewhere at this moment.
    pub fn send_at(&mut self, message: Message, source_time: Wall) {
        self.actions.push(Action::SendAt(message, source_time));
    }

    /// Receives these from now on, in place of what it received before. What is retained of what is new comes as messages.
    pub fn subscribe(&mut self, prefixes: Vec<Prefix>) {
        self.actions.push(Action::Subscribe(prefixes));
    }

    /// Wants to be told again what is retained of these, of which it has all: it comes as [`Input::Again`](super::Input::Again) before
    /// anything else.
    pub fn tell_again(&mut self, prefixes: Vec<Prefix>) {
        self.actions.push(Action::TellAgain(prefixes));
    }

    /// Has something done in the DDS domain that this service bridges.
    pub fn domain(&mut self, command: DomainCommand) {
        self.actions.push(Action::Domain(command));
    }

    /// Says whether what it hands on is not taken, so that the node must stop reading.
    pub fn congested(&mut self, congested: bool) {
        self.actions.push(Action::Congested(congested));
    }

    /// Sends a message, and wants to be told with [`Input::Confirmed`](super::Input::Confirmed) and this number once every
    /// matched reliable reader has it, or that some have not `within` this time. Readers that come later do not count.
    pub fn send_confirmed(&mut self, message: Message, number: u64, within: Duration) {
        self.actions.push(Action::SendConfirmed(message, number, within));
    }

    /// Sends a request and waits for answers at most `within`. The answers come as messages, then
    /// [`Input::CallEnded`](super::Input::CallEnded) says how it ended.
    pub fn call(
        &mut self,
        to: Address,
        content_type: ContentType,
        descriptor: Descriptor,
        content: Bytes,
        within: Duration,
    ) -> CallId {
        let id = CallId(self.next_call);
        self.next_call += 1;
        let label = Label::limitedcast(to, content_type, descriptor, self.source);
        let time_left_ms = u32::try_from(within.as_millis()).unwrap_or(u32::MAX);
        let call = Some(Box::new(Call { id, role: Role::Request { time_left_ms } }));
        self.actions.push(Action::Call(Message { call, ..Message::new(Arc::new(label), content) }, within));
        id
    }

    /// Answers a request; does nothing where the message is none. `last` says that no more answers follow from here.
    pub fn reply(
        &mut self,
        request: &Envelope,
        content_type: ContentType,
        descriptor: Name,
        content: Bytes,
        last: bool,
    ) {
        if let Some(id) = request_id(request) {
            let to = Address::Service(request.message.label.source());
            let label = Label::limitedcast(to, content_type, descriptor.into(), self.source);
            let call = Some(Box::new(Call { id, role: Role::Reply { last } }));
            self.send(Message { call, ..Message::new(Arc::new(label), content) });
        }
    }

    /// Refuses a request with a reason; does nothing where the message is none.
    pub fn refuse(&mut self, request: &Envelope, reason: Refusal) {
        if let Some(message) = refusal(self.source, request, reason) {
            self.send(message);
        }
    }

    /// Has something computed outside the loop.
    pub fn job(&mut self, number: u64, job: Job) {
        self.actions.push(Action::Job(number, job));
    }

    /// Says something to people.
    pub fn note(&mut self, level: Level, text: impl Into<String>) {
        self.actions.push(Action::Note(Note { level, text: text.into() }));
    }

    /// Ends this service after this input.
    pub fn retire(&mut self) {
        self.actions.push(Action::Retire);
    }

    /// Takes over what another outbox of the same service holds.
    pub(crate) fn push(&mut self, action: Action) {
        self.actions.push(action);
    }

    /// Starts another service after this input. Its entity must be this one's, and its ids free.
    pub fn spawn(&mut self, spec: ServiceSpec) {
        self.actions.push(Action::Spawn(spec));
    }

    /// Ends another service of the same entity after this input, with last words, and forgets it.
    pub fn stop(&mut self, source: Source) {
        self.actions.push(Action::Stop(source));
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.actions.is_empty()
    }

    pub(crate) fn drain(&mut self) -> std::vec::Drain<'_, Action> {
        self.actions.drain(..)
    }

    pub(crate) fn forget(&mut self) {
        self.actions.clear();
    }
}

fn request_id(request: &Envelope) -> Option<CallId> {
    match request.message.call.as_deref() {
        Some(Call { id, role: Role::Request { .. } }) => Some(*id),
        _ => None,
    }
}

/// The message that refuses a request, from one of the services it was addressed to.
pub(crate) fn refusal(from: Source, request: &Envelope, reason: Refusal) -> Option<Message> {
    let id = request_id(request)?;
    let label = &request.message.label;
    let attributes = &label.attributes;
    let to = Address::Service(label.source());
    let refused =
        Label::limitedcast(to, attributes.content_type.clone(), attributes.descriptor.clone(), from);
    let call = Some(Box::new(Call { id, role: Role::Refused { reason } }));
    Some(Message { call, ..Message::new(Arc::new(refused), Bytes::new()) })
}
