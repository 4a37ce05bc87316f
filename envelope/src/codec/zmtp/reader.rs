//! What the other end of a connection says, whatever pieces it comes in.

use super::greeting::{SocketType, socket_type};
use super::{COMMAND, LONG, MORE};
use bytes::{Buf, Bytes, BytesMut};

/// The longest command: a READY with generous properties, or a subscription.
const COMMAND_BYTES_MAX: u64 = 4_096;
/// How many frames of a message are kept; a message of UxAS has one or seven. Further ones are dropped as they come.
const FRAMES_MAX: usize = 8;

/// Why a connection cannot go on.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ZmtpError {
    /// The first bytes are no greeting.
    #[error("this is no ZeroMQ greeting")]
    NotZmtp,
    /// An older version of the protocol.
    #[error("it speaks ZMTP {0}, at least 3 is needed")]
    Version(u8),
    /// Encryption or passwords, which UxAS does not use.
    #[error("it wants the security mechanism `{0}`, only NULL is understood")]
    Mechanism(String),
    /// A socket that does not fit.
    #[error("a {found} socket does not fit this {own}")]
    SocketType {
        /// This end.
        own: &'static str,
        /// That end.
        found: String,
    },
    /// It says why it does not want to go on.
    #[error("it refuses: {0}")]
    Refused(String),
    /// The flags of a frame, or a length, mean nothing.
    #[error("a frame begins with what is no frame")]
    NoFrame,
    /// A command over the limit, or one that cannot be read.
    #[error("a command cannot be read")]
    NoCommand,
    /// Messages before the end of the handshake.
    #[error("it sends a message before it is ready")]
    NotReady,
}

/// What is said next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Item {
    /// The greeting has come: this end says READY now.
    Greeted,
    /// The other end is ready, and fits.
    Ready,
    /// A message of one frame.
    Single(Bytes),
    /// A message of several frames; of very many, the first ones.
    Several(Vec<Bytes>),
    /// A message over the limit was skipped; so many bytes were declared until then.
    TooLarge(u64),
    /// The other end wants what begins so.
    Subscribe(Bytes),
    /// It wants that no longer.
    Cancel(Bytes),
    /// It asks for a sign of life: a PONG with this context.
    Ping(Bytes),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Greeting,
    Handshake,
    Open,
}

/// The head of a frame.
struct Head {
    flags: u8,
    bytes: usize,
    body: u64,
}

enum Step {
    Item(Item),
    /// Taken, and there may be more.
    Again,
    /// More bytes are needed.
    More,
}

/// Takes items out of what is received. Bytes go in by [`Reader::buffer`], items come out of [`Reader::next_item`].
#[derive(Debug)]
pub struct Reader {
    own: SocketType,
    state: State,
    buffer: BytesMut,
    message_bytes_max: usize,
    frames: Vec<Bytes>,
    /// Whether a message of several frames has begun.
    several: bool,
    /// The bytes of the message so far, dropped frames too.
    message_bytes: u64,
    /// The message is over the limit: its frames are dropped.
    too_large: bool,
    /// So many bytes are dropped as they come.
    skip: u64,
    /// Whether more frames follow the one that is being dropped.
    skip_more: bool,
}

impl Reader {
    /// A reader of the end `own` that refuses messages over a limit.
    pub fn new(own: SocketType, message_bytes_max: usize) -> Self {
        Self {
            own,
            state: State::Greeting,
            buffer: BytesMut::new(),
            message_bytes_max,
            frames: Vec::new(),
            several: false,
            message_bytes: 0,
            too_large: false,
            skip: 0,
            skip_more: false,
        }
    }

    /// Where received bytes are appended. What is buffered stays below one message and one read.
    pub fn buffer(&mut self) -> &mut BytesMut {
        &mut self.buffer
    }

    /// The next item; none until more bytes come.
    ///
    /// # Errors
    /// [`ZmtpError`]: the connection cannot go on.
    pub fn next_item(&mut self) -> Result<Option<Item>, ZmtpError> {
        if self.state == State::Greeting {
            return self.greeting();
        }
        loop {
            if self.too_large {
                if !self.drop_what_is_there() {
                    return Ok(None);
                }
                if !self.skip_more {
                    (self.too_large, self.several) = (false, false);
                    return Ok(Some(Item::TooLarge(std::mem::take(&mut self.message_bytes))));
                }
            }
            let Some(head) = self.head()? else { return Ok(None) };
            let step = match head.flags & COMMAND {
                0 if self.state != State::Open => return Err(ZmtpError::NotReady),
                0 => self.frame(&head),
                _ => self.command(&head)?,
            };
            match step {
                Step::Item(item) => return Ok(Some(item)),
                Step::Again => {}
                Step::More => return Ok(None),
            }
        }
    }

