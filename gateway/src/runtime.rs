//! Runs one node: clocks, bus, bridges and jobs around the pure object.

mod bus_task;
mod core;
mod disk;
mod wiring;

pub(crate) use core::{Core, Shared};
pub(crate) use wiring::{Outside, node_config, outside};

use crate::bridge;
use crate::carrier::{serial, udp};
use crate::journal::{JournalError, JournalThread};
use aldis_services::event::BridgeId;
use aldis_services::journal::JournalConfig;
use aldis_services::{Event, Node, NodeConfig};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{Notify, mpsc, watch};
use tokio::task::LocalSet;

/// How long the orderly end of a node may take before it is cut off.
const SHUTDOWN_WITHIN: Duration = Duration::from_secs(5);

/// How many events of the journal the node takes in one turn.
const JOURNAL_EVENTS_AT_ONCE: usize = 1_024;

/// What can be asked of a running node from outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Control {
    /// End in order.
    Shutdown,
    /// Close the session on the bus and stay away (true), or come back.
    Silence(bool),
}

/// Why a node could not be started.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RuntimeError {
    /// The configuration cannot be.
    #[error("{0}")]
    Config(String),
    /// The journal cannot be opened.
    #[error("{0}")]
    Journal(#[from] JournalError),
    /// The machine gives no runtime.
    #[error("no runtime: {0}")]
    Runtime(#[from] std::io::Error),
}

/// Runs a node until it ends. Blocks this thread; nothing of it outlives the call.
pub(crate) fn run(
    mut config: NodeConfig,
    outside: Outside,
    control: mpsc::UnboundedReceiver<Control>,
) -> Result<(), RuntimeError> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let keys = aldis_envelope::Keys::new(&config.fleet);
    for (link, keys) in config.links.iter_mut().zip(&outside.link_keys) {
        link.link.keys.clone_from(keys);
    }
    let links = config.links.len();
    #[cfg(feature = "dds")]
    let services: Vec<_> = config.services.iter().map(|service| service.source).collect();
    let node = Node::new(config).map_err(RuntimeError::Config)?;
    let (journal, told) = match &outside.journal {
        Some((directory, config)) => open_journal(directory, config.clone()).map(Option::unzip)?,
        None => (None, None),
    };
    let node = if journal.is_some() { node.with_journal() } else { node };
    let local = LocalSet::new();
    local.block_on(&runtime, async move {
        let (core, ends) = Core::build(node, journal, tokio::runtime::Handle::current());
        if let Some(told) = told {
            tokio::task::spawn_local(journal_events(core.clone(), told));
        }
        let outside = outside.for_links(links);
        #[cfg(feature = "dds")]
        let outside = outside.for_services(&services);
        drive(core, ends, outside, keys, control).await;
    });
    runtime.shutdown_timeout(Duration::from_secs(1));
    Ok(())
}

/// What the tasks around a core follow.
pub(crate) struct Ends {
    pub(crate) timer: watch::Receiver<Option<aldis_envelope::Monotonic>>,
    pub(crate) paused: watch::Receiver<bool>,
    pub(crate) exited: watch::Receiver<bool>,
    pub(crate) jobs: mpsc::UnboundedReceiver<Event>,
    pub(crate) wake: Arc<Notify>,
}

