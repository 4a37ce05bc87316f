//! The life of services inside a node: starts, crashes, deadlines, notes, the end.

use super::{Node, Origin, Passed, WORK_MAX, Work};
use crate::event::Effect;
use crate::host::Ran;
use crate::service::domain::DomainEvent;
use crate::service::{Action, Component, ComponentHealth, Condition, Input, JobOutput, Level, Note};
use aldis_envelope::{
    Address, CallId, Envelope, Message, Now, Prefix, Priority, Refusal, ServiceId, Source, Wall,
};
use std::time::Duration;

/// What a service says.
fn work(place: usize, message: Message) -> Work {
    Work::new(Origin::Service(place), message)
}

/// What the stamp says of a message that was said elsewhere.
fn said_at(source_time: Wall) -> Passed {
    Passed {
        source_time,
        lifespan_left_ms: None,
        priority: Priority::Data,
        via: Default::default(),
        delivery: None,
        before: None,
    }
}

impl Node {
    pub(super) fn start_service(&mut self, now: Now, place: usize, effects: &mut Vec<Effect>) {
        let source = self.services[place].spec.source;
        // Its numbers begin anew: what a former life waited for must not be told to this one.
        self.sharing.writers.forget_confirmations(source);
        self.keeping.forget_confirmations(Origin::Service(place));
        let ran = self.services[place].start(now);
        let running = self.services[place].is_running();
        self.awake.push_back(place);
        self.links.services_changed();
        if running && self.bus_is_open {
            effects.push(Effect::Token(source, true));
        }
        if ran == Ran::Well {
            self.service_health(now, source, Condition::Well, "running");
        } else {
            self.after(now, place, ran, effects);
        }
        self.subscribe(now, effects);
        self.catch_up(now, place, effects);
    }

    /// Gives a service an input and looks after what comes of it.
    pub(super) fn run(&mut self, now: Now, place: usize, input: Input<'_>, effects: &mut Vec<Effect>) {
        let hosted = &mut self.services[place];
        let deadline = hosted.next_deadline();
        let ran = hosted.run(now, input);
        self.stirred |= hosted.next_deadline() != deadline;
        if hosted.has_actions() {
            self.stirred = true;
            if self.awake.back() != Some(&place) {
                self.awake.push_back(place);
            }
        }
        if ran != Ran::Well {
            self.stirred = true;
            self.after(now, place, ran, effects);
        }
    }

    pub(super) fn after(&mut self, now: Now, place: usize, ran: Ran, effects: &mut Vec<Effect>) {
        let Ran::Crashed(text) = ran else { return };
        let source = self.services[place].spec.source;
        self.counters.crashes += 1;
        self.links.services_changed();
        if self.bus_is_open {
            effects.push(Effect::Token(source, false));
        }
        self.service_health(now, source, Condition::Failed, &format!("crashed: {text}"));
    }

    /// Does what services want until none wants anything more.
    pub(super) fn settle(&mut self, now: Now, effects: &mut Vec<Effect>) {
        loop {
            while let Some(place) = self.awake.pop_front() {
                if self.services[place].has_actions() {
                    self.take_actions(now, place, effects);
                }
            }
            let Some(work) = self.work.pop_front() else { return };
            self.route(now, work, effects);
        }
    }

    pub(super) fn take_actions(&mut self, now: Now, place: usize, effects: &mut Vec<Effect>) {
        let source = self.services[place].spec.source;
        // Its memory is kept: a message a round would otherwise cost an allocation.
        let mut actions = std::mem::take(&mut self.actions);
        actions.extend(self.services[place].actions());
        for action in actions.drain(..) {
            match action {
                Action::Send(message) => self.take_message(now, source, work(place, message), effects),
                Action::SendConfirmed(message, number, within) => {
                    let confirm = Some((number, within));
                    let work = Work { confirm, ..work(place, message) };
                    self.take_message(now, source, work, effects);
                }
                Action::SendAt(message, source_time) => {
                    let work = Work { passed: Some(Box::new(said_at(source_time))), ..work(place, message) };
                    self.take_message(now, source, work, effects);
                }
                Action::Subscribe(prefixes) => self.subscribe_anew(now, place, prefixes, effects),
                Action::TellAgain(prefixes) => self.tell_again(now, place, &prefixes, effects),
                Action::Domain(command) => effects.push(Effect::Domain(source, command)),
                Action::Congested(congested) => self.services[place].set_congested(congested),
                Action::Call(message, within) => self.open_call(now, place, message, within, effects),
                Action::Job(number, job) => effects.push(Effect::Job(source, number, job)),
                Action::Note(note) => self.note(now, note, effects),
                Action::Spawn(spec) => self.spawn(now, source, spec, effects),
                Action::Stop(other) => self.stop(now, source, other, effects),
                Action::Retire => {
                    self.services[place].retire();
                    self.links.services_changed();
                    if self.bus_is_open {
                        effects.push(Effect::Token(source, false));
                    }
                    self.service_health(now, source, Condition::Degraded, "retired");
                    self.subscribe(now, effects);
                }
            }
        }
        self.actions = actions;
    }

