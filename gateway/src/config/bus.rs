//! How a node joins the bus: the `[bus]` table, and its translation for Zenoh.

mod translate;

use super::locator::Locator;
use super::text::PlainName;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
pub(crate) use translate::{BusError, zenoh_config};

/// The `[bus]` table. Files are looked for beside the configuration file, unless their path is absolute.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Bus {
    /// What the node is on the bus. Default: a peer.
    pub(crate) mode: Mode,
    /// Locators on which others may join, such as "tcp/0.0.0.0:7447". Default: none.
    pub(crate) listen: Vec<Locator>,
    /// Locators of others to join; who is absent is tried again with back-off. Default: none.
    pub(crate) connect: Vec<Locator>,
    /// How others are found that are not named in `connect`. Default: not at all.
    pub(crate) scouting: Scouting,
    /// What a stream does when the bus does not take its messages. Default: block.
    pub(crate) congestion: Congestion,
    /// The user that this node is towards others; needs `password_file`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) user: Option<PlainName>,
    /// A file with the password of `user`, and nothing else.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) password_file: Option<PathBuf>,
    /// A file with a line `user:password` for each that may join at `listen`; all others are refused.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) dictionary_file: Option<PathBuf>,
    /// Certificates, for locators that begin with `tls/`.
    pub(crate) tls: Tls,
    /// A Zenoh configuration file (JSON5) whose `access_control` is used, and nothing else of it: what `aldis acl`
    /// printed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) zenoh_config: Option<PathBuf>,
}

impl Bus {
    /// Puts a directory before every relative path.
    pub(super) fn resolve(&mut self, directory: &Path) {
        let tls = &mut self.tls;
        for path in [
            &mut self.password_file,
            &mut self.dictionary_file,
            &mut self.zenoh_config,
            &mut tls.root_ca_certificate,
            &mut tls.listen_certificate,
            &mut tls.listen_private_key,
            &mut tls.connect_certificate,
            &mut tls.connect_private_key,
        ] {
            *path = path.take().map(|relative| directory.join(relative));
        }
    }

    /// Whether the node shows a certificate of its own when it connects.
    pub(crate) fn shows_certificate(&self) -> bool {
        self.tls.enable_mtls && self.tls.connect_certificate.is_some()
    }
}

/// What a node is on the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Mode {
    /// Joined directly to those at `listen` and `connect`. It passes on what its clients send and hear, but nothing
    /// from one peer to another: peers that shall hear each other are joined to each other, or use gossip.
    #[default]
    Peer,
    /// Joined to one router or peer at `connect`, which passes everything on. Opening the bus fails while none of
    /// them answers, and is to be tried again; a bus that was open comes back by itself.
    Client,
    /// Passes messages on between its clients, and checks their rights.
    Router,
}

impl Mode {
    /// The word for it, Zenoh's too.
    pub(crate) fn as_str(self) -> &'static str {
        match self {
            Self::Peer => "peer",
            Self::Client => "client",
            Self::Router => "router",
        }
    }
}

/// How others are found that are not named.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Scouting {
    /// Not at all: who is joined stands in the configuration.
    #[default]
    None,
    /// By what those already joined tell.
    Gossip,
    /// By calling into the local network, and by what those already joined tell.
    Multicast,
}

/// What a stream does when the bus does not take its messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Congestion {
    /// It waits, within bounds: for cables and loopback.
    #[default]
    Block,
    /// It drops what does not fit, and repair asks for it: for radios.
    Drop,
}

/// The `[bus.tls]` table: files in PEM.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Tls {
    /// The authority whose certificates are believed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) root_ca_certificate: Option<PathBuf>,
    /// The certificate shown to those who join at `listen`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) listen_certificate: Option<PathBuf>,
    /// The private key of `listen_certificate`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) listen_private_key: Option<PathBuf>,
    /// The certificate shown to those in `connect`; its common name is the node's `name`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) connect_certificate: Option<PathBuf>,
    /// The private key of `connect_certificate`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) connect_private_key: Option<PathBuf>,
    /// Whether both sides show certificates. Default: no, only those who listen.
    pub(crate) enable_mtls: bool,
    /// Whether the host in a locator must stand in the certificate of who answers there. Default: yes.
    pub(crate) verify_name_on_connect: bool,
}

impl Default for Tls {
    fn default() -> Self {
        Self {
            root_ca_certificate: None,
            listen_certificate: None,
            listen_private_key: None,
            connect_certificate: None,
            connect_private_key: None,
            enable_mtls: false,
            verify_name_on_connect: true,
        }
    }
}
