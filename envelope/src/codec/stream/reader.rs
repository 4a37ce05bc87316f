//! Frames out of a stream of bytes, whatever pieces it comes in and whatever else it holds.

use super::{BODY_END, CRC_DIGITS, Check, HEAD, SIZE_END, TAIL, checksum};
use bytes::{Buf, Bytes, BytesMut};

/// The most digits of a size or a checksum: u32::MAX has ten.
const DIGITS_MAX: usize = 10;

/// What was wrong with a stretch of the stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum StreamError {
    /// Bytes that belong to no frame.
    #[error("{0} bytes skipped that belong to no frame")]
    Skipped(usize),
    /// A head is not followed by a size.
    #[error("a frame begins without a size")]
    NoSize,
    /// The size is over the limit.
    #[error("a frame declares {declared} bytes, at most {limit} are allowed")]
    TooLarge {
        /// What the frame declares.
        declared: u64,
        /// The limit.
        limit: usize,
    },
    /// The body does not end where the size says.
    #[error("a frame's size of {0} bytes does not fit its body")]
    WrongSize(usize),
    /// The checksum is none, or not that of the body.
    #[error("a frame's checksum does not fit its body of {0} bytes")]
    WrongChecksum(usize),
    /// A frame stayed unfinished while whole frames came behind its head.
    #[error("a frame of {0} bytes was never finished")]
    Unfinished(usize),
}

/// What the stream holds next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Item {
    /// A message in delimited form, its checksum verified.
    Message(Bytes),
    /// Something wrong, already skipped.
    Bad(StreamError),
}

/// What a reader has seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counters {
    /// Whole messages.
    pub messages: u64,
    /// Frames that were none: no size, too large, wrong size or checksum, unfinished.
    pub frames_bad: u64,
    /// Bytes outside frames.
    pub bytes_skipped: u64,
}

/// Takes frames out of a stream. Bytes go in by [`Reader::buffer`], items come out of [`Reader::next_item`].
#[derive(Debug)]
pub struct Reader {
    buffer: BytesMut,
    message_bytes_max: usize,
    counters: Counters,
    /// Inside an unfinished body: how far the search for an early end went, and the sum of the bytes up to there.
    searched: usize,
    searched_sum: u32,
    check: Check,
}

/// A frame whose head is read and whose body may still be coming.
struct Open {
    body: usize,
    size: usize,
}

enum Step {
    Item(Item),
    Again,
    More,
}

impl Reader {
    /// A reader that refuses messages over a limit.
    pub fn new(message_bytes_max: usize) -> Self {
        let (buffer, counters) = (BytesMut::new(), Counters::default());
        Self { buffer, message_bytes_max, counters, searched: 0, searched_sum: 0, check: Check::Sum }
    }

    /// The same reader with a check of its frames.
    #[must_use]
    pub fn with_check(self, check: Check) -> Self {
        Self { check, ..self }
    }

    /// Where received bytes are appended. What is buffered stays below one message and one read.
    pub fn buffer(&mut self) -> &mut BytesMut {
        &mut self.buffer
    }

    /// What this reader has seen.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Whether a frame has begun and is not finished.
    pub fn is_inside_a_frame(&self) -> bool {
        self.buffer.len() >= HEAD.len()
    }

    /// The next message or complaint; none until more bytes come.
    pub fn next_item(&mut self) -> Option<Item> {
        loop {
            match self.step() {
                Step::Item(item) => return Some(item),
                Step::Again => {}
                Step::More => return None,
            }
        }
    }

