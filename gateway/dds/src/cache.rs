//! A reader's cache that keeps nothing: what arrives is handed on at once, in its order.
//!
//! Cyclone's own cache groups samples by instance, and a dispose after a sample that was not taken yet is seen in that sample's
//! state alone. Here every change comes by itself, as its writer sent it, with its own source timestamp.

use crate::discovery::{Guid, guid_from_words};
use bytes::Bytes;
use cyclors::*;
use std::os::raw::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// One change of an instance.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Arrival {
    /// Who wrote it.
    pub writer: Guid,
    /// When it was written, by its writer's clock: nanoseconds since 1970.
    pub source_timestamp: i64,
    /// Whether the bytes are a whole sample; otherwise they are its key alone.
    pub is_sample: bool,
    /// Whether it disposes of the instance.
    pub disposes: bool,
    /// Whether the writer unregisters the instance.
    pub unregisters: bool,
    /// Whether the writer wants an instance disposed of that it unregisters or leaves.
    pub autodispose: bool,
    /// The strength of its writer, where ownership is exclusive.
    pub strength: i32,
    /// The bytes as they came, with the representation's head of four bytes, in this machine's byte order.
    pub cdr: Bytes,
}

/// What a reader hands on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Incoming {
    /// A change.
    Change(Arrival),
    /// A writer is gone, with its instances; whether it wants them disposed of.
    WriterGone {
        /// Which one.
        writer: Guid,
        /// Whether it wants its instances disposed of.
        autodispose: bool,
    },
}

/// Who receives what a reader hands on. It is called on Cyclone's threads, in order for each writer, and must not block, and neither
/// make nor drop anything of this crate.
pub trait Receive: Send + Sync {
    /// Takes something. `false` where there is no room: a change then comes again after some milliseconds, and reliable writers are
    /// held up; that a writer is gone is told once.
    fn receive(&self, incoming: Incoming) -> bool;
}

impl<F: Fn(Incoming) -> bool + Send + Sync> Receive for F {
    fn receive(&self, incoming: Incoming) -> bool {
        self(incoming)
    }
}

// The layout of the following is that of `ddsi_rhc.h`, `dds_rhc.h` and `ddsi_tkmap.h` in Cyclone DDS 11.0.1, as cyclors 0.4.0 has
// it; hence the exact version in the manifest. A test exchanges each kind of change.

/// `struct ddsi_writer_info` as far as it is read.
#[repr(C)]
struct WriterInfo {
    guid: [u32; 4],
    auto_dispose: bool,
    ownership_strength: i32,
}

/// `struct dds_rhc_ops`, the operations of `struct ddsi_rhc_ops` first.
#[repr(C)]
struct Operations {
    store: unsafe extern "C" fn(*mut Cache, *const WriterInfo, *mut ddsi_serdata, *mut c_void) -> bool,
    unregister_writer: unsafe extern "C" fn(*mut Cache, *const WriterInfo),
    relinquish_ownership: unsafe extern "C" fn(*mut Cache, u64),
    free: unsafe extern "C" fn(*mut Cache),
    peek: Read,
    read: Read,
    take: Read,
    add_read_condition: unsafe extern "C" fn(*mut Cache, *mut c_void) -> bool,
    remove_read_condition: unsafe extern "C" fn(*mut Cache, *mut c_void),
    associate: unsafe extern "C" fn(*mut Cache, *mut c_void) -> dds_return_t,
}

type Read = unsafe extern "C" fn(*mut Cache, i32, u32, u64, *mut c_void, *mut c_void, *mut c_void) -> i32;

/// `struct dds_rhc`, and behind it what is ours.
#[repr(C)]
pub(crate) struct Cache {
    operations: &'static Operations,
    receiver: Box<dyn Receive>,
}

static OPERATIONS: Operations = Operations {
    store,
    unregister_writer,
    relinquish_ownership,
    free,
    peek: read_nothing,
    read: read_nothing,
    take: read_nothing,
    add_read_condition,
    remove_read_condition,
    associate,
};

impl Cache {
    /// A cache for `dds_create_reader_rhc`, which owns it from then on.
    pub(crate) fn for_reader(receiver: Box<dyn Receive>) -> *mut Self {
        Box::into_raw(Box::new(Self { operations: &OPERATIONS, receiver }))
    }

