//! Messages on their way out.

use super::{COMMAND, MORE, Topics, frame_head};
use crate::address::Dialect;
use crate::codec::{delimited, multipart};
use crate::message::Label;
use bytes::Bytes;
use std::sync::Arc;

/// How a message of UxAS stands in a message of ZeroMQ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Framing {
    /// One frame with the delimited form: OpenUxAS.
    #[default]
    Single,
    /// Seven frames, as in the slides.
    Multipart,
}

/// Writes messages. It keeps what it wrote of the last label, since streams come in runs.
#[derive(Debug)]
pub struct Writer {
    framing: Framing,
    dialect: Dialect,
    last: Option<Arc<Label>>,
    /// What comes before the payload: text of the one frame, or six frames.
    head: Vec<u8>,
    /// Where the first frame's text stands in the head.
    first: std::ops::Range<usize>,
}

impl Writer {
    /// A writer that spells ids in a dialect.
    pub fn new(framing: Framing, dialect: Dialect) -> Self {
        Self { framing, dialect, last: None, head: Vec::new(), first: 0..0 }
    }

    /// Appends one message, unless no topic wants it. Says whether it was wanted.
    pub fn write(
        &mut self,
        label: &Arc<Label>,
        payload: &[u8],
        topics: Option<&Topics>,
        out: &mut Vec<u8>,
    ) -> bool {
        if !self.last.as_ref().is_some_and(|last| Arc::ptr_eq(last, label)) {
            self.head_of(label);
        }
        let first = &self.head[self.first.clone()];
        let rest = if self.framing == Framing::Single { payload } else { &[] };
        if topics.is_some_and(|topics| !topics.want(first, rest)) {
            return false;
        }
        out.reserve(self.head.len() + payload.len() + 9);
        match self.framing {
            Framing::Single => {
                frame_head(0, self.head.len() + payload.len(), out);
                out.extend_from_slice(&self.head);
            }
            Framing::Multipart => {
                out.extend_from_slice(&self.head);
                frame_head(0, payload.len(), out);
            }
        }
        out.extend_from_slice(payload);
        true
    }

    fn head_of(&mut self, label: &Arc<Label>) {
        self.head.clear();
        self.last = Some(label.clone());
        if self.framing == Framing::Single {
            delimited::write_head(label, self.dialect, &mut self.head);
            self.first = 0..self.head.len();
            return;
        }
        for (place, frame) in multipart::write(label, Bytes::new(), self.dialect).iter().take(6).enumerate() {
            frame_head(MORE, frame.len(), &mut self.head);
            if place == 0 {
                self.first = self.head.len()..self.head.len() + frame.len();
            }
            self.head.extend_from_slice(frame);
        }
    }
}

/// The message by which a subscriber of ZMTP 3.0 asks for what begins so.
pub fn subscription(topic: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    frame_head(0, topic.len() + 1, &mut out);
    out.push(1);
    out.extend_from_slice(topic);
    out
}

/// The answer to a PING.
pub fn pong(context: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    frame_head(COMMAND, context.len() + 5, &mut out);
    out.extend_from_slice(b"\x04PONG");
    out.extend_from_slice(context);
    out
}