async fn drive(
    core: Shared,
    ends: Ends,
    outside: Outside,
    keys: aldis_envelope::Keys,
    control: mpsc::UnboundedReceiver<Control>,
) {
    let Ends { timer, paused, mut exited, jobs, wake } = ends;
    core.lock().handle(&mut Vec::new());
    let (silence, silenced) = watch::channel(false);
    let inbox = Arc::new(crate::bus::Inbox::new(keys.clone(), direct(core.clone())));
    let mut tasks = tokio::task::JoinSet::new();
    tasks.spawn_local(deadlines(core.clone(), timer));
    let kept = outside.journal.map_or_else(|| PathBuf::from("."), |(directory, _)| directory);
    tasks.spawn_local(disk::watch(core.clone(), kept));
    tasks.spawn_local(deferred(core.clone(), wake));
    tasks.spawn_local(job_results(core.clone(), jobs));
    tasks.spawn_local(bus_task::drain(core.clone(), inbox.clone(), paused.clone()));
    for (i, endpoint) in outside.bridges.into_iter().enumerate() {
        tasks.spawn_local(bridge::serve(core.clone(), BridgeId(i), endpoint, paused.clone()));
    }
    #[cfg(feature = "dds")]
    for domain in outside.domains {
        let core = core.clone();
        tasks.spawn_blocking(move || crate::bridge::dds::serve(&core, &domain));
    }
    for port in outside.udp {
        tasks.spawn_local(udp::serve(core.clone(), port));
    }
    for line in outside.lines {
        let core = core.clone();
        tasks.spawn_blocking(move || serial::serve(&core, &line));
    }
    for channel in outside.channels {
        tasks.spawn_local(crate::bus::frames::serve(core.clone(), channel));
    }
    let (closed, mut is_closed) = watch::channel(false);
    let bus = bus_task::keep(core.clone(), inbox, keys, outside.bus, silenced, closed);
    tasks.spawn_local(bus);
    tasks.spawn_local(controls(core.clone(), control, silence));
    let _ = exited.wait_for(|exited| *exited).await;
    let closed = tokio::time::timeout(SHUTDOWN_WITHIN, is_closed.wait_for(|closed| *closed)).await;
    if closed.is_err() {
        tracing::warn!("the bus did not close within {SHUTDOWN_WITHIN:?}");
    }
    tasks.shutdown().await;
}

/// The way of a sample to an idle node, on the thread that has it.
fn direct(core: Shared) -> crate::bus::Direct {
    Box::new(move |envelope| match core.try_lock() {
        Some(mut core) => core.sample_on_callback(envelope),
        None => Some(envelope),
    })
}

async fn deferred(core: Shared, wake: Arc<Notify>) {
    loop {
        wake.notified().await;
        core.lock().handle(&mut Vec::new());
    }
}

async fn deadlines(core: Shared, mut timer: watch::Receiver<Option<aldis_envelope::Monotonic>>) {
    loop {
        let Some(at) = *timer.borrow_and_update() else {
            if timer.changed().await.is_err() {
                return;
            }
            continue;
        };
        let at = core.lock().clock().instant(at);
        if at <= std::time::Instant::now() {
            // Tokio's timers are a millisecond late, which is long for what is due now.
            tokio::task::yield_now().await;
            deadline(&core);
            continue;
        }
        tokio::select! {
            changed = timer.changed() => {
                if changed.is_err() {
                    return;
                }
            }
            () = tokio::time::sleep_until(at.into()) => deadline(&core),
        }
    }
}

fn deadline(core: &Shared) {
    let mut core = core.lock();
    core.disarm();
    core.handle(&mut vec![Event::Deadline]);
}

/// A journal's thread, and what it tells.
type Opened = (JournalThread, mpsc::UnboundedReceiver<Event>);

fn open_journal(directory: &Path, config: JournalConfig) -> Result<Option<Opened>, JournalError> {
    // The node lets no more be on its way than the journal takes, so that what it is told is bounded too.
    let (tell, told) = mpsc::unbounded_channel();
    let thread = JournalThread::start(directory, config, move |events| {
        for event in events.drain(..) {
            // Nobody listens any more where the node has ended.
            let _ = tell.send(Event::Journal(event));
        }
    })?;
    Ok(Some((thread, told)))
}

async fn journal_events(core: Shared, mut told: mpsc::UnboundedReceiver<Event>) {
    let mut events = Vec::new();
    while told.recv_many(&mut events, JOURNAL_EVENTS_AT_ONCE).await > 0 {
        core.lock().handle(&mut events);
    }
}

async fn job_results(core: Shared, mut jobs: mpsc::UnboundedReceiver<Event>) {
    while let Some(done) = jobs.recv().await {
        core.lock().handle(&mut vec![done]);
    }
}

async fn controls(core: Shared, mut control: mpsc::UnboundedReceiver<Control>, silence: watch::Sender<bool>) {
    while let Some(asked) = control.recv().await {
        match asked {
            Control::Shutdown => core.lock().handle(&mut vec![Event::Shutdown]),
            Control::Silence(silenced) => {
                let _ = silence.send(silenced);
            }
        }
    }
    core.lock().handle(&mut vec![Event::Shutdown]);
}
