//! A sending and a receiving connection, and the frames between them.

use super::super::exit::Failure;
use aldis_envelope::codec::{stream, zmtp};
use aldis_envelope::lmcp::{self, Ref, cmasi};
use aldis_envelope::{ContentType, Dialect, EntityId, Label, Name, ServiceId, Source};
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The size of a message's content: that of the AirVehicleState in the measurements of OpenUxAS.
const CONTENT_BYTES: usize = 255;
/// Frames a write.
const FRAMES: usize = 4;
/// How long a connection or a message may take.
const PATIENCE: Duration = Duration::from_secs(20);

pub(super) fn failed<E: std::fmt::Display>(what: &'static str) -> impl Fn(E) -> Failure {
    move |why| Failure::Failed(format!("{what}: {why}"))
}

/// One frame, and as many as go into one write.
pub(super) struct Frames {
    one: Vec<u8>,
    write: Vec<u8>,
}

impl Frames {
    /// Frames of the stream form.
    pub(super) fn stream() -> Result<Self, Failure> {
        Self::written(|label, content, out| {
            stream::Writer::new(Dialect::OpenUxas).write(label, content, out);
        })
    }

    /// Messages of ZeroMQ.
    pub(super) fn zeromq(framing: zmtp::Framing) -> Result<Self, Failure> {
        Self::written(|label, content, out| {
            zmtp::Writer::new(framing, Dialect::OpenUxas).write(label, content, None, out);
        })
    }

    fn written(write: impl Fn(&Arc<Label>, &[u8], &mut Vec<u8>)) -> Result<Self, Failure> {
        let name = Name::new("afrl.cmasi.AirVehicleState").map_err(failed("name"))?;
        let entity = EntityId::new(400).map_err(failed("id"))?;
        let source = Source::new(entity, ServiceId::new(37).map_err(failed("id"))?);
        let label = Arc::new(Label::broadcast(ContentType::Lmcp, name, source));
        let mut one = Vec::new();
        write(&label, &state()?, &mut one);
        let write = one.repeat(FRAMES);
        Ok(Self { one, write })
    }

    pub(super) fn content_bytes(&self) -> usize {
        CONTENT_BYTES
    }

    /// How many frames begin what was received, checked byte by byte.
    fn count(&self, received: &[u8], at: &mut usize) -> Result<u64, Failure> {
        let mut frames = 0;
        let mut rest = received;
        while !rest.is_empty() {
            let wanted = &self.one[*at..];
            let length = wanted.len().min(rest.len());
            if wanted[..length] != rest[..length] {
                return Err(Failure::Failed("a frame came out altered".into()));
            }
            *at += length;
            rest = &rest[length..];
            if *at == self.one.len() {
                *at = 0;
                frames += 1;
            }
        }
        Ok(frames)
    }
}

/// An AirVehicleState whose info fills it up to the size.
fn state() -> Result<Vec<u8>, Failure> {
    let with_info = |length: usize| {
        let location = cmasi::Location3D { latitude: 45.3, longitude: -120.9, ..Default::default() };
        let fill = cmasi::KeyValuePair { key: "fill".into(), value: "x".repeat(length).into() };
        let base = cmasi::EntityState {
            id: 400,
            location: Ref::new(location),
            info: vec![Ref::new(fill)],
            ..Default::default()
        };
        let state = cmasi::AirVehicleState { base, ..Default::default() };
        lmcp::encode(&state).map_err(failed("the message"))
    };
    let missing = CONTENT_BYTES.saturating_sub(with_info(0)?.len());
    with_info(missing)
}

/// A connection that sends and one that receives.
pub(super) struct Pair {
    sending: TcpStream,
    receiving: TcpStream,
    buffer: Vec<u8>,
    at: usize,
}

impl Pair {
    /// Connects both, and waits until a message passes.
    pub(super) fn connect(to: u16, from: u16, frames: &Frames) -> Result<Self, Failure> {
        Self::over(connect(to)?, connect(from)?, frames)
    }

    /// Takes two connections, and waits until a message passes.
    pub(super) fn over(sending: TcpStream, receiving: TcpStream, frames: &Frames) -> Result<Self, Failure> {
        let mut pair = Self { sending, receiving, buffer: vec![0; 256 * 1024], at: 0 };
        let until = Instant::now() + PATIENCE;
        let mut sent = 0;
        pair.receiving.set_read_timeout(Some(Duration::from_millis(100))).map_err(failed("socket"))?;
        while Instant::now() < until {
            pair.sending.write_all(&frames.one).map_err(failed("send"))?;
            sent += 1;
            let seen = pair.receive(frames, sent)?;
            if seen > 0 {
                pair.receiving.set_read_timeout(Some(PATIENCE)).map_err(failed("socket"))?;
                return Ok(pair);
            }
        }
        Err(Failure::Failed("no message passes within 20 s".into()))
    }

    /// Sends messages as fast as they go, and receives them: how long it took, and how many came.
    pub(super) fn load(&mut self, frames: &Frames, messages: u64) -> Result<(Duration, u64), Failure> {
        let mut sending = self.sending.try_clone().map_err(failed("socket"))?;
        let start = Instant::now();
        std::thread::scope(|scope| {
            let sender = scope.spawn(move || {
                (0..messages / FRAMES as u64).try_for_each(|_| sending.write_all(&frames.write))
            });
            let seen = self.receive(frames, messages / FRAMES as u64 * FRAMES as u64)?;
            let took = start.elapsed();
            match sender.join() {
                Ok(Ok(())) => Ok((took, seen + messages % FRAMES as u64)),
                Ok(Err(why)) => Err(failed("send")(why)),
                Err(_) => Err(Failure::Failed("the sender panicked".into())),
            }
        })
    }

    /// Sends one message after the other, each when the former came.
    pub(super) fn round_trips(&mut self, frames: &Frames, count: u64) -> Result<Vec<Duration>, Failure> {
        let mut trips = Vec::new();
        for _ in 0..count {
            let start = Instant::now();
            self.sending.write_all(&frames.one).map_err(failed("send"))?;
            if self.receive(frames, 1)? == 0 {
                return Err(Failure::Failed("a message did not come within 20 s".into()));
            }
            trips.push(start.elapsed());
        }
        Ok(trips)
    }

    /// Receives until so many frames came, or none comes for long.
    fn receive(&mut self, frames: &Frames, wanted: u64) -> Result<u64, Failure> {
        let mut seen = 0;
        while seen < wanted {
            match self.receiving.read(&mut self.buffer) {
                Ok(0) => return Err(Failure::Failed("the connection was closed".into())),
                Ok(count) => seen += frames.count(&self.buffer[..count], &mut self.at)?,
                Err(why) if matches!(why.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => break,
                Err(why) => return Err(failed("receive")(why)),
            }
        }
        Ok(seen)
    }
}

/// Connects to a process that may not have begun to listen yet.
pub(super) fn connect(port: u16) -> Result<TcpStream, Failure> {
    let until = Instant::now() + PATIENCE;
    loop {
        match TcpStream::connect(("127.0.0.1", port)) {
            Ok(stream) => {
                stream.set_nodelay(true).map_err(failed("socket"))?;
                return Ok(stream);
            }
            Err(why) if Instant::now() > until => return Err(failed("connect")(why)),
            // Nothing tells when a process of ours has begun to listen but trying.
            Err(_) => std::thread::park_timeout(Duration::from_millis(20)),
        }
    }
}
