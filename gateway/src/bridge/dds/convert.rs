//! The words of `aldis_dds` in those of `aldis_services`, and back.

use aldis_dds as dds;
use aldis_envelope::Wall;
use aldis_services::service::domain::{Arrival, DomainGuid, Durable, Endpoint, Quality, Sending, Xcdr};
use std::time::Duration;

pub(super) fn guid(guid: dds::Guid) -> DomainGuid {
    DomainGuid(guid.0)
}

pub(super) fn arrival(arrival: dds::Arrival) -> Arrival {
    Arrival {
        writer: guid(arrival.writer),
        source_time: Wall(arrival.source_timestamp),
        is_sample: arrival.is_sample,
        disposes: arrival.disposes,
        unregisters: arrival.unregisters,
        autodispose: arrival.autodispose,
        cdr: arrival.cdr,
    }
}

pub(super) fn sending(sending: Sending) -> dds::Sending {
    match sending {
        Sending::Sample => dds::Sending::Sample,
        Sending::Dispose => dds::Sending::Dispose,
        Sending::Unregister => dds::Sending::Unregister,
    }
}

pub(super) fn endpoint(found: &dds::Endpoint) -> Endpoint {
    Endpoint {
        guid: guid(found.guid),
        participant: guid(found.participant),
        writes: found.side == dds::Side::Writer,
        topic: found.topic.clone(),
        type_name: found.type_name.clone(),
        quality: quality(&found.qos),
        extensibility: None,
    }
}

fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}

pub(super) fn quality(qos: &dds::Qos) -> Quality {
    Quality {
        reliable: qos.reliable,
        durable: match qos.durability {
            dds::Durability::Volatile => Durable::Volatile,
            dds::Durability::TransientLocal => Durable::TransientLocal,
            dds::Durability::Transient => Durable::Transient,
            dds::Durability::Persistent => Durable::Persistent,
        },
        keep_last: match qos.history {
            dds::History::KeepLast(count) => Some(count),
            dds::History::KeepAll => None,
        },
        samples_max: qos.limits.samples,
        exclusive: qos.exclusive.is_some(),
        access: match qos.presentation.access {
            dds::Access::Instance => 0,
            dds::Access::Topic => 1,
            dds::Access::Group => 2,
        },
        ordered: qos.presentation.ordered,
        by_source_time: qos.by_source_timestamp,
        coherent: qos.presentation.coherent,
        deadline_ns: qos.deadline.map(nanoseconds),
        latency_budget_ns: nanoseconds(qos.latency_budget),
        liveliness: match qos.liveliness.0 {
            dds::Liveliness::Automatic => 0,
            dds::Liveliness::ManualByParticipant => 1,
            dds::Liveliness::ManualByTopic => 2,
        },
        lease_ns: qos.liveliness.1.map(nanoseconds),
        partitions: qos.partitions.clone(),
        autodispose: qos.autodispose,
        xcdr: qos
            .representations
            .iter()
            .map(|r| match r {
                dds::Representation::Xcdr1 => Xcdr::V1,
                dds::Representation::Xcdr2 => Xcdr::V2,
            })
            .collect(),
    }
}

/// The quality of service of an endpoint of ours. A writer keeps what it has not got confirmed, whatever it keeps for others.
pub(super) fn qos(quality: &Quality, writes: bool) -> dds::Qos {
    let kept = quality.keep_last.map_or(dds::History::KeepAll, dds::History::KeepLast);
    dds::Qos {
        reliable: quality.reliable,
        durability: match quality.durable {
            Durable::Volatile => dds::Durability::Volatile,
            Durable::TransientLocal => dds::Durability::TransientLocal,
            Durable::Transient => dds::Durability::Transient,
            Durable::Persistent => dds::Durability::Persistent,
        },
        history: dds::History::KeepAll,
        limits: dds::Limits::default(),
        durability_service: (kept, dds::Limits::default()),
        exclusive: quality.exclusive.then_some(0),
        deadline: quality.deadline_ns.map(Duration::from_nanos),
        latency_budget: Duration::from_nanos(quality.latency_budget_ns),
        liveliness: (
            match quality.liveliness {
                0 => dds::Liveliness::Automatic,
                1 => dds::Liveliness::ManualByParticipant,
                _ => dds::Liveliness::ManualByTopic,
            },
            quality.lease_ns.map(Duration::from_nanos),
        ),
        partitions: quality.partitions.clone(),
        presentation: dds::Presentation {
            access: match quality.access {
                0 => dds::Access::Instance,
                1 => dds::Access::Topic,
                _ => dds::Access::Group,
            },
            coherent: quality.coherent,
            ordered: quality.ordered,
        },
        by_source_timestamp: quality.by_source_time,
        autodispose: quality.autodispose,
        representations: quality
            .xcdr
            .iter()
            .map(|xcdr| match xcdr {
                Xcdr::V1 => dds::Representation::Xcdr1,
                Xcdr::V2 => dds::Representation::Xcdr2,
            })
            .collect(),
        batching: writes,
        ignores_process: true,
    }
}