    /// Takes back a cache that no reader owns.
    ///
    /// # Safety
    /// It came from [`Self::for_reader`], and no reader has it.
    pub(crate) unsafe fn take_back(cache: *mut Self) {
        // SAFETY: the caller vouches for it.
        drop(unsafe { Box::from_raw(cache) });
    }

    /// A panic must not unwind into C: what panicked counts as taken.
    fn hand_on(&self, incoming: Incoming) -> bool {
        catch_unwind(AssertUnwindSafe(|| self.receiver.receive(incoming))).unwrap_or(true)
    }
}

/// # Safety
/// Cyclone DDS calls it with the cache of a living reader, the writer's information and the data, both alive for the call.
unsafe extern "C" fn store(
    cache: *mut Cache,
    writer: *const WriterInfo,
    data: *mut ddsi_serdata,
    _instance: *mut c_void,
) -> bool {
    // SAFETY: as the caller promises. The cache is only read, by any number of threads; its receiver is `Sync`.
    let (cache, writer, head) = unsafe { (&*cache, &*writer, &*data) };
    let is_sample = head.kind == ddsi_serdata_kind_SDK_DATA;
    if !is_sample && head.statusinfo == 0 {
        return true;
    }
    let arrival = Arrival {
        writer: guid_from_words(writer.guid),
        source_timestamp: head.timestamp.v,
        is_sample,
        disposes: head.statusinfo & DISPOSE != 0,
        unregisters: head.statusinfo & UNREGISTER != 0,
        autodispose: writer.auto_dispose,
        strength: writer.ownership_strength,
        // SAFETY: the data is alive for the call.
        cdr: unsafe { bytes_of(data) },
    };
    cache.hand_on(Incoming::Change(arrival))
}

/// DDSI_STATUSINFO_DISPOSE (RTPS 2.5, 9.6.4.9).
pub(crate) const DISPOSE: u32 = 1;
/// DDSI_STATUSINFO_UNREGISTER.
pub(crate) const UNREGISTER: u32 = 2;

/// # Safety
/// The data is alive.
unsafe fn bytes_of(data: *const ddsi_serdata) -> Bytes {
    // SAFETY: the caller vouches for the data. The reference that is taken holds `size` bytes in one piece, which are copied before
    // it is given back.
    unsafe {
        let size = ddsi_serdata_size(data) as usize;
        let mut piece = iovec { iov_base: std::ptr::null_mut(), iov_len: 0 };
        let held = ddsi_serdata_to_ser_ref(data, 0, size, &mut piece);
        let copied = Bytes::copy_from_slice(std::slice::from_raw_parts(piece.iov_base.cast(), piece.iov_len));
        ddsi_serdata_to_ser_unref(held, &piece);
        copied
    }
}

/// # Safety
/// As for [`store`].
unsafe extern "C" fn unregister_writer(cache: *mut Cache, writer: *const WriterInfo) {
    // SAFETY: as for `store`.
    let (cache, writer) = unsafe { (&*cache, &*writer) };
    let autodispose = writer.auto_dispose;
    cache.hand_on(Incoming::WriterGone { writer: guid_from_words(writer.guid), autodispose });
}

unsafe extern "C" fn relinquish_ownership(_: *mut Cache, _: u64) {}

/// # Safety
/// Cyclone DDS calls it once, when the reader is gone and no call to the cache is under way.
unsafe extern "C" fn free(cache: *mut Cache) {
    // SAFETY: the cache came from `for_reader`, and nobody has it any more.
    drop(unsafe { Box::from_raw(cache) });
}

unsafe extern "C" fn read_nothing(
    _: *mut Cache,
    _: i32,
    _: u32,
    _: u64,
    _: *mut c_void,
    _: *mut c_void,
    _: *mut c_void,
) -> i32 {
    0
}

unsafe extern "C" fn add_read_condition(_: *mut Cache, _: *mut c_void) -> bool {
    false
}

unsafe extern "C" fn remove_read_condition(_: *mut Cache, _: *mut c_void) {}

unsafe extern "C" fn associate(_: *mut Cache, _: *mut c_void) -> dds_return_t {
    0
}
