//! A plain TCP copy in one process: what each connection sends goes to all others. It understands nothing.

use super::super::super::exit::Failure;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::tcp::OwnedWriteHalf;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::LocalSet;

/// The plain TCP copy of `bench uxas`.
#[derive(clap::Args)]
pub(in super::super) struct TcpCopy {
    port: u16,
}

type Writers = Rc<RefCell<BTreeMap<u64, Rc<tokio::sync::Mutex<OwnedWriteHalf>>>>>;

impl TcpCopy {
    pub(in super::super) fn run(self) -> Result<(), Failure> {
        let failed = |why: std::io::Error| Failure::Failed(why.to_string());
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(failed)?;
        LocalSet::new().block_on(&runtime, serve(self.port)).map_err(failed)
    }
}

async fn serve(port: u16) -> std::io::Result<()> {
    let listener = TcpListener::bind(("127.0.0.1", port)).await?;
    let writers = Writers::default();
    for id in 0.. {
        let (stream, _) = listener.accept().await?;
        tokio::task::spawn_local(copy(stream, id, writers.clone()));
    }
    Ok(())
}

async fn copy(stream: TcpStream, id: u64, writers: Writers) {
    // Without this the copy would wait for acknowledgements, and every comparison would be too good.
    let _ = stream.set_nodelay(true);
    let (mut reader, writer) = stream.into_split();
    writers.borrow_mut().insert(id, Rc::new(tokio::sync::Mutex::new(writer)));
    let mut buffer = vec![0; 64 * 1024];
    while let Ok(count @ 1..) = reader.read(&mut buffer).await {
        let others: Vec<_> =
            writers.borrow().iter().filter(|(to, _)| **to != id).map(|(_, w)| w.clone()).collect();
        for other in others {
            if other.lock().await.write_all(&buffer[..count]).await.is_err() {
                break;
            }
        }
    }
    writers.borrow_mut().remove(&id);
}