    /// Gives up the unfinished frame if a whole frame stands behind its head: its size was wrong. To be called when a
    /// frame stays unfinished for long; whoever sends slowly loses nothing by it.
    pub fn abandon_unfinished(&mut self) -> Option<Item> {
        let Ok(Some(open)) = self.open() else { return None };
        let behind = &self.buffer[HEAD.len()..];
        let mut from = 0;
        while let Some(at) = find(&behind[from..], HEAD) {
            let mut rest = Reader::new(self.message_bytes_max).with_check(self.check);
            rest.buffer.extend_from_slice(&behind[from + at..]);
            if matches!(rest.step(), Step::Item(Item::Message(_))) {
                return Some(self.bad_frame(StreamError::Unfinished(open.size), HEAD.len()));
            }
            from += at + 1;
        }
        None
    }

    fn step(&mut self) -> Step {
        if let Some(skipped) = self.skip_to_head() {
            return Step::Item(skipped);
        }
        match self.open() {
            Ok(None) => Step::More,
            Ok(Some(open)) => self.close(&open),
            Err(error) => Step::Item(self.bad_frame(error, 1)),
        }
    }

    /// Drops what stands before the next head.
    fn skip_to_head(&mut self) -> Option<Item> {
        if self.buffer.starts_with(HEAD) {
            return None;
        }
        let keep = match find(&self.buffer, HEAD) {
            Some(at) => at,
            None => self.buffer.len() - half_head(&self.buffer),
        };
        if keep == 0 {
            return None;
        }
        self.buffer.advance(keep);
        self.counters.bytes_skipped += keep as u64;
        Some(Item::Bad(StreamError::Skipped(keep)))
    }

    /// Reads the size after a head: none when more bytes are needed.
    fn open(&self) -> Result<Option<Open>, StreamError> {
        let Some(after) = self.buffer.strip_prefix(HEAD) else { return Ok(None) };
        let digits = after.iter().take(DIGITS_MAX + 1).take_while(|b| b.is_ascii_digit()).count();
        let rest = &after[digits..];
        if digits > DIGITS_MAX || !SIZE_END.starts_with(&rest[..rest.len().min(SIZE_END.len())]) {
            return Err(StreamError::NoSize);
        }
        if rest.len() < SIZE_END.len() {
            return Ok(None);
        }
        let declared = number(&after[..digits]).ok_or(StreamError::NoSize)?;
        match usize::try_from(declared) {
            Ok(size) if size <= self.message_bytes_max => {
                Ok(Some(Open { body: HEAD.len() + digits + SIZE_END.len(), size }))
            }
            _ => Err(StreamError::TooLarge { declared, limit: self.message_bytes_max }),
        }
    }

    /// Takes the body and verifies what follows it.
    fn close(&mut self, open: &Open) -> Step {
        let end = open.body + open.size;
        let Some(after) = self.buffer.get(end..) else { return self.ended_early(open) };
        if !BODY_END.starts_with(&after[..after.len().min(BODY_END.len())]) {
            return Step::Item(self.bad_frame(StreamError::WrongSize(open.size), HEAD.len()));
        }
        let sum = checksum(&self.buffer[open.body..end]);
        match trailer(after) {
            Trailer::Short => Step::More,
            Trailer::None => Step::Item(self.bad_frame(StreamError::WrongChecksum(open.size), end)),
            Trailer::Whole { declared, length } if declared == u64::from(sum) => {
                let length = match self.crc(open.body..end, length) {
                    None => return Step::More,
                    Some(Ok(digits)) => length + digits,
                    // What stands in the digits' place may begin the next frame.
                    Some(Err(())) => {
                        let error = StreamError::WrongChecksum(open.size);
                        return Step::Item(self.bad_frame(error, end + length));
                    }
                };
                self.forget_search();
                self.buffer.advance(open.body);
                let body = self.buffer.split_to(open.size).freeze();
                self.buffer.advance(length);
                self.counters.messages += 1;
                Step::Item(Item::Message(body))
            }
            Trailer::Whole { length, .. } => {
                Step::Item(self.bad_frame(StreamError::WrongChecksum(open.size), end + length))
            }
        }
    }

