//! Frames over a serial device.
//!
//! A serial line has no datagrams: a frame is stuffed by the rule of COBS, so that no byte of it is zero, and a zero follows. A check
//! sum of 32 bits is its end, because a line without keys may turn bits over.
//!
//! ```text
//! cobs( frame | CRC-32, little-endian ) 00
//! ```

mod device;
mod stuffing;

pub(crate) use device::serve;

use aldis_services::LinkId;
use aldis_services::link::CarrierId;
use std::path::PathBuf;

/// A carrier on a serial device.
#[derive(Debug, Clone)]
pub(crate) struct Line {
    pub(crate) link: LinkId,
    pub(crate) carrier: CarrierId,
    pub(crate) device: PathBuf,
    pub(crate) baud: u32,
    pub(crate) mtu: usize,
}
