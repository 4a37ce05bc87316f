//! Every sequence of events, from every state that a session can be in.

use super::*;
use crate::umaa::command::executor::FailureKind;
use crate::umaa::command::table::transitions;
use std::collections::BTreeSet;

fn events() -> Vec<Event> {
    let failures = FailureKind::ALL.map(|kind| Failure::new(kind, "it broke"));
    let mut events: Vec<_> = failures.iter().cloned().map(Event::Failed).collect();
    events.extend(failures.map(|failure| Event::Broken(Stop::Broken, failure)));
    events.extend([
        Event::Received,
        Event::Resumed,
        Event::Updated,
        Event::Validated,
        Event::Executing,
        Event::Completed,
        Event::Disposed,
        Event::Stopped,
    ]);
    events
}

/// Walks all that can be reached, and says which transitions were published on the way.
fn explore(answer: bool, look: impl Fn(&Session, &Event, &Session, &[Effect])) -> BTreeSet<Transition> {
    let (mut known, mut published) = (BTreeSet::new(), BTreeSet::new());
    let mut open = vec![Session::default()];
    while let Some(before) = open.pop() {
        if !known.insert(before.clone()) {
            continue;
        }
        for event in events() {
            let (mut after, mut effects) = (before.clone(), Vec::new());
            after.on(event.clone(), answer, &mut effects);
            look(&before, &event, &after, &effects);
            let mut from = before.state;
            for effect in &effects {
                if let Effect::Publish(to, reason, _) = effect {
                    published.insert(Transition { from, to: *to, reason: *reason });
                    from = Some(*to);
                }
            }
            open.push(after);
        }
    }
    published
}

#[test]
fn all_24_transitions_can_happen_and_no_other() {
    let published = explore(false, |_, _, _, _| {});
    assert_eq!(published, transitions().collect());
}

#[test]
fn an_answered_update_of_a_finished_command_is_the_one_exception() {
    let published = explore(true, |_, _, _, _| {});
    let illegal: Vec<_> = published.iter().filter(|transition| !transition.is_legal()).collect();
    let told = (CommandState::Failed, CommandStatusReason::ServiceFailed);
    assert!(
        !illegal.is_empty() && illegal.iter().all(|transition| (transition.to, transition.reason) == told)
    );
    assert!(illegal.iter().all(|transition| transition.from.is_some_and(CommandState::is_terminal)));
}

#[test]
fn nothing_is_cleaned_up_before_the_consumer_has_disposed_the_command() {
    explore(false, |before, event, after, effects| {
        let cleaned = effects.iter().filter(|effect| **effect == Effect::CleanUp).count();
        assert_eq!(cleaned, usize::from(after.over && !before.over));
        assert!(cleaned == 0 || before.disposed || *event == Event::Disposed, "{before:?} {event:?}");
        assert!(!before.over || effects.is_empty(), "{before:?} {event:?} {effects:?}");
    });
}

#[test]
fn a_disposed_command_that_ends_is_cleaned_up_in_the_same_step() {
    explore(false, |before, event, after, _| {
        let ended = after.state.is_some_and(CommandState::is_terminal);
        assert!(!(ended && after.disposed) || after.over, "{before:?} {event:?} {after:?}");
    });
}

#[test]
fn the_acknowledgement_comes_between_issued_and_commanded() {
    explore(false, |before, event, _, effects| {
        let place = |wanted: fn(&Effect) -> bool| effects.iter().position(wanted);
        let issued = place(|effect| matches!(effect, Effect::Publish(CommandState::Issued, ..)));
        let acknowledged = place(|effect| *effect == Effect::Acknowledge);
        let commanded = place(|effect| matches!(effect, Effect::Publish(CommandState::Commanded, ..)));
        assert!(issued.is_none() || issued < acknowledged, "{before:?} {event:?} {effects:?}");
        assert!(commanded.is_none() || acknowledged.is_none(), "{before:?} {event:?} {effects:?}");
    });
}
