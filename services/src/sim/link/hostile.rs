//! Frames of strangers: made up, cut, turned over, replayed. A link with keys takes none of them, and answers none.

use super::emulator::Profile;
use super::load::command;
use super::world::{LinkWorld, Port};
use crate::link::{CarrierId, Class, Event, LinkKey};
use bytes::Bytes;
use std::time::Duration;

/// What hostile frames came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct HostileReport {
    /// Frames given to the link.
    pub frames: u64,
    /// Of those, how many it counted as of strangers, forged, of another life, or repeated.
    pub counted: u64,
    /// Frames that it took for its peer's.
    pub taken: u64,
    /// Frames that it sent at once because of them.
    pub answers: u64,
    /// Messages that it handed over because of them.
    pub delivered: u64,
}

/// How many frames are given between two looks at the clock of the world.
const AT_ONCE: u64 = 1_000;

/// Gives `count` hostile frames to a link with keys that is in use.
pub fn hostile(count: u64, seed: u64) -> HostileReport {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut world = LinkWorld::new(seed);
    let (shore, vehicle) = (world.machine(1, 0), world.machine(400, 0));
    let keys = [LinkKey { number: 1, secret: [random.u8(..); 32] }];
    let profile = Profile { loss: 0.0, ..Profile::L4 };
    let (a, b) = world.join(shore, vehicle, &[profile], &keys, |_| {});
    world.captured = Some(Vec::new());
    for number in 1..=200 {
        let at = world.now().elapsed();
        world.offer(a, command(1, 400, number, at, Duration::from_secs(60)), Class::Command);
        world.offer(b, command(400, 1, number, at, Duration::from_secs(60)), Class::Command);
        world.run_for(Duration::from_millis(100));
    }
    // All is through: what the link sends from now on in the same moment is an answer.
    world.run_for(Duration::from_secs(5));
    let captured = world.captured.take().unwrap_or_default();
    world.take_seen();
    let mut report = HostileReport::default();
    while report.frames < count {
        attack(&mut world, b, &captured, &mut random, AT_ONCE.min(count - report.frames), &mut report);
        world.run_for(Duration::from_secs(1));
        world.take_seen();
    }
    report
}

/// Frames in one moment. What is due in it by the link's own clock was sent before.
fn attack(
    world: &mut LinkWorld,
    port: Port,
    captured: &[Bytes],
    random: &mut fastrand::Rng,
    count: u64,
    report: &mut HostileReport,
) {
    world.give(port, vec![Event::Deadline]);
    let before = world.link(port).counters().clone();
    for _ in 0..count {
        let frame = draw(captured, random);
        world.give(port, vec![Event::Frame(CarrierId(0), frame)]);
    }
    let after = world.link(port).counters();
    report.frames += count;
    report.counted +=
        (after.frames_foreign + after.frames_forged + after.frames_stale + after.frames_repeated)
            - (before.frames_foreign + before.frames_forged + before.frames_stale + before.frames_repeated);
    report.taken += after.frames_received - before.frames_received;
    report.answers += after.frames_sent - before.frames_sent;
    let messages =
        |counters: &crate::link::LinkCounters| counters.commands_received + counters.states_received;
    report.delivered += messages(after) - messages(&before);
}

fn draw(captured: &[Bytes], random: &mut fastrand::Rng) -> Bytes {
    let mut frame = captured[random.usize(..captured.len())].to_vec();
    match random.u8(0..6) {
        // Noise, of any version.
        0 => frame = (0..random.usize(0..300)).map(|_| random.u8(..)).collect(),
        // Noise behind a good head.
        1 => frame.iter_mut().skip(4).for_each(|byte| *byte = random.u8(..)),
        2 => frame.truncate(random.usize(..=frame.len().saturating_sub(1))),
        3 => frame.extend((0..random.usize(1..100)).map(|_| random.u8(..))),
        // One bit.
        4 if !frame.is_empty() => {
            let place = random.usize(..frame.len());
            frame[place] ^= 1 << random.u8(0..8);
        }
        // Once more as it was.
        _ => {}
    }
    frame.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hostile_frames_are_counted_and_neither_taken_nor_answered() {
        let report = hostile(20_000, 7);
        let HostileReport { frames, counted, taken, answers, delivered } = report;
        assert_eq!((frames, taken, answers, delivered), (20_000, 0, 0, 0), "{report:?}");
        assert_eq!(counted, frames, "{report:?}");
    }
}
