//! The device: opened raw at its speed, again where it vanishes.

use super::Line;
use super::stuffing::{Finder, stuff};
use crate::carrier::Outgoing;
use crate::runtime::Shared;
use aldis_services::{Event, LinkEvent, Place};
use bytes::Bytes;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::OwnedFd;
use rustix::fs::{Mode, OFlags};
use rustix::io::Errno;
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long to wait before a device is opened again that could not be.
const RETRY: Duration = Duration::from_secs(2);
/// How often it is seen whether the node has ended.
const LOOK_EVERY: Duration = Duration::from_millis(200);
/// How many bytes are read at once.
const READ_BYTES: usize = 4_096;
/// There is one place at the other end of a line.
const FAR_END: Place = Place(0);

/// Opens a device for frames: raw, at its speed, without waiting.
pub(super) fn open(line: &Line) -> io::Result<OwnedFd> {
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let device = rustix::fs::open(&line.device, flags, Mode::empty())?;
    let mut settings = tcgetattr(&device)?;
    settings.make_raw();
    settings.set_speed(line.baud)?;
    tcsetattr(&device, OptionalActions::Now, &settings)?;
    Ok(device)
}

struct Writer {
    device: Arc<OwnedFd>,
    /// What the line has not taken yet. A frame that follows it is dropped: half a frame must not be lost.
    rest: Vec<u8>,
}

impl Writer {
    fn push(&mut self) {
        while !self.rest.is_empty() {
            match rustix::io::write(&self.device, &self.rest) {
                Ok(0) | Err(_) => return,
                Ok(written) => drop(self.rest.drain(..written)),
            }
        }
    }
}

impl Outgoing for Writer {
    fn send(&mut self, frame: &[u8]) {
        self.push();
        if self.rest.is_empty() {
            stuff(frame, &mut self.rest);
            self.push();
        }
    }
}

/// Serves a line until the node ends. Blocks its thread: a line is read as it comes, and tokio's way to wait for a device that is
/// no socket is unsafe.
pub(crate) fn serve(core: &Shared, line: &Line) {
    let exited = core.lock().exited();
    let ended = || *exited.borrow();
    while !ended() {
        let why = match open(line) {
            Ok(device) => receive(core, line, Arc::new(device), &ended),
            Err(why) => why,
        };
        let why = format!("serial {}: {why}", line.device.display());
        {
            let mut core = core.lock();
            core.carriers().remove(line.link, line.carrier);
            core.handle(&mut vec![Event::Link(line.link, LinkEvent::Down(line.carrier, why))]);
        }
        let retry = Instant::now() + RETRY;
        while !ended() && Instant::now() < retry {
            std::thread::park_timeout(LOOK_EVERY);
        }
    }
}

fn receive(core: &Shared, line: &Line, device: Arc<OwnedFd>, ended: &impl Fn() -> bool) -> io::Error {
    {
        let mut core = core.lock();
        let writer = Writer { device: device.clone(), rest: Vec::new() };
        core.carriers().set(line.link, line.carrier, Box::new(writer));
        core.handle(&mut vec![Event::Link(line.link, LinkEvent::Up(line.carrier, line.mtu))]);
    }
    let mut finder = Finder::new(line.mtu);
    let mut buffer = [0; READ_BYTES];
    loop {
        if let Err(why) = wait(&device) {
            return why;
        }
        if ended() {
            return io::ErrorKind::Interrupted.into();
        }
        let length = match rustix::io::read(&device, &mut buffer) {
            Ok(0) => return io::ErrorKind::UnexpectedEof.into(),
            Ok(length) => length,
            Err(Errno::AGAIN | Errno::INTR) => continue,
            Err(why) => return why.into(),
        };
        let (frames, bad) = finder.take(&buffer[..length]);
        if bad > 0 {
            tracing::debug!("serial {}: {bad} stretches were no frames", line.device.display());
        }
        let event = |frame| LinkEvent::Frame(line.carrier, FAR_END, Bytes::from(frame));
        let mut events = frames.into_iter().map(|frame| Event::Link(line.link, event(frame))).collect();
        core.lock().handle(&mut events);
    }
}

/// Waits until something can be read, or for a moment.
fn wait(device: &OwnedFd) -> io::Result<()> {
    let limit = Timespec { tv_sec: 0, tv_nsec: LOOK_EVERY.as_nanos() as i64 };
    match poll(&mut [PollFd::new(device, PollFlags::IN)], Some(&limit)) {
        Ok(_) | Err(Errno::INTR) => Ok(()),
        Err(why) => Err(why.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aldis_services::LinkId;
    use aldis_services::link::CarrierId;
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

    #[test]
    fn a_line_passes_every_byte_as_it_is() {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        grantpt(&master).unwrap();
        unlockpt(&master).unwrap();
        let device = ptsname(&master, Vec::new()).unwrap().into_string().unwrap().into();
        let line = Line { link: LinkId(0), carrier: CarrierId(0), device, baud: 57_600, mtu: 256 };
        let slave = open(&line).unwrap();
        // Line ends, end of file, interrupt and flow control are bytes like all others.
        let frame: Vec<u8> = (0..=255).collect();
        let mut stuffed = Vec::new();
        stuff(&frame, &mut stuffed);
        for (from, to) in [(&master, &slave), (&slave, &master)] {
            assert_eq!(rustix::io::write(from, &stuffed).unwrap(), stuffed.len());
            let (mut finder, mut found) = (Finder::new(256), Vec::new());
            let mut buffer = [0; 64];
            while found.is_empty() {
                match rustix::io::read(to, &mut buffer) {
                    Ok(length) => found.extend(finder.take(&buffer[..length]).0),
                    Err(Errno::AGAIN) => std::thread::yield_now(),
                    Err(why) => panic!("{why}"),
                }
            }
            assert_eq!(found, std::slice::from_ref(&frame));
        }
        assert!(open(&Line { device: "/nonexistent".into(), ..line }).is_err());
    }
}
