//! The quality of service of a bridge's own endpoints (umaa-so, Quality of service; dds, What bites 6).

use super::config::DomainConfig;
use crate::dds::Pattern;
use crate::service::domain::{Durable, Endpoint, Quality, Xcdr};

/// How many samples of an instance a writer keeps where all are wanted: what kits of UMAA vendors take.
const KEPT_MAX: u32 = 500;

/// What the patterns of UMAA and the configuration say of a topic.
fn of_topic(config: &DomainConfig, topic: &str) -> Quality {
    let pattern = Pattern::of(topic);
    let mut quality = Quality {
        reliable: true,
        durable: Durable::TransientLocal,
        keep_last: Some(1),
        samples_max: None,
        exclusive: false,
        access: 1,
        ordered: true,
        by_source_time: true,
        deadline_ms: None,
        partitions: if config.partition.is_empty() { Vec::new() } else { vec![config.partition.clone()] },
        autodispose: false,
        xcdr: Vec::new(),
    };
    if matches!(pattern, Some(Pattern::Status | Pattern::Log | Pattern::Element)) {
        quality.keep_last = None;
    }
    if pattern == Some(Pattern::Log) {
        quality.durable = Durable::Volatile;
    }
    if let Some(rule) = config.rules.iter().find(|rule| rule.topics.matches(topic)) {
        rule.apply(&mut quality);
    }
    quality
}

/// What a reader of ours requests: no more than those offer whom it hears.
pub(super) fn request(config: &DomainConfig, topic: &str, writers: &[&Endpoint]) -> Quality {
    let mut quality = of_topic(config, topic);
    let offered = || writers.iter().map(|endpoint| &endpoint.quality);
    quality.reliable &= offered().all(|offer| offer.reliable);
    let durable = offered().map(|offer| offer.durable).min().unwrap_or_default();
    quality.durable = durable.min(Durable::TransientLocal).min(quality.durable);
    quality.access = 0;
    quality.ordered = false;
    quality.by_source_time = false;
    quality.exclusive = offered().any(|offer| offer.exclusive);
    quality.keep_last = None;
    quality
}

/// What a writer of ours offers: the strongest, and what must be equal as those have it who hear it.
pub(super) fn offer(config: &DomainConfig, topic: &str, readers: &[&Endpoint], xcdr: Xcdr) -> Quality {
    let mut quality = of_topic(config, topic);
    quality.keep_last = Some(quality.keep_last.unwrap_or(KEPT_MAX));
    quality.exclusive = readers.iter().any(|endpoint| endpoint.quality.exclusive);
    quality.deadline_ms = readers.iter().filter_map(|endpoint| endpoint.quality.deadline_ms).min();
    quality.xcdr = vec![xcdr];
    quality
}

/// In words, as DDS names it.
pub fn text(quality: &Quality) -> String {
    let mut words = vec![
        if quality.reliable { "RELIABLE" } else { "BEST_EFFORT" }.to_owned(),
        match quality.durable {
            Durable::Volatile => "VOLATILE",
            Durable::TransientLocal => "TRANSIENT_LOCAL",
            Durable::Transient => "TRANSIENT",
            Durable::Persistent => "PERSISTENT",
        }
        .to_owned(),
        quality.keep_last.map_or_else(|| "KEEP_ALL".to_owned(), |count| format!("KEEP_LAST {count}")),
    ];
    if quality.exclusive {
        words.push("EXCLUSIVE".into());
    }
    if quality.access > 0 {
        let order = if quality.ordered { " ordered" } else { "" };
        words.push(format!("{}{order}", if quality.access == 1 { "TOPIC" } else { "GROUP" }));
    }
    if quality.by_source_time {
        words.push("BY_SOURCE_TIMESTAMP".into());
    }
    words.extend(quality.deadline_ms.map(|deadline| format!("DEADLINE {deadline} ms")));
    if !quality.xcdr.is_empty() {
        let version = |xcdr: &Xcdr| if *xcdr == Xcdr::V1 { "XCDR1" } else { "XCDR2" };
        words.push(quality.xcdr.iter().map(version).collect::<Vec<_>>().join("+"));
    }
    words.join(" ")
}
