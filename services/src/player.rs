//! Sends prepared messages: at their times, after other messages, once or again and again. A scenario without its tool.

use crate::service::{Input, Outbox, Service};
use aldis_envelope::{
    ContentType, Instance, Label, Message, Monotonic, Name, Now, Prefix, Refusal, Source, lmcp,
};
use bytes::Bytes;
use std::sync::Arc;
use std::time::Duration;

/// How many messages that are due go out at once; more wait for the next moment, so that nobody is held up for long.
const AT_ONCE_MAX: usize = 256;

/// When a message goes out first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Start {
    /// So long after the start of the service.
    At(Duration),
    /// So long after the first message to such an address.
    After(Prefix, Duration),
}

/// A message with its times.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Scheduled {
    /// When it goes out first.
    pub start: Start,
    /// How long after that again; none is never.
    pub period: Option<Duration>,
    /// How often in all; none is without end. Without a period it goes out once.
    pub times: Option<u32>,
    /// The type of the LMCP message.
    pub descriptor: Name,
    /// The LMCP message.
    pub content: Bytes,
}

/// The service that sends them.
pub struct Player {
    scheduled: Vec<Pending>,
}

struct Pending {
    message: Scheduled,
    label: Arc<Label>,
    next: Option<Monotonic>,
    sent: u32,
    has_begun: bool,
}

impl Player {
    /// A player with these ids.
    pub fn new(source: Source, messages: Vec<Scheduled>) -> Self {
        let pending = |message: Scheduled| {
            let label = Label::broadcast(ContentType::Lmcp, message.descriptor.clone(), source);
            Pending { message, label: Arc::new(label), next: None, sent: 0, has_begun: false }
        };
        Self { scheduled: messages.into_iter().map(pending).collect() }
    }

    /// Begins what waits for this.
    fn begin(&mut self, now: Now, delay: impl Fn(&Start) -> Option<Duration>) {
        for pending in self.scheduled.iter_mut().filter(|pending| !pending.has_begun) {
            if let Some(delay) = delay(&pending.message.start) {
                pending.has_begun = true;
                pending.next = Some(now.monotonic + delay);
            }
        }
    }

    /// Sends what is due, the earliest first, and of one moment in the order of the configuration.
    fn send_due(&mut self, now: Now, out: &mut Outbox) {
        for _ in 0..AT_ONCE_MAX {
            let due = self.scheduled.iter_mut().filter(|p| p.next.is_some_and(|at| at <= now.monotonic));
            let Some(pending) = due.min_by_key(|p| p.next) else { return };
            let content = pending.message.content.clone();
            let key = lmcp::natural_key(pending.label.descriptor(), &content);
            let message = Message::new(pending.label.clone(), content);
            out.send(match key {
                Some(key) => message.of_instance(Instance::of_number(key)),
                None => message,
            });
            pending.sent = pending.sent.saturating_add(1);
            pending.next = pending.following();
        }
    }
}

impl Pending {
    /// When it goes out again.
    fn following(&self) -> Option<Monotonic> {
        let again = self.message.times.is_none_or(|times| self.sent < times);
        Some(self.next? + self.message.period.filter(|_| again)?)
    }
}

impl Service for Player {
    fn subscriptions(&self) -> Vec<Prefix> {
        let starts = self.scheduled.iter().map(|pending| &pending.message.start);
        let after = starts.filter_map(|start| match start {
            Start::At(_) => None,
            Start::After(prefix, _) => Some(prefix.clone()),
        });
        let mut prefixes: Vec<_> = after.collect();
        prefixes.sort();
        prefixes.dedup();
        prefixes
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            Input::Started => self.begin(now, |start| match start {
                Start::At(delay) => Some(*delay),
                Start::After(..) => None,
            }),
            Input::Message(envelope) if envelope.message.call.is_some() => {
                let what = envelope.message.label.descriptor().to_owned();
                out.refuse(envelope, Refusal::NotUnderstood(what));
            }
            Input::Message(envelope) => {
                let address = &envelope.message.label.address;
                self.begin(now, |start| match start {
                    Start::After(prefix, delay) if prefix.matches(address) => Some(*delay),
                    _ => None,
                });
            }
            Input::Shutdown => self.scheduled.clear(),
            _ => {}
        }
        self.send_due(now, out);
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.scheduled.iter().filter_map(|pending| pending.next).min()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::service::Action;
    use aldis_envelope::{Address, BootId, EntityId, Envelope, Priority, ServiceId, Stamp, Wall};

