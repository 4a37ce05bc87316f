//! The UxAS stream form on a serial device.

use super::connection::{Patience, tell};
use super::peers::Sink;
use super::stream::{self, Limits, Port};
use crate::runtime::Shared;
use aldis_services::{BridgeEvent, BridgeId};
use bytes::BytesMut;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::OwnedFd;
use rustix::fs::{Mode, OFlags};
use rustix::io::Errno;
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tokio::sync::watch;

/// How much is read at once: more than a line holds back.
const READ_BYTES: usize = 4_096;
/// How long a thread waits at once: a node that ends waits for it no longer.
const WAIT_AT_ONCE: Timespec = Timespec { tv_sec: 0, tv_nsec: 200_000_000 };

/// Which device, how fast, and how it is read and written.
#[derive(Debug, Clone)]
pub(crate) struct Endpoint {
    pub(crate) device: PathBuf,
    pub(crate) baud: u32,
    pub(crate) limits: Limits,
}

/// An open device.
struct Device(Arc<OwnedFd>);

impl Device {
    /// Opens a device raw, at its speed, without waiting.
    fn open(path: &Path, baud: u32) -> io::Result<Self> {
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let device = rustix::fs::open(path, flags, Mode::empty())?;
        let mut settings = tcgetattr(&device)?;
        settings.make_raw();
        settings.set_speed(baud)?;
        tcsetattr(&device, OptionalActions::Now, &settings)?;
        Ok(Self(Arc::new(device)))
    }
}

impl Device {
    /// Waits for the device on a thread that may block: tokio's own way to wait for what is no socket is unsafe.
    async fn wait(&self, what: PollFlags) -> io::Result<()> {
        loop {
            let device = self.0.clone();
            let poll = move || -> io::Result<bool> {
                match poll(&mut [PollFd::new(&*device, what)], Some(&WAIT_AT_ONCE)) {
                    Ok(ready) => Ok(ready > 0),
                    Err(Errno::INTR) => Ok(false),
                    Err(why) => Err(why.into()),
                }
            };
            if tokio::task::spawn_blocking(poll).await.map_err(io::Error::other)?? {
                return Ok(());
            }
        }
    }
}

impl Sink for Device {
    fn try_write(&self, bytes: &[u8]) -> io::Result<usize> {
        Ok(rustix::io::write(&*self.0, bytes)?)
    }
}

impl Port for Device {
    async fn readable(&self) -> io::Result<()> {
        self.wait(PollFlags::IN).await
    }
    async fn writable(&self) -> io::Result<()> {
        self.wait(PollFlags::OUT).await
    }
    fn try_read(&self, buffer: &mut BytesMut) -> io::Result<usize> {
        let mut piece = [0; READ_BYTES];
        let count = rustix::io::read(&*self.0, &mut piece)?;
        buffer.extend_from_slice(&piece[..count]);
        Ok(count)
    }
}

/// Runs a bridge for the life of its node; a device that vanishes is opened again.
pub(crate) async fn serve(core: Shared, bridge: BridgeId, endpoint: Endpoint, paused: watch::Receiver<bool>) {
    let Endpoint { device: path, baud, limits } = endpoint;
    let name = path.display().to_string();
    let mut patience = Patience::new();
    loop {
        match Device::open(&path, baud) {
            Ok(device) => {
                tell(&core, bridge, BridgeEvent::Working(format!("on {name} at {baud} baud")));
                let peer = (device, name.clone());
                let why = stream::run(core.clone(), bridge, peer, limits, paused.clone()).await;
                patience.after(&core, bridge, format!("{name}: {why}")).await;
            }
            Err(why) => patience.after(&core, bridge, format!("cannot open {name}: {why}")).await,
        }
    }
}