    /// Looks at the CRC after a frame: how many digits it has, or that it does not fit; none until it is there.
    fn crc(&self, body: std::ops::Range<usize>, trailer: usize) -> Option<Result<usize, ()>> {
        if self.check == Check::Sum {
            return Some(Ok(0));
        }
        let at = body.end + trailer;
        let digits = self.buffer.get(at..at + CRC_DIGITS)?;
        let declared = std::str::from_utf8(digits).ok().and_then(|text| u32::from_str_radix(text, 16).ok());
        let fits = declared == Some(crc32fast::hash(&self.buffer[body]));
        Some(if fits { Ok(CRC_DIGITS) } else { Err(()) })
    }

    /// While the body is still coming: a trailer whose checksum fits the bytes so far says that the size was wrong, so
    /// that what follows need not wait for a body that never comes.
    fn ended_early(&mut self, open: &Open) -> Step {
        let body = &self.buffer[open.body..];
        let Some(at) = find(&body[self.searched..], BODY_END) else {
            // Half a sentinel at the end may be completed by the next piece.
            let upto = body.len().saturating_sub(BODY_END.len() - 1).max(self.searched);
            self.searched_sum = self.searched_sum.wrapping_add(checksum(&body[self.searched..upto]));
            self.searched = upto;
            return Step::More;
        };
        let end = self.searched + at;
        let sum = self.searched_sum.wrapping_add(checksum(&body[self.searched..end]));
        match trailer(&body[end..]) {
            Trailer::Short => Step::More,
            Trailer::Whole { declared, length } if declared == u64::from(sum) => {
                let frame = open.body + end + length;
                Step::Item(self.bad_frame(StreamError::WrongSize(open.size), frame))
            }
            _ => {
                self.searched_sum = sum.wrapping_add(u32::from(BODY_END[0]));
                self.searched = end + 1;
                Step::Again
            }
        }
    }

    fn bad_frame(&mut self, error: StreamError, skip: usize) -> Item {
        self.forget_search();
        self.buffer.advance(skip);
        self.counters.frames_bad += 1;
        Item::Bad(error)
    }

    fn forget_search(&mut self) {
        self.searched = 0;
        self.searched_sum = 0;
    }
}

enum Trailer {
    /// More bytes are needed.
    Short,
    /// This is none.
    None,
    Whole {
        declared: u64,
        length: usize,
    },
}

/// Reads `!%!%!%!%` checksum `?^?^?^?^` from the bytes after a body.
fn trailer(after: &[u8]) -> Trailer {
    let Some(text) = after.strip_prefix(BODY_END) else {
        return if BODY_END.starts_with(after) { Trailer::Short } else { Trailer::None };
    };
    let digits = text.iter().take(DIGITS_MAX + 1).take_while(|b| b.is_ascii_digit()).count();
    let rest = &text[digits..];
    if digits > DIGITS_MAX || !TAIL.starts_with(&rest[..rest.len().min(TAIL.len())]) {
        return Trailer::None;
    }
    if rest.len() < TAIL.len() {
        return Trailer::Short;
    }
    match number(&text[..digits]) {
        Some(declared) => Trailer::Whole { declared, length: BODY_END.len() + digits + TAIL.len() },
        None => Trailer::None,
    }
}

fn number(digits: &[u8]) -> Option<u64> {
    let value = |sum: u64, &digit: &u8| sum * 10 + u64::from(digit - b'0');
    (!digits.is_empty()).then(|| digits.iter().fold(0, value))
}

/// Where a sentinel first stands.
fn find(bytes: &[u8], sentinel: &[u8; 8]) -> Option<usize> {
    let mut from = 0;
    loop {
        let at = from + bytes[from..].iter().position(|&b| b == sentinel[0])?;
        if bytes[at..].starts_with(sentinel) {
            return Some(at);
        }
        from = at + 1;
    }
}

/// How many bytes at the end may begin a head.
fn half_head(bytes: &[u8]) -> usize {
    (1..HEAD.len()).rev().find(|&n| bytes.ends_with(&HEAD[..n])).unwrap_or(0)
}