    fn now(ms: u64) -> Now {
        Now { monotonic: Monotonic::since_start(Duration::from_millis(ms)), wall: Wall(0) }
    }

    fn source() -> Source {
        Source::new(EntityId::new(400).unwrap(), ServiceId::new(100).unwrap())
    }

    fn scheduled(name: &str, start: Start, period: Option<u64>, times: Option<u32>) -> Scheduled {
        let period = period.map(Duration::from_millis);
        let descriptor = Name::new(name).unwrap();
        Scheduled { start, period, times, descriptor, content: Bytes::from_static(b"x") }
    }

    fn envelope(name: &str) -> Envelope {
        let other = Source::new(EntityId::new(1).unwrap(), ServiceId::new(9).unwrap());
        let label = Label::broadcast(ContentType::Lmcp, Name::new(name).unwrap(), other);
        let stamp = Stamp {
            node: other.entity,
            boot: BootId(1),
            sequence: 1,
            source_time: Wall(0),
            lifespan_left_ms: None,
            priority: Priority::Data,
            skipped: 0,
            via: Default::default(),
        };
        Envelope { message: Message::new(Arc::new(label), Bytes::from_static(b"x")), stamp }
    }

    /// What is sent at each moment, as `name@ms`.
    fn played(messages: Vec<Scheduled>, heard: &[(u64, &str)], until_ms: u64) -> Vec<String> {
        let (mut player, mut out) = (Player::new(source(), messages), Outbox::new(source()));
        let mut sent = Vec::new();
        for ms in 0..=until_ms {
            if ms == 0 {
                player.handle(now(0), Input::Started, &mut out);
            }
            for (_, name) in heard.iter().filter(|(at, _)| *at == ms) {
                player.handle(now(ms), Input::Message(&envelope(name)), &mut out);
            }
            while player.next_deadline().is_some_and(|at| at <= now(ms).monotonic) {
                player.handle(now(ms), Input::Deadline, &mut out);
            }
            sent.extend(out.drain().filter_map(|action| match action {
                Action::Send(message) => match &message.label.address {
                    Address::Name(name) => Some(format!("{name}@{ms}")),
                    other => panic!("{other:?}"),
                },
                _ => None,
            }));
        }
        sent
    }

    #[test]
    fn messages_go_out_at_their_times_and_in_their_order() {
        let at = |ms| Start::At(Duration::from_millis(ms));
        let messages = vec![
            scheduled("late", at(7), None, None),
            scheduled("first", at(3), None, Some(5)),
            scheduled("second", at(3), None, None),
            scheduled("often", at(2), Some(4), Some(3)),
            scheduled("on", at(9), Some(2), None),
        ];
        let expected = ["often@2", "first@3", "second@3", "often@6", "late@7", "on@9", "often@10", "on@11"];
        assert_eq!(played(messages, &[], 12), expected);
    }

    #[test]
    fn an_event_begins_what_waits_for_it_once() {
        let after = |prefix, ms| Start::After(Prefix::new(prefix).unwrap(), Duration::from_millis(ms));
        let messages = vec![
            scheduled("answer", after("afrl.", 2), None, None),
            scheduled("never", after("uxas.", 0), None, None),
        ];
        assert_eq!(Player::new(source(), messages.clone()).subscriptions().len(), 2);
        assert_eq!(played(messages, &[(1, "b"), (4, "afrl.A"), (5, "afrl.A")], 20), ["answer@6"]);
    }
}