    /// Something in a DDS domain, for the service that bridges it.
    pub(super) fn domain_event(
        &mut self,
        now: Now,
        source: Source,
        event: DomainEvent,
        effects: &mut Vec<Effect>,
    ) {
        if let Some(place) = self.services.iter().position(|hosted| hosted.spec.source == source) {
            self.run(now, place, Input::Domain(event), effects);
        }
    }

    /// A service receives something else from now on. What is kept here of what is new to it comes at once, what others retain as
    /// it is told.
    fn subscribe_anew(&mut self, now: Now, place: usize, prefixes: Vec<Prefix>, effects: &mut Vec<Effect>) {
        let had: Vec<Prefix> = self.services[place].subscribed().cloned().collect();
        self.services[place].set_prefixes(prefixes);
        let is_new = |node: &Self, address: &Address| {
            node.services[place].receives(address) && !had.iter().any(|prefix| prefix.matches(address))
        };
        let kept = self.retained(place, is_new);
        self.subscribe(now, effects);
        for envelope in &kept {
            self.run(now, place, Input::Message(envelope), effects);
        }
    }

    /// Tells a service again what is retained here.
    fn tell_again(&mut self, now: Now, place: usize, prefixes: &[Prefix], effects: &mut Vec<Effect>) {
        let is_wanted = |_: &Self, address: &Address| prefixes.iter().any(|prefix| prefix.matches(address));
        for envelope in &self.retained(place, is_wanted) {
            self.run(now, place, Input::Again(envelope), effects);
        }
    }

    /// What is retained here of what others than a service have said.
    fn retained(&self, place: usize, is_wanted: impl Fn(&Self, &Address) -> bool) -> Vec<Envelope> {
        let own = self.services[place].spec.source;
        let mut kept = Vec::new();
        for (address, history) in self.sharing.writers.histories() {
            if is_wanted(self, address) {
                kept.extend(history.samples().filter(|s| s.message.label.source() != own).cloned());
            }
        }
        for (address, history) in self.sharing.reading.histories() {
            if is_wanted(self, &address) {
                kept.extend(history.samples().cloned());
            }
        }
        kept
    }

    fn take_message(&mut self, now: Now, source: Source, work: Work, effects: &mut Vec<Effect>) {
        let claimed = work.message.label.source();
        let has_crashed = matches!(work.origin, Origin::Service(place) if self.services[place].has_crashed());
        if has_crashed {
            // What it still had to say goes with its life.
        } else if claimed != source {
            self.counters.refused_sources += 1;
            let text = format!("service {source} tried to send as {claimed}: refused");
            self.say(now, Level::Error, "refused source", text, effects);
        } else if self.work.len() >= WORK_MAX {
            self.counters.shed_inside += 1;
            let text =
                format!("more than {WORK_MAX} messages wait inside the node: those of {source} are dropped");
            self.say(now, Level::Error, "shed inside", text, effects);
        } else if self.work.is_empty() {
            self.route(now, work, effects);
        } else {
            self.work.push_back(work);
        }
    }

    fn open_call(
        &mut self,
        now: Now,
        place: usize,
        message: Message,
        within: Duration,
        effects: &mut Vec<Effect>,
    ) {
        let Some(id) = message.call.as_ref().map(|call| call.id) else { return };
        let (source, to) = (message.label.source(), message.label.address.clone());
        // Who is behind a link may answer later: what is for them waits for it.
        let here = matches!(&to, Address::Service(s) if self.is_alive_here(*s))
            || to.entity().is_some_and(|entity| self.links.is_behind(entity));
        let nobody = crate::calls::Alive::default();
        let alive = if here { &nobody } else { &self.alive };
        match self.calls.open(source.service, id, &to, now.monotonic + within, alive) {
            Ok(()) if !here && !self.alive.is_known() => self.waiting_calls.push((place, message)),
            Ok(()) => self.take_message(now, source, work(place, message), effects),
            Err(reason) => self.call_ended(now, (source.service, id, Err(reason)), effects),
        }
    }

