//! Machines that are killed at moments of chance, with torn writes: no accepted command is lost, none is handled twice.

use super::emulator::Profile;
use super::load::command;
use super::world::{LinkWorld, MachineId, Port, What};
use crate::link::{Class, TicketState};
use std::collections::BTreeSet;
use std::time::Duration;

/// What many crashes came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CrashReport {
    /// Crashes.
    pub points: u64,
    /// Of those, with a write on its way.
    pub during_a_write: u64,
    /// Commands that were told as accepted.
    pub accepted: u64,
    /// Accepted, and never handled.
    pub lost: u64,
    /// Handled more than once, by the journal of the service.
    pub twice: u64,
}

/// Kills one end or the other at `points` moments.
pub fn crash(points: u64, seed: u64) -> CrashReport {
    let mut report = CrashReport::default();
    let mut run = 0;
    while report.points < points {
        run += 1;
        one_run(seed.wrapping_mul(1_000_003).wrapping_add(run), points, &mut report);
    }
    report
}

/// Twenty seconds of commands both ways with about ten crashes.
fn one_run(seed: u64, points: u64, report: &mut CrashReport) {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut world = LinkWorld::new(seed);
    // Writes are slow enough to be caught in, and quick enough to be through.
    world.write_time = Duration::from_millis(random.u64(1..80));
    let (shore, vehicle) = (world.machine(1, 0), world.machine(400, 0));
    let profile = Profile {
        rate: 4_000,
        delay: Duration::from_millis(random.u64(1..150)),
        loss: random.f64() * 0.4,
        ..Profile::L1
    };
    let (a, b) = world.join(shore, vehicle, &[profile], &[], |_| {});
    let (mut accepted, mut offered) = (BTreeSet::new(), Vec::new());
    let mut number = 0;
    for _ in 0..200 {
        world.run_for(Duration::from_millis(random.u64(1..200)));
        number += 1;
        for (from, to, port) in [(1, 400, a), (400, 1, b)] {
            let at = world.now().elapsed();
            let envelope = command(from, to, number, at, Duration::from_secs(36_000));
            let content = envelope.message.content.to_vec();
            offered.push((world.offer(port, envelope, Class::Command), content));
        }
        note(&mut world, &mut accepted);
        if report.points < points && random.u64(0..20) == 0 {
            world.run_for(Duration::from_millis(random.u64(0..100)));
            note(&mut world, &mut accepted);
            let victim = if random.bool() { shore } else { vehicle };
            report.points += 1;
            report.during_a_write += u64::from(world.of(victim).disk.pending() > 0);
            world.kill(victim);
            // Sometimes both ends are down.
            let both = random.u64(0..5) == 0;
            let other = MachineId(1 - victim.0);
            if both && report.points < points {
                report.points += 1;
                report.during_a_write += u64::from(world.of(other).disk.pending() > 0);
                world.kill(other);
            }
            world.run_for(Duration::from_millis(random.u64(0..3_000)));
            world.restart(victim);
            if both {
                world.restart(other);
            }
        }
    }
    settle(&mut world, a, b, &mut accepted);
    let handled = [world.handled(shore), world.handled(vehicle)];
    for (ticket, content) in offered {
        let times: u64 = handled.iter().filter_map(|handled| handled.get(&content)).sum();
        report.accepted += u64::from(accepted.contains(&ticket));
        report.lost += u64::from(accepted.contains(&ticket) && times == 0);
        report.twice += u64::from(times > 1);
    }
}

fn note(world: &mut LinkWorld, accepted: &mut BTreeSet<crate::link::Ticket>) {
    for seen in world.take_seen() {
        if let What::Ticket(ticket, TicketState::Accepted { .. }) = seen.what {
            accepted.insert(ticket);
        }
    }
}

/// Until nothing waits, or clearly never will.
fn settle(world: &mut LinkWorld, a: Port, b: Port, accepted: &mut BTreeSet<crate::link::Ticket>) {
    for _ in 0..1_000 {
        world.run_for(Duration::from_secs(1));
        note(world, accepted);
        if world.link(a).waiting().0 + world.link(b).waiting().0 == 0 {
            break;
        }
    }
    world.run_for(Duration::from_secs(5));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_accepted_is_lost_and_nothing_is_handled_twice() {
        let report = crash(20, 5);
        assert_eq!((report.points, report.lost, report.twice), (20, 0, 0), "{report:?}");
        assert!(report.during_a_write > 3 && report.accepted > 300, "{report:?}");
    }

    #[test]
    fn a_journal_that_forgets_is_found_out() {
        // The measure itself: where the disk loses what it acknowledged, commands are lost.
        let mut world = LinkWorld::new(3);
        let (shore, vehicle) = (world.machine(1, 0), world.machine(400, 0));
        let (a, _) = world.join(shore, vehicle, &[Profile::L1], &[], |_| {});
        world.offer(a, command(1, 400, 1, Duration::ZERO, Duration::from_secs(60)), Class::Command);
        world.run_for(Duration::from_millis(100));
        world.kill(shore);
        world.of(shore).disk.wipe();
        world.restart(shore);
        world.run_for(Duration::from_secs(30));
        assert!(world.handled(vehicle).is_empty());
    }
}
