//! Looks after the disk of the journal, or the one that the program runs on, for the node's health reports.

use super::Shared;
use aldis_services::Event;
use aldis_services::service::{Component, ComponentHealth, Condition};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How often the disk is looked at: disks fill slowly.
const LOOK_EVERY: Duration = Duration::from_secs(10);
/// Below this share of free space somebody should look at it.
const SCARCE: f64 = 0.05;
/// Below this many free bytes nothing that must be kept can be.
const FULL_BYTES: u64 = 16 << 20;

/// Tells the node how the disk of a directory does, whenever that changes.
pub(super) async fn watch(core: Shared, directory: PathBuf) {
    let mut told = None;
    loop {
        let (condition, status) = look(&directory);
        if told != Some(condition) {
            told = Some(condition);
            let health = ComponentHealth { component: Component::Resource("disk"), condition, status };
            core.lock().handle(&mut vec![Event::Component(health)]);
        }
        tokio::time::sleep(LOOK_EVERY).await;
    }
}

fn look(directory: &Path) -> (Condition, String) {
    match rustix::fs::statvfs(directory) {
        Ok(disk) => judge(disk.f_bavail * disk.f_frsize, disk.f_blocks * disk.f_frsize),
        Err(why) => (Condition::Failed, format!("cannot be read: {why}")),
    }
}

fn judge(free: u64, all: u64) -> (Condition, String) {
    let share = if all == 0 { 0.0 } else { free as f64 / all as f64 };
    let status = format!("{} MiB free, {:.0} %", free >> 20, share * 100.0);
    let condition = if free < FULL_BYTES {
        Condition::Failed
    } else if share < SCARCE {
        Condition::Degraded
    } else {
        Condition::Well
    };
    (condition, status)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disk_is_well_scarce_or_full() {
        assert_eq!(judge(50 << 30, 100 << 30), (Condition::Well, "51200 MiB free, 50 %".into()));
        assert_eq!(judge(1 << 30, 100 << 30).0, Condition::Degraded);
        assert_eq!(judge(1 << 20, 2 << 20).0, Condition::Failed);
        assert_eq!(judge(0, 0).0, Condition::Failed);
    }
}