    /// The tokens are told: the requests that waited for them go out, but those that nobody waits for any more.
    pub(super) fn send_waiting_calls(&mut self) {
        for (place, message) in std::mem::take(&mut self.waiting_calls) {
            let id = message.call.as_ref().map(|call| call.id);
            if id.is_some_and(|id| self.calls.is_open(message.label.source().service, id)) {
                self.work.push_back(work(place, message));
            }
        }
    }

    fn is_alive_here(&self, source: Source) -> bool {
        self.sources_running().any(|running| running == source)
    }

    pub(super) fn call_ended(
        &mut self,
        now: Now,
        (caller, id, outcome): (ServiceId, CallId, Result<(), Refusal>),
        effects: &mut Vec<Effect>,
    ) {
        match outcome {
            Ok(()) => self.counters.calls_answered += 1,
            Err(_) => self.counters.calls_failed += 1,
        }
        if let Some(place) = self.services.iter().position(|h| h.spec.source.service == caller) {
            self.run(now, place, Input::CallEnded(id, outcome), effects);
        }
    }

    pub(super) fn tokens_changed(&mut self, now: Now, effects: &mut Vec<Effect>) {
        for ended in self.calls.tokens_changed(&self.alive) {
            self.call_ended(now, ended, effects);
        }
    }

    pub(super) fn tell_followers(
        &mut self,
        now: Now,
        input: impl Fn() -> Input<'static>,
        effects: &mut Vec<Effect>,
    ) {
        for place in 0..self.services.len() {
            if self.services[place].follows_bus() {
                self.run(now, place, input(), effects);
            }
        }
    }

    pub(super) fn deadline(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.armed = None;
        if self.ending {
            return self.end_when_kept(now, effects);
        }
        for ended in self.calls.expire(now.monotonic) {
            self.call_ended(now, ended, effects);
        }
        for place in 0..self.services.len() {
            if self.services[place].wants_restart(now.monotonic) {
                self.start_service(now, place, effects);
            }
            if self.services[place].wants_deadline(now.monotonic) {
                self.run(now, place, Input::Deadline, effects);
            }
        }
        self.sharing_due(now, effects);
        self.links_due(now, effects);
        self.give_up_stalled_peers(now, effects);
    }

    pub(super) fn job_done(
        &mut self,
        now: Now,
        source: Source,
        number: u64,
        result: Result<JobOutput, String>,
        effects: &mut Vec<Effect>,
    ) {
        if let Some(place) = self.services.iter().position(|h| h.spec.source == source) {
            self.run(now, place, Input::Job(number, result), effects);
        }
    }

    pub(super) fn service_health(&mut self, now: Now, source: Source, condition: Condition, status: &str) {
        let component = Component::Service(source);
        self.component(now, &ComponentHealth { component, condition, status: status.to_owned() });
    }

    /// Tells the health service. A crash of the health service itself cannot be told this way, and is noted anyhow.
    pub(super) fn component(&mut self, now: Now, health: &ComponentHealth) {
        if let Some(place) = self.service_at(ServiceId::HEALTH) {
            self.stirred = true;
            let ran = self.services[place].run(now, Input::Component(health));
            self.counters.crashes += u64::from(ran != Ran::Well);
            self.awake.push_back(place);
        }
    }

    pub(super) fn note(&mut self, now: Now, note: Note, effects: &mut Vec<Effect>) {
        if let Some(place) = self.service_at(ServiceId::LOG) {
            self.stirred = true;
            let ran = self.services[place].run(now, Input::Note(&note));
            self.counters.crashes += u64::from(ran != Ran::Well);
            self.awake.push_back(place);
        }
        effects.push(Effect::Say(note));
    }

    pub(super) fn shutdown(&mut self, now: Now, effects: &mut Vec<Effect>) {
        if std::mem::replace(&mut self.ending, true) {
            return;
        }
        // The built-in services come first in the configuration and speak last.
        for place in (0..self.services.len()).rev() {
            self.run(now, place, Input::Shutdown, effects);
            self.settle(now, effects);
        }
        self.end_when_kept(now, effects);
    }

    /// The last words are said: the node is gone.
    pub(super) fn end(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.leave(now, effects);
        if self.bus_is_open {
            let running: Vec<_> = self.sources_running().collect();
            effects.extend(running.into_iter().map(|source| Effect::Token(source, false)));
        }
        effects.push(Effect::Exit);
    }
}
