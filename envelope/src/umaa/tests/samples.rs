//! Samples of every topic for property tests, and two large collections of topics that nobody defines.

use crate::umaa::*;
use crate::{DateTime, Guid};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use proptest::sample::select;

/// An attribute that is a large set.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tracks;

/// Its element.
#[derive(Debug, Clone, PartialEq, Serialize, serde::Deserialize)]
pub(super) struct Track {
    pub(super) course: u16,
}

impl LargeCollection for Tracks {
    type Element = Track;
    const ELEMENT_NAME: &'static str = "UMAA::SA::TrackReport::TrackReportTypeTracksSetElement";
}

/// An attribute that is a large list.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Waypoints;

/// Its element.
#[derive(Debug, Clone, PartialEq, Serialize, serde::Deserialize)]
pub(super) struct Waypoint {
    pub(super) depth: u8,
}

impl LargeCollection for Waypoints {
    type Element = Waypoint;
    const ELEMENT_NAME: &'static str = "UMAA::MM::RouteReport::RouteReportTypeWaypointsListElement";
}

fn guid() -> impl Strategy<Value = Guid> {
    any::<[u8; 16]>().prop_map(Guid)
}

fn guids() -> impl Strategy<Value = Sequence<Guid, 100>> {
    vec(guid(), 0..5).prop_map(|guids| Sequence::new(guids).unwrap())
}

fn date() -> impl Strategy<Value = DateTime> {
    (any::<i64>(), 0..=999_999_999).prop_map(|(seconds, nanos)| DateTime::new(seconds, nanos).unwrap())
}

fn text() -> impl Strategy<Value = LongDescription> {
    prop_oneof![".{0,12}", Just("no".to_owned())].prop_map(|text| LongDescription::new(text).unwrap())
}

fn size() -> impl Strategy<Value = LargeCollectionSize> {
    (0..=i32::MAX).prop_map(|size| LargeCollectionSize::try_from(size).unwrap())
}

prop_compose! {
    pub(super) fn health_report()(
        code in select(ErrorCode::ALL), severity in select(ErrorCondition::ALL), log_time in date(),
        time_stamp in date(), status in text(), source in guid(), resource_id in guid(),
    ) -> HealthReport {
        HealthReport { code, log_time, severity, status, time_stamp, source, resource_id }
    }
}

prop_compose! {
    pub(super) fn log_report()(
        entry in text(), level in select(LogLevel::ALL), time_stamp in date(), source in guid(),
    ) -> LogReport {
        LogReport { entry, level, time_stamp, source }
    }
}

prop_compose! {
    pub(super) fn command()(
        duration in option::of(0.0..=DurationSeconds::MAX), resource_id in guid(), time_stamp in date(),
        source in guid(), session_id in guid(), destination in guid(),
    ) -> ResourceAllocationCommand {
        let duration = duration.map(|seconds| DurationSeconds::new(seconds).unwrap());
        ResourceAllocationCommand { duration, resource_id, time_stamp, source, session_id, destination }
    }
}

prop_compose! {
    pub(super) fn priority_command()(
        priorities in guids(), resource_id in guid(), time_stamp in date(),
        source in guid(), session_id in guid(), destination in guid(),
    ) -> ResourceAllocationPriorityCommand {
        ResourceAllocationPriorityCommand { priorities, resource_id, time_stamp, source, session_id, destination }
    }
}

pub(super) fn status<C: Command>() -> impl Strategy<Value = CommandStatus<C>> {
    let key = (guid(), guid()).prop_map(|(source, session_id)| SessionKey { source, session_id });
    let told = (date(), key, select(CommandState::ALL), select(CommandStatusReason::ALL), text());
    told.prop_map(|(time_stamp, key, state, reason, log)| {
        CommandStatus::new(time_stamp, key, state, reason, log)
    })
}

pub(super) fn ack<C: Command>(
    command: impl Strategy<Value = C>,
) -> impl Strategy<Value = CommandAckReport<C>> {
    (command, date(), guid(), guid()).prop_map(|(command, time_stamp, source, session_id)| CommandAckReport {
        command,
        time_stamp,
        source,
        session_id,
    })
}

fn control_info() -> impl Strategy<Value = ResourceAllocationControlInfo> {
    let session = (guid(), option::of(date())).prop_map(|(controlling_consumer, end_time)| {
        ResourceAllocationControlSession { controlling_consumer, end_time }
    });
    (option::of(session), guid()).prop_map(|(control_session, resource_id)| ResourceAllocationControlInfo {
        control_session,
        resource_id,
    })
}

prop_compose! {
    pub(super) fn report()(
        control_info in vec(control_info(), 0..5), time_stamp in date(), source in guid(),
    ) -> ResourceAllocationReport {
        ResourceAllocationReport { control_info: Sequence::new(control_info).unwrap(), time_stamp, source }
    }
}

prop_compose! {
    pub(super) fn config_report()(
        resources in vec((guids(), guid()), 0..4), time_stamp in date(), source in guid(),
    ) -> ResourceAllocationConfigReport {
        let definition =
            |(related_sources, resource_id)| ResourceAllocationDefinition { related_sources, resource_id };
        let resources = Sequence::new(resources.into_iter().map(definition).collect()).unwrap();
        ResourceAllocationConfigReport { resources, time_stamp, source }
    }
}

prop_compose! {
    pub(super) fn priority_report()(
        priorities in vec((guids(), guid()), 0..4), time_stamp in date(), source in guid(),
    ) -> ResourceAllocationPriorityReport {
        let info = |(priorities, resource_id)| ResourceAllocationPriorityInfo { priorities, resource_id };
        let priorities = Sequence::new(priorities.into_iter().map(info).collect()).unwrap();
        ResourceAllocationPriorityReport { priorities, time_stamp, source }
    }
}

prop_compose! {
    pub(super) fn set_element()(
        course in any::<u16>(), set_id in guid(), element_id in guid(), element_timestamp in date(),
    ) -> SetElement<Tracks> {
        SetElement { element: Track { course }, set_id, element_id, element_timestamp }
    }
}

prop_compose! {
    pub(super) fn list_element()(
        depth in any::<u8>(), list_id in guid(), element_id in guid(), element_timestamp in date(),
        next_element_id in option::of(guid()),
    ) -> ListElement<Waypoints> {
        ListElement { element: Waypoint { depth }, list_id, element_id, element_timestamp, next_element_id }
    }
}

prop_compose! {
    pub(super) fn set_metadata()(
        set_id in guid(), update_element_id in guid(), update_element_timestamp in option::of(date()), size in size(),
    ) -> LargeSetMetadata {
        LargeSetMetadata { set_id, update_element_id, update_element_timestamp, size }
    }
}

prop_compose! {
    pub(super) fn list_metadata()(
        list_id in guid(), update_element_id in guid(), update_element_timestamp in option::of(date()),
        starting_element_id in guid(), size in size(),
    ) -> LargeListMetadata {
        LargeListMetadata { list_id, update_element_id, update_element_timestamp, starting_element_id, size }
    }
}
