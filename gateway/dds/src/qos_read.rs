//! Quality of service as discovery tells it.

use crate::qos::{Access, Durability, History, Limits, Liveliness, Presentation, Qos, Representation};
use cyclors::*;
use std::ffi::{CStr, c_char};
use std::time::Duration;

/// A bound that C writes as a negative number where there is none.
fn bound(length: i32) -> Option<u32> {
    u32::try_from(length).ok()
}

/// A duration that C writes as its highest number where it has no end.
fn duration(nanoseconds: i64) -> Option<Duration> {
    (nanoseconds < i64::MAX).then(|| Duration::from_nanos(nanoseconds.max(0) as u64))
}

fn history(kind: dds_history_kind_t, depth: i32) -> History {
    if kind == dds_history_kind_DDS_HISTORY_KEEP_ALL {
        History::KeepAll
    } else {
        History::KeepLast(bound(depth).unwrap_or(1))
    }
}

impl Qos {
    /// What an endpoint says. What it does not say is the default of DDS.
    ///
    /// # Safety
    /// The pointer is null, or points at a quality of service that is alive.
    pub(crate) unsafe fn read(qos: *const dds_qos_t) -> Self {
        let mut read = Self { representations: vec![Representation::Xcdr1], ..Self::default() };
        if qos.is_null() {
            return read;
        }
        let (mut kind, mut number, mut time) = (0, 0, 0);
        let (mut flag, mut second) = (false, false);
        // SAFETY: the caller vouches for `qos`; the getters write numbers to places that live on this stack, and only where they
        // return true.
        unsafe {
            if dds_qget_reliability(qos, &mut kind, &mut time) {
                read.reliable = kind == dds_reliability_kind_DDS_RELIABILITY_RELIABLE;
            }
            if dds_qget_durability(qos, &mut kind) {
                read.durability = match kind {
                    dds_durability_kind_DDS_DURABILITY_VOLATILE => Durability::Volatile,
                    dds_durability_kind_DDS_DURABILITY_TRANSIENT_LOCAL => Durability::TransientLocal,
                    dds_durability_kind_DDS_DURABILITY_TRANSIENT => Durability::Transient,
                    _ => Durability::Persistent,
                };
            }
            if dds_qget_history(qos, &mut kind, &mut number) {
                read.history = history(kind, number);
            }
            let (mut samples, mut instances, mut each) = (-1, -1, -1);
            let limits = |samples, instances, each| Limits {
                samples: bound(samples),
                instances: bound(instances),
                samples_per_instance: bound(each),
            };
            if dds_qget_resource_limits(qos, &mut samples, &mut instances, &mut each) {
                read.limits = limits(samples, instances, each);
            }
            if dds_qget_durability_service(
                qos,
                &mut time,
                &mut kind,
                &mut number,
                &mut samples,
                &mut instances,
                &mut each,
            ) {
                read.durability_service = (history(kind, number), limits(samples, instances, each));
            }
            if dds_qget_ownership(qos, &mut kind) && kind == dds_ownership_kind_DDS_OWNERSHIP_EXCLUSIVE {
                number = 0;
                dds_qget_ownership_strength(qos, &mut number);
                read.exclusive = Some(number);
            }
            if dds_qget_deadline(qos, &mut time) {
                read.deadline = duration(time);
            }
            if dds_qget_latency_budget(qos, &mut time) {
                read.latency_budget = duration(time).unwrap_or(Duration::MAX);
            }
            if dds_qget_liveliness(qos, &mut kind, &mut time) {
                let by = match kind {
                    dds_liveliness_kind_DDS_LIVELINESS_AUTOMATIC => Liveliness::Automatic,
                    dds_liveliness_kind_DDS_LIVELINESS_MANUAL_BY_PARTICIPANT => {
                        Liveliness::ManualByParticipant
                    }
                    _ => Liveliness::ManualByTopic,
                };
                read.liveliness = (by, duration(time));
            }
            if dds_qget_presentation(qos, &mut kind, &mut flag, &mut second) {
                let access = match kind {
                    dds_presentation_access_scope_kind_DDS_PRESENTATION_INSTANCE => Access::Instance,
                    dds_presentation_access_scope_kind_DDS_PRESENTATION_TOPIC => Access::Topic,
                    _ => Access::Group,
                };
                read.presentation = Presentation { access, coherent: flag, ordered: second };
            }
            if dds_qget_destination_order(qos, &mut kind) {
                read.by_source_timestamp =
                    kind == dds_destination_order_kind_DDS_DESTINATIONORDER_BY_SOURCE_TIMESTAMP;
            }
            if dds_qget_writer_data_lifecycle(qos, &mut flag) {
                read.autodispose = flag;
            }
            read.partitions = partitions(qos);
            if let Some(representations) = representations(qos) {
                read.representations = representations;
            }
        }
        read
    }
}

/// # Safety
/// The pointer points at a quality of service that is alive.
unsafe fn partitions(qos: *const dds_qos_t) -> Vec<String> {
    let (mut count, mut names): (u32, *mut *mut c_char) = (0, std::ptr::null_mut());
    let mut read = Vec::new();
    // SAFETY: the getter allocates an array of `count` texts with terminators, which belong to the caller: each is read, then
    // freed with the allocator that made it, then the array is.
    unsafe {
        if dds_qget_partition(qos, &mut count, &mut names) && !names.is_null() {
            for place in 0..count as usize {
                let name = *names.add(place);
                read.push(CStr::from_ptr(name).to_string_lossy().into_owned());
                dds_free(name.cast());
            }
            dds_free(names.cast());
        }
    }
    read.retain(|name| !name.is_empty());
    read
}

/// # Safety
/// The pointer points at a quality of service that is alive.
unsafe fn representations(qos: *const dds_qos_t) -> Option<Vec<Representation>> {
    let (mut count, mut ids): (u32, *mut i16) = (0, std::ptr::null_mut());
    // SAFETY: the getter allocates an array of `count` numbers, which belongs to the caller and is freed here.
    unsafe {
        if !dds_qget_data_representation(qos, &mut count, &mut ids) || ids.is_null() {
            return None;
        }
        let all = std::slice::from_raw_parts(ids, count as usize).to_vec();
        dds_free(ids.cast());
        let known = |id: i16| match u32::try_from(id) {
            Ok(DDS_DATA_REPRESENTATION_XCDR1) => Some(Representation::Xcdr1),
            Ok(DDS_DATA_REPRESENTATION_XCDR2) => Some(Representation::Xcdr2),
            _ => None,
        };
        Some(all.into_iter().filter_map(known).collect())
    }
}
