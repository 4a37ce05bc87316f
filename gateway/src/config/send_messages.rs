//! `kind = "send-messages"`: LMCP messages from XML files, at their times.

use super::bridge::in_range;
use super::error::Fault;
use super::schema;
use super::service::named_service;
use aldis_envelope::lmcp::{self, read_xml};
use aldis_envelope::{Name, Prefix, ServiceId};
use aldis_services::player::{Scheduled, Start};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A message file of a user is small; a longer one is a mistake.
const FILE_BYTES_MAX: u64 = 64 << 20;

/// Sends LMCP messages from XML files: at their times, after other messages, once or again and again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SendMessages {
    /// The service id, 100 or more, unique on the node.
    #[schemars(with = "schema::NamedServiceId")]
    pub(crate) service: ServiceId,
    /// Where the files are. Default: beside the configuration.
    #[serde(default)]
    pub(crate) directory: PathBuf,
    /// The messages.
    pub(crate) messages: Vec<PlannedMessage>,
    /// What the files hold, once they are read.
    #[serde(skip)]
    pub(crate) scheduled: Vec<Scheduled>,
}

/// One file and its times.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct PlannedMessage {
    /// An XML file with one or more LMCP messages.
    pub(crate) file: PathBuf,
    /// How long after the start, or after the message that it waits for, it goes out, in milliseconds. Default: 0.
    #[serde(default)]
    pub(crate) time_ms: u64,
    /// Wait for the first message to an address that begins so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<schema::Prefix>")]
    pub(crate) after: Option<Prefix>,
    /// Send it again after so many milliseconds. Default: once only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 86_400_000))]
    pub(crate) period_ms: Option<u64>,
    /// How often it goes out in all. Default: without end where there is a period.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1))]
    pub(crate) times: Option<u32>,
}

impl SendMessages {
    /// Checks what the types do not.
    pub(super) fn check(self) -> Result<Self, Fault> {
        named_service(self.service)?;
        for (index, message) in self.messages.iter().enumerate() {
            let below = |fault: Fault| fault.below(&format!("messages.{index}"));
            if let Some(period) = message.period_ms {
                in_range("period_ms", period, 1..=86_400_000, "milliseconds").map_err(below)?;
            }
            if let Some(times) = message.times {
                in_range("times", times, 1..=u32::MAX, "times").map_err(below)?;
            }
        }
        Ok(self)
    }

    /// Reads the files; their directory is taken from that of the configuration.
    pub(super) fn read(&mut self, base: &Path) -> Result<(), Fault> {
        for (index, planned) in self.messages.iter().enumerate() {
            let file = base.join(&self.directory).join(&planned.file);
            let fault = |why: String, cure: &str| {
                let message = format!("{}: {why}", file.display());
                Fault::new(format!("messages.{index}.file"), message, cure.to_owned())
            };
            let is_small = std::fs::metadata(&file)
                .map_err(|why| fault(why.to_string(), "give the name of a readable file in `directory`"))?
                .len()
                <= FILE_BYTES_MAX;
            if !is_small {
                return Err(fault(
                    "the file is longer than 64 MiB".into(),
                    "give a file with a few messages",
                ));
            }
            let bytes = std::fs::read(&file)
                .map_err(|why| fault(why.to_string(), "give the name of a readable file in `directory`"))?;
            let document = read_xml(&bytes)
                .map_err(|why| fault(why.to_string(), "`aldis lmcp verify` says more about the file"))?;
            if document.objects.is_empty() {
                return Err(fault(
                    "no LMCP message is in it".into(),
                    "a message is an element with the attribute `Series` and a known type",
                ));
            }
            for placed in document.objects {
                let encoded = lmcp::encode(placed.object.as_ref());
                let content = encoded.map_err(|why| fault(why.to_string(), "shorten the message"))?;
                let name = Name::new(placed.object.type_info().full_name);
                let descriptor = name.map_err(|why| fault(why.to_string(), "name a known type"))?;
                self.scheduled.push(planned.scheduled(descriptor, content));
            }
        }
        Ok(())
    }
}

impl PlannedMessage {
    fn scheduled(&self, descriptor: Name, content: Vec<u8>) -> Scheduled {
        let delay = Duration::from_millis(self.time_ms);
        Scheduled {
            start: match &self.after {
                None => Start::At(delay),
                Some(prefix) => Start::After(prefix.clone(), delay),
            },
            period: self.period_ms.map(Duration::from_millis),
            times: self.times,
            descriptor,
            content: content.into(),
        }
    }
}
