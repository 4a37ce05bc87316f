//! Keeps what comes by in files: recordings as `aldis record` makes them, a new one after so many messages.
//!
//! The service decides what stands in which file; writing is a job, one at a time, so that a slow disk holds nobody up. What
//! comes meanwhile waits within a limit; beyond it, it is left out and told. At the end all that waits is handed over at once,
//! so whoever writes goes by the numbers of the pieces.

use crate::service::{Input, Level, Outbox, Service};
use aldis_envelope::codec::recording::Writer;
use aldis_envelope::{Envelope, Fleet, Monotonic, Now, Prefix, Refusal};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// How often what came is written.
const WRITE_EVERY: Duration = Duration::from_millis(500);
/// How many bytes are written by one job.
const BYTES_AT_ONCE: usize = 256 * 1024;
/// How many bytes may wait for the disk.
const WAITING_BYTES_MAX: usize = 16 * 1024 * 1024;

/// A piece of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Piece {
    /// Counted from 0 by each run of the service: pieces are written in this order.
    pub number: u64,
    /// Whether a new file begins with it.
    pub begins: bool,
    /// What to append.
    pub bytes: Vec<u8>,
}

/// Appends a piece to its file; or why it could not, in words. Runs outside the loop.
pub type Write = Arc<dyn Fn(&Piece) -> Result<(), String> + Send + Sync>;

/// What a recorder keeps, and where.
#[derive(Clone)]
pub struct Recording {
    /// The fleet whose keys stand in the recording.
    pub fleet: Fleet,
    /// Whose addresses begin so is kept.
    pub addresses: Vec<Prefix>,
    /// How many messages a file holds.
    pub messages_per_file: u32,
    /// Writes.
    pub write: Write,
}

impl std::fmt::Debug for Recording {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Recording of {:?}", self.addresses)
    }
}

/// The service.
pub struct Recorder {
    recording: Recording,
    writer: Writer,
    head: Vec<u8>,
    /// How many messages the file holds that is filled.
    messages: u32,
    /// The number of the next piece.
    number: u64,
    /// What waits for the disk.
    waiting: VecDeque<Piece>,
    waiting_bytes: usize,
    is_writing: bool,
    /// Messages left out since the last word of it.
    left_out: u64,
    fails: bool,
    next: Option<Monotonic>,
}

impl Recorder {
    /// A recorder that writes its first file with the first message.
    pub fn new(recording: Recording) -> Self {
        let (writer, head) = Writer::new(&recording.fleet);
        Self {
            recording,
            writer,
            head,
            messages: 0,
            number: 0,
            waiting: VecDeque::new(),
            waiting_bytes: 0,
            is_writing: false,
            left_out: 0,
            fails: false,
            next: None,
        }
    }

    fn keep(&mut self, now: Now, envelope: &Envelope, out: &mut Outbox) {
        let record = self.writer.record(now.wall, envelope);
        if self.waiting_bytes + record.len() > WAITING_BYTES_MAX {
            self.left_out += 1;
            return;
        }
        if self.messages >= self.recording.messages_per_file {
            self.messages = 0;
        }
        let begins = self.messages == 0;
        self.messages += 1;
        self.waiting_bytes += record.len();
        match self.waiting.back_mut() {
            Some(piece) if !begins && piece.bytes.len() + record.len() <= BYTES_AT_ONCE => {
                piece.bytes.extend_from_slice(&record);
            }
            _ => {
                let mut bytes = if begins { self.head.clone() } else { Vec::new() };
                self.waiting_bytes += bytes.len();
                bytes.extend_from_slice(&record);
                self.waiting.push_back(Piece { number: self.number, begins, bytes });
                self.number += 1;
            }
        }
        if self.waiting.len() > 1 {
            self.write(out);
        } else if !self.is_writing {
            self.next.get_or_insert(now.monotonic + WRITE_EVERY);
        }
    }

    /// Hands the oldest piece to the disk, if the disk has none.
    fn write(&mut self, out: &mut Outbox) {
        if self.is_writing {
            return;
        }
        self.next = None;
        self.hand_over(out);
    }

    fn hand_over(&mut self, out: &mut Outbox) {
        let Some(piece) = self.waiting.pop_front() else { return };
        self.waiting_bytes -= piece.bytes.len();
        self.is_writing = true;
        let write = self.recording.write.clone();
        out.job(0, Box::new(move || Box::new(write(&piece))));
    }

    fn written(&mut self, now: Now, result: Result<(), String>, out: &mut Outbox) {
        self.is_writing = false;
        match result {
            Ok(()) => self.fails = false,
            Err(why) => {
                if !std::mem::replace(&mut self.fails, true) {
                    out.note(Level::Error, format!("the recording is not written: {why}"));
                }
                // What follows needs a beginning: a new file is tried with the next message.
                self.messages = self.recording.messages_per_file;
                self.left_out += self.forget_rest_of_file();
            }
        }
        if self.left_out > 0 {
            let text = format!(
                "{} messages or pieces are missing in the recording",
                std::mem::take(&mut self.left_out)
            );
            out.note(Level::Warning, text);
        }
        match self.waiting.len() {
            0 => {}
            1 => self.next = Some(now.monotonic + WRITE_EVERY),
            _ => self.write(out),
        }
    }

    /// Pieces of a file whose earlier part is missing are of no use.
    fn forget_rest_of_file(&mut self) -> u64 {
        let rest = self.waiting.iter().take_while(|piece| !piece.begins).count();
        for piece in self.waiting.drain(..rest) {
            self.waiting_bytes -= piece.bytes.len();
        }
        rest as u64
    }
}

impl Service for Recorder {
    fn subscriptions(&self) -> Vec<Prefix> {
        self.recording.addresses.clone()
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            Input::Message(envelope) if envelope.message.call.is_some() => {
                let what = envelope.message.label.descriptor().to_owned();
                out.refuse(envelope, Refusal::NotUnderstood(what));
            }
            Input::Message(envelope) => self.keep(now, envelope, out),
            Input::Deadline => self.write(out),
            Input::Job(_, Ok(output)) => {
                let result = output.downcast::<Result<(), String>>().map_or(Ok(()), |result| *result);
                self.written(now, result, out);
            }
            Input::Job(_, Err(why)) => self.written(now, Err(why), out),
            Input::Shutdown => {
                while !self.waiting.is_empty() {
                    self.hand_over(out);
                }
            }
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.next
    }
}

#[cfg(test)]
mod tests;
