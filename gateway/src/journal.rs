//! The journal on real files: a thread of its own carries out what the journal asks for, so that no sync holds up the node.

mod files;
#[cfg(test)]
mod tests;

use crate::clock::Clock;
use aldis_services::journal::{Batch, Journal, JournalConfig, JournalEvent, JournalOutput, Refused};
use files::Files;
pub(crate) use files::JournalError;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;

/// How many batches may be on their way to the thread. With 200 bytes each it is more than the bytes that may be.
const BATCHES_MAX: usize = 65_536;
/// How many batches are taken between two operations, so that their outcome is not put off for ever.
const BATCHES_AT_ONCE: usize = 16_384;

/// A journal that is kept by a thread. It is closed, and all that was appended written, when it is dropped.
pub(crate) struct JournalThread {
    batches: Option<SyncSender<Batch>>,
    thread: Option<JoinHandle<()>>,
    /// Bytes on their way to the thread.
    pending: Arc<AtomicUsize>,
    pending_max: usize,
    appended: u64,
}

impl JournalThread {
    /// Opens or begins the journal in a directory, which is made where there is none. `tell` is called on the journal's thread
    /// with what the journal has to say, beginning with what stands.
    ///
    /// # Errors
    /// [`JournalError`] where the directory cannot be used, or another process uses it.
    pub(crate) fn start(
        directory: &Path,
        config: JournalConfig,
        tell: impl FnMut(&mut Vec<JournalEvent>) + Send + 'static,
    ) -> Result<Self, JournalError> {
        let files = Files::open(directory)?;
        let pending = Arc::new(AtomicUsize::new(0));
        let (batches, incoming) = sync_channel(BATCHES_MAX);
        let pending_max = config.pending_bytes_max;
        let journal = Journal::new(config);
        let keeper =
            Keeper { journal, files, incoming, pending: pending.clone(), clock: Clock::start(), tell };
        let thread = std::thread::Builder::new().name("journal".into()).spawn(move || keeper.run());
        let thread = thread.map_err(|why| JournalError::new("start a thread for", directory, &why))?;
        Ok(Self { batches: Some(batches), thread: Some(thread), pending, pending_max, appended: 0 })
    }

    /// Hands over a batch. Its number, by which it is told what became of it.
    ///
    /// # Errors
    /// [`Refused::Behind`] where too much is on its way already; the batch has no number then.
    pub(crate) fn append(&mut self, batch: Batch) -> Result<u64, Refused> {
        let bytes = batch.encoded_bytes();
        let pending = self.pending.fetch_add(bytes, Ordering::Relaxed) + bytes;
        let sent = match &self.batches {
            Some(batches) if pending <= self.pending_max.max(bytes) => batches.try_send(batch),
            _ => Err(TrySendError::Full(batch)),
        };
        if sent.is_err() {
            self.pending.fetch_sub(bytes, Ordering::Relaxed);
            return Err(Refused::Behind { pending });
        }
        self.appended += 1;
        Ok(self.appended)
    }

    /// Hands over a batch of an owner who sees to it himself that no more is on its way than can be: it is the next by number.
    pub(crate) fn hand_over(&mut self, batch: Batch) {
        self.pending.fetch_add(batch.encoded_bytes(), Ordering::Relaxed);
        self.appended += 1;
        if let Some(batches) = &self.batches {
            // A thread that has panicked takes nothing more: then too much waits, and the owner says so.
            let _ = batches.send(batch);
        }
    }
}

impl Drop for JournalThread {
    fn drop(&mut self) {
        self.batches = None;
        if let Some(thread) = self.thread.take() {
            // A panic of the thread was reported when it happened.
            let _ = thread.join();
        }
    }
}

/// Drawn for a journal that begins: the standard library's hasher is seeded by the system.
pub(crate) fn seed() -> u64 {
    RandomState::new().build_hasher().finish()
}

/// The thread with the journal.
struct Keeper<T> {
    journal: Journal,
    files: Files,
    incoming: Receiver<Batch>,
    pending: Arc<AtomicUsize>,
    clock: Clock,
    tell: T,
}

impl<T: FnMut(&mut Vec<JournalEvent>)> Keeper<T> {
    fn run(mut self) {
        let mut out = JournalOutput::default();
        self.journal.open(&mut out);
        loop {
            self.work(&mut out);
            if !self.wait(&mut out) {
                return;
            }
        }
    }

    /// Carries out what the journal asks for, until it asks for nothing more.
    fn work(&mut self, out: &mut JournalOutput) {
        loop {
            self.journal.flush(out);
            if !out.events.is_empty() {
                (self.tell)(&mut out.events);
                out.events.clear();
            }
            if out.effects.is_empty() {
                return;
            }
            for effect in std::mem::take(&mut out.effects) {
                let outcome = self.files.carry_out(&effect.operation);
                // What has come meanwhile is written together next.
                for _ in 0..BATCHES_AT_ONCE {
                    let Ok(batch) = self.incoming.try_recv() else { break };
                    self.append(&batch, out);
                }
                let now = self.clock.now().monotonic;
                self.journal.done(now, effect.token, outcome, out);
            }
        }
    }

    /// Waits for a batch or for the time to try the disk again. False when there is nothing to wait for any more.
    fn wait(&mut self, out: &mut JournalOutput) -> bool {
        let batch = match self.journal.next_deadline() {
            None => self.incoming.recv().map_err(|_| RecvTimeoutError::Disconnected),
            Some(at) => self.incoming.recv_timeout(at - self.clock.now().monotonic),
        };
        match batch {
            Ok(batch) => self.append(&batch, out),
            Err(RecvTimeoutError::Timeout) => self.journal.deadline(self.clock.now().monotonic, out),
            Err(RecvTimeoutError::Disconnected) => return false,
        }
        true
    }

    fn append(&mut self, batch: &Batch, out: &mut JournalOutput) {
        self.pending.fetch_sub(batch.encoded_bytes(), Ordering::Relaxed);
        self.journal.append(batch, out);
    }
}
