//! Where a node listens on the bus or connects to: Zenoh's locators, restricted to the transports that are built in.

use super::cure::{cured, nearest};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;
use zenoh::config::EndPoint;

/// The transports that are built in.
const TRANSPORTS: &[&str] = &["tcp", "udp", "tls", "unixsock-stream"];
const EXAMPLE: &str = "write transport/host:port, such as \"tcp/127.0.0.1:7447\"";

/// A Zenoh locator: `tcp/host:port`, `udp/host:port`, `tls/host:port` or `unixsock-stream/path`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(extend("pattern" = "^(tcp|udp|tls|unixsock-stream)/.+$"))]
pub(crate) struct Locator(String);

impl Locator {
    /// A locator from its text.
    ///
    /// # Errors
    /// What is wrong and the cure, in two lines.
    pub(crate) fn new(text: &str) -> Result<Self, String> {
        let endpoint: EndPoint =
            text.parse().map_err(|_| cured(format_args!("`{text}` is not a locator"), EXAMPLE))?;
        let (protocol, address) = (endpoint.protocol(), endpoint.address());
        let (protocol, address) = (protocol.as_str(), address.as_str());
        if !TRANSPORTS.contains(&protocol) {
            let cure = match nearest(protocol, TRANSPORTS.iter().copied()) {
                Some(near) => format!("did you mean \"{near}/{address}\"?"),
                None => format!("built in are {}", TRANSPORTS.join(", ")),
            };
            return Err(cured(format_args!("transport `{protocol}` is not built in"), &cure));
        }
        let host_and_port = address.rsplit_once(':').filter(|(host, _)| !host.is_empty());
        let port = host_and_port.and_then(|(_, port)| port.parse::<u16>().ok());
        if protocol != "unixsock-stream" && port.is_none() {
            return Err(cured(format_args!("`{address}` lacks a host or a port from 0 to 65535"), EXAMPLE));
        }
        Ok(Self(text.to_owned()))
    }

    /// The text.
    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }

    /// Whether the transport is encrypted.
    pub(crate) fn is_tls(&self) -> bool {
        self.0.starts_with("tls/")
    }
}

impl TryFrom<String> for Locator {
    type Error = String;
    fn try_from(text: String) -> Result<Self, String> {
        Self::new(&text)
    }
}

impl From<Locator> for String {
    fn from(locator: Locator) -> String {
        locator.0
    }
}

impl fmt::Display for Locator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn locators_are_those_that_zenoh_reads_and_that_are_built_in() {
        for text in [
            "tcp/127.0.0.1:7447",
            "tcp/[::]:7447",
            "udp/shore.lan:1",
            "tls/a:7447",
            "unixsock-stream//run/a.sock",
        ] {
            assert!(Locator::new(text).is_ok(), "{text}");
        }
        for text in ["127.0.0.1:7447", "tcp/127.0.0.1", "tcp/:7447", "tcp/a:70000", "quic/a:1", ""] {
            assert!(Locator::new(text).is_err(), "{text}");
        }
        assert!(Locator::new("tpc/a:1").unwrap_err().ends_with("did you mean \"tcp/a:1\"?"));
    }
}
