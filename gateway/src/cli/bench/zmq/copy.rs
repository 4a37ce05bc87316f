//! A bare forwarder of ZeroMQ in one process: what comes at PULL goes to all that subscribed. It looks into no message.

use super::super::super::exit::Failure;
use aldis_envelope::codec::zmtp::{GREETING, Item, Reader, SocketType, ready};
use std::cell::RefCell;
use std::rc::Rc;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::tcp::OwnedWriteHalf;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::LocalSet;

/// The bare forwarder of `bench zmq`.
#[derive(clap::Args)]
pub(in super::super) struct ZmqCopy {
    pull: u16,
    publish: u16,
}

type Subscribers = Rc<RefCell<Vec<Rc<tokio::sync::Mutex<OwnedWriteHalf>>>>>;

/// How much is read at once, and the largest message.
const READ_BYTES: usize = 64 * 1024;

impl ZmqCopy {
    pub(in super::super) fn run(self) -> Result<(), Failure> {
        let failed = |why: std::io::Error| Failure::Failed(why.to_string());
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(failed)?;
        LocalSet::new().block_on(&runtime, self.serve()).map_err(failed)
    }

    async fn serve(self) -> std::io::Result<()> {
        let pull = TcpListener::bind(("127.0.0.1", self.pull)).await?;
        let publish = TcpListener::bind(("127.0.0.1", self.publish)).await?;
        let subscribers = Subscribers::default();
        loop {
            tokio::select! {
                from = pull.accept() => {
                    tokio::task::spawn_local(take(from?.0, subscribers.clone()));
                }
                to = publish.accept() => {
                    tokio::task::spawn_local(subscribe(to?.0, subscribers.clone()));
                }
            }
        }
    }
}

/// Greets, and reads until something comes that is not part of the handshake.
async fn handshake(stream: &mut TcpStream, socket: SocketType, reader: &mut Reader) -> Option<()> {
    // Without this the forwarder would wait for acknowledgements, and every comparison would be too good.
    stream.set_nodelay(true).ok()?;
    stream.write_all(&GREETING).await.ok()?;
    loop {
        match reader.next_item().ok()? {
            Some(Item::Greeted) => stream.write_all(&ready(socket)).await.ok()?,
            Some(Item::Ready) => return Some(()),
            Some(_) => {}
            None => more(stream, reader).await?,
        }
    }
}

/// Reads what comes next; none at the end.
async fn more(stream: &mut (impl AsyncReadExt + Unpin), reader: &mut Reader) -> Option<()> {
    reader.buffer().reserve(READ_BYTES);
    (stream.read_buf(reader.buffer()).await.ok()? > 0).then_some(())
}

async fn subscribe(mut stream: TcpStream, subscribers: Subscribers) -> Option<()> {
    let mut reader = Reader::new(SocketType::Pub, READ_BYTES);
    handshake(&mut stream, SocketType::Pub, &mut reader).await?;
    let (mut from, to) = stream.into_split();
    let to = Rc::new(tokio::sync::Mutex::new(to));
    loop {
        match reader.next_item().ok()? {
            Some(Item::Subscribe(_)) => subscribers.borrow_mut().push(to.clone()),
            Some(_) => {}
            None => more(&mut from, &mut reader).await?,
        }
    }
}

async fn take(mut stream: TcpStream, subscribers: Subscribers) -> Option<()> {
    let mut reader = Reader::new(SocketType::Pull, READ_BYTES);
    handshake(&mut stream, SocketType::Pull, &mut reader).await?;
    let mut out = Vec::new();
    loop {
        while let Some(item) = reader.next_item().ok()? {
            match item {
                Item::Single(frame) => append(&mut out, 0, &frame),
                Item::Several(frames) => {
                    let last = frames.len() - 1;
                    for (place, frame) in frames.iter().enumerate() {
                        append(&mut out, u8::from(place < last), frame);
                    }
                }
                _ => {}
            }
        }
        let all: Vec<_> = subscribers.borrow().clone();
        for to in all {
            // A subscriber that is gone is of no interest in a measurement.
            let _ = to.lock().await.write_all(&out).await;
        }
        out.clear();
        more(&mut stream, &mut reader).await?;
    }
}

fn append(out: &mut Vec<u8>, more: u8, frame: &[u8]) {
    match u8::try_from(frame.len()) {
        Ok(length) => out.extend_from_slice(&[more, length]),
        Err(_) => {
            out.push(more | 2);
            out.extend_from_slice(&(frame.len() as u64).to_be_bytes());
        }
    }
    out.extend_from_slice(frame);
}