    fn greeting(&mut self) -> Result<Option<Item>, ZmtpError> {
        let text = &self.buffer[..self.buffer.len().min(64)];
        if text.first().is_some_and(|&b| b != 0xff) || text.get(9).is_some_and(|b| b & 1 == 0) {
            return Err(ZmtpError::NotZmtp);
        }
        if let Some(&version) = text.get(10).filter(|&&version| version < 3) {
            return Err(ZmtpError::Version(version));
        }
        let Some(mechanism) = text.get(12..32).filter(|_| text.len() == 64) else { return Ok(None) };
        let name = mechanism.split(|&b| b == 0).next().unwrap_or_default();
        if name != b"NULL" {
            return Err(ZmtpError::Mechanism(String::from_utf8_lossy(name).into_owned()));
        }
        self.buffer.advance(64);
        self.state = State::Handshake;
        Ok(Some(Item::Greeted))
    }

    /// The head of the next frame; none until it is whole.
    fn head(&self) -> Result<Option<Head>, ZmtpError> {
        let Some((&flags, rest)) = self.buffer.split_first() else { return Ok(None) };
        if flags > (MORE | LONG | COMMAND) || (flags & COMMAND != 0 && flags & MORE != 0) {
            return Err(ZmtpError::NoFrame);
        }
        if flags & LONG == 0 {
            return Ok(rest.first().map(|&length| Head { flags, bytes: 2, body: u64::from(length) }));
        }
        let Some(length) = rest.first_chunk() else { return Ok(None) };
        match u64::from_be_bytes(*length) {
            length if length > i64::MAX as u64 => Err(ZmtpError::NoFrame),
            body => Ok(Some(Head { flags, bytes: 9, body })),
        }
    }

    /// The body of a frame that is whole.
    fn body(&mut self, head: &Head) -> Option<Bytes> {
        let length = usize::try_from(head.body).ok()?;
        if self.buffer.len() - head.bytes < length {
            return None;
        }
        self.buffer.advance(head.bytes);
        Some(self.buffer.split_to(length).freeze())
    }

    /// A frame of a message; an item where it is the last.
    fn frame(&mut self, head: &Head) -> Step {
        let more = head.flags & MORE != 0;
        let bytes = self.message_bytes.saturating_add(head.body);
        if bytes > self.message_bytes_max as u64 {
            self.frames.clear();
            self.buffer.advance(head.bytes);
            (self.too_large, self.skip, self.skip_more, self.message_bytes) = (true, head.body, more, bytes);
            return Step::Again;
        }
        let Some(body) = self.body(head) else { return Step::More };
        if !more && !self.several {
            return Step::Item(self.subscribed(body));
        }
        self.message_bytes = bytes;
        self.several = more;
        if self.frames.len() < FRAMES_MAX {
            self.frames.push(body);
        }
        if more {
            return Step::Again;
        }
        self.message_bytes = 0;
        Step::Item(Item::Several(std::mem::take(&mut self.frames)))
    }

    /// In ZMTP 3.0 a subscription is a message whose first byte says which.
    fn subscribed(&self, mut body: Bytes) -> Item {
        match (self.own, body.first()) {
            (SocketType::Pub, Some(1)) => Item::Subscribe(body.split_off(1)),
            (SocketType::Pub, Some(0)) => Item::Cancel(body.split_off(1)),
            _ => Item::Single(body),
        }
    }

    /// Drops the frame that is over the limit; true when it is gone, and the head of the next one where one follows.
    fn drop_what_is_there(&mut self) -> bool {
        let there = self.skip.min(self.buffer.len() as u64);
        self.buffer.advance(there as usize);
        self.skip -= there;
        self.skip == 0
    }

    fn command(&mut self, head: &Head) -> Result<Step, ZmtpError> {
        if head.body > COMMAND_BYTES_MAX {
            return Err(ZmtpError::NoCommand);
        }
        let Some(mut body) = self.body(head) else { return Ok(Step::More) };
        let length = body.first().map(|&length| usize::from(length)).ok_or(ZmtpError::NoCommand)?;
        let name = body.get(1..=length).ok_or(ZmtpError::NoCommand)?.to_vec();
        body.advance(1 + length);
        match (self.state, name.as_slice()) {
            (State::Handshake, b"READY") => {
                let found = socket_type(&body).ok_or(ZmtpError::NoCommand)?;
                if !self.own.fits(found) {
                    let found = String::from_utf8_lossy(found).into_owned();
                    return Err(ZmtpError::SocketType { own: self.own.as_str(), found });
                }
                self.state = State::Open;
                Ok(Step::Item(Item::Ready))
            }
            (_, b"ERROR") => {
                let why = body.get(1..).unwrap_or_default();
                Err(ZmtpError::Refused(String::from_utf8_lossy(why).into_owned()))
            }
            (State::Open, b"SUBSCRIBE") => Ok(Step::Item(Item::Subscribe(body))),
            (State::Open, b"CANCEL") => Ok(Step::Item(Item::Cancel(body))),
            (State::Open, b"PING") if body.len() >= 2 => Ok(Step::Item(Item::Ping(body.split_off(2)))),
            // What later versions may say is passed over.
            (State::Open, _) => Ok(Step::Again),
            _ => Err(ZmtpError::NoCommand),
        }
    }
}
