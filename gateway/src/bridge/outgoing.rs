//! Frames on their way to a stream's peer.

use std::collections::VecDeque;
use std::io::{ErrorKind, Write};

/// Whole frames are written together up to this size: an OpenUxAS peer reads 8 KiB at once and dies of a frame split
/// over two reads.
const WRITE_BYTES_MAX: usize = 8_192;
/// A reader of ZeroMQ takes pieces of any size: few system calls count.
const WRITE_BYTES_MAX_ZEROMQ: usize = 256 * 1024;

/// Frames that wait to be written. What may be in it is bounded by the credit that the node was given.
#[derive(Debug)]
pub(crate) struct Outgoing {
    write_bytes_max: usize,
    bytes: Vec<u8>,
    written: usize,
    /// Where each frame ends, and how many bytes of content it carries.
    frames: VecDeque<(usize, usize)>,
}

/// How writing went.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Written {
    /// Everything is out.
    All,
    /// The peer takes no more now.
    Blocked,
}

impl Default for Outgoing {
    fn default() -> Self {
        Self { write_bytes_max: WRITE_BYTES_MAX, bytes: Vec::new(), written: 0, frames: VecDeque::new() }
    }
}

impl Outgoing {
    /// For a peer that speaks ZeroMQ.
    pub(crate) fn zeromq() -> Self {
        Self { write_bytes_max: WRITE_BYTES_MAX_ZEROMQ, ..Self::default() }
    }

    /// Where a frame is appended; [`Self::end_frame`] must follow.
    pub(crate) fn buffer(&mut self) -> &mut Vec<u8> {
        &mut self.bytes
    }

    /// A frame with so many bytes of content has been appended.
    pub(crate) fn end_frame(&mut self, content: usize) {
        self.frames.push_back((self.bytes.len(), content));
    }

    /// Whether nothing waits.
    pub(crate) fn is_empty(&self) -> bool {
        self.written == self.bytes.len()
    }

    /// Writes what the peer takes. Adds the content of whole frames that are out to `done`.
    ///
    /// # Errors
    /// What the stream says, when it is gone.
    pub(crate) fn write_to(&mut self, stream: &mut impl Write, done: &mut usize) -> std::io::Result<Written> {
        while !self.is_empty() {
            match stream.write(&self.bytes[self.written..self.end_of_write()]) {
                Ok(0) => return Err(ErrorKind::WriteZero.into()),
                Ok(count) => self.advance(count, done),
                Err(e) if e.kind() == ErrorKind::WouldBlock => return Ok(Written::Blocked),
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        Ok(Written::All)
    }

    /// The end of the last whole frame that fits one write, or of the first frame where none fits.
    fn end_of_write(&self) -> usize {
        let limit = self.written + self.write_bytes_max;
        let fitting = self.frames.partition_point(|&(end, _)| end <= limit).max(1);
        self.frames.get(fitting - 1).map_or(self.bytes.len(), |&(end, _)| end)
    }

    fn advance(&mut self, count: usize, done: &mut usize) {
        self.written += count;
        while let Some(&(end, content)) = self.frames.front()
            && end <= self.written
        {
            self.frames.pop_front();
            *done += content;
        }
        if self.is_empty() {
            self.bytes.clear();
            self.written = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stream that takes so many bytes, then blocks; it remembers the sizes of the writes.
    struct Narrow {
        room: usize,
        writes: Vec<usize>,
    }

    impl Write for Narrow {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            if self.room == 0 {
                return Err(ErrorKind::WouldBlock.into());
            }
            let taken = bytes.len().min(self.room);
            self.room -= taken;
            self.writes.push(bytes.len());
            Ok(taken)
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    fn outgoing(frames: &[usize]) -> Outgoing {
        let mut outgoing = Outgoing::default();
        for &size in frames {
            outgoing.buffer().extend(std::iter::repeat_n(0, size));
            outgoing.end_frame(size - 1);
        }
        outgoing
    }

    #[test]
    fn whole_frames_go_together_up_to_the_reader_of_openuxas() {
        let mut stream = Narrow { room: usize::MAX, writes: vec![] };
        let mut done = 0;
        let mut outgoing = outgoing(&[5_000, 3_192, 1, 9_000, 10]);
        assert_eq!(outgoing.write_to(&mut stream, &mut done).unwrap(), Written::All);
        assert_eq!(stream.writes, [8_192, 1, 9_000, 10]);
        assert_eq!(done, 5_000 + 3_192 + 1 + 9_000 + 10 - 5);
        assert!(outgoing.is_empty());
    }

    #[test]
    fn what_the_peer_does_not_take_waits_and_only_whole_frames_count() {
        let mut stream = Narrow { room: 150, writes: vec![] };
        let mut done = 0;
        let mut outgoing = outgoing(&[100, 100]);
        assert_eq!(outgoing.write_to(&mut stream, &mut done).unwrap(), Written::Blocked);
        assert_eq!(done, 99);
        stream.room = 1_000;
        assert_eq!(outgoing.write_to(&mut stream, &mut done).unwrap(), Written::All);
        assert_eq!(done, 198);
    }
}
