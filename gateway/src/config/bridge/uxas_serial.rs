//! `kind = "uxas-serial"`.

use super::super::error::Fault;
use super::common::{Common, bridge_table};
use super::in_range;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// How damage of a frame is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Check {
    /// The sum of the bytes, as OpenUxAS has it: damage of two bytes can cancel out.
    #[default]
    Sum,
    /// A CRC-32 after each frame, in addition: for lines between two nodes of this program.
    Crc,
}

/// A bridge that speaks the UxAS stream form on a serial device.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "UxasSerialTable", into = "UxasSerialTable")]
pub(crate) struct UxasSerial {
    /// What every kind has.
    pub(crate) common: Common,
    /// The device.
    pub(crate) device: PathBuf,
    /// Its speed in bits a second.
    pub(crate) baud: u32,
    /// How damage is found.
    pub(crate) check: Check,
}

bridge_table! {
    /// The table as it is written.
    UxasSerialTable {
        /// The serial device, such as "/dev/ttyUSB0".
        device: PathBuf,
        /// Its speed in bits a second. Default: 57600, that of OpenUxAS.
        #[serde(default = "baud")]
        #[schemars(range(min = 50, max = 4_000_000))]
        baud: u32,
        /// How damage of a frame is found: "sum" as OpenUxAS has it, in which damage of two bytes can cancel out, or "crc",
        /// which both ends must have. Default: sum.
        #[serde(default)]
        check: Check,
    }
}

fn baud() -> u32 {
    57_600
}

impl TryFrom<UxasSerialTable> for UxasSerial {
    type Error = Fault;

    fn try_from(table: UxasSerialTable) -> Result<Self, Fault> {
        in_range("baud", table.baud, 50..=4_000_000, "bits a second")?;
        Ok(Self { common: table.common()?, device: table.device, baud: table.baud, check: table.check })
    }
}

impl From<UxasSerial> for UxasSerialTable {
    fn from(bridge: UxasSerial) -> Self {
        Self::from_common(bridge.common, bridge.device, bridge.baud, bridge.check)
    }
}
