//! Frames and the items in them, as `PROTOCOL.md` draws them.

use super::wire::{Malformed, Reader, put_run, put_varint, varint_len};

/// The version of the protocol, in the upper three bits of every frame.
pub const VERSION: u8 = 1;

/// The bytes before the hello or the first item.
pub(super) const HEAD_BYTES: usize = 4;

/// What every frame begins with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Head {
    /// A hello follows.
    pub(super) hello: bool,
    /// The lowest bit of the key's number.
    pub(super) key: bool,
    /// The sender wants to hear of it.
    pub(super) eliciting: bool,
    /// The sender wants a hello that names its life.
    pub(super) asks: bool,
    /// A byte that two lives of a sender that follow one another never share.
    pub(super) session: u8,
    /// The lowest bits of the number on this carrier.
    pub(super) number: u16,
}

impl Head {
    pub(super) fn write(self, out: &mut Vec<u8>) {
        let flags = u8::from(self.hello) << 4 | u8::from(self.key) << 3;
        let flags = flags | u8::from(self.eliciting) << 2 | u8::from(self.asks) << 1;
        out.extend_from_slice(&[VERSION << 5 | flags, self.session]);
        out.extend_from_slice(&self.number.to_be_bytes());
    }

    pub(super) fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        let first = reader.byte()?;
        if first & 1 != 0 {
            return Err(reader.malformed());
        }
        Ok(Self {
            hello: first & 0x10 != 0,
            key: first & 8 != 0,
            eliciting: first & 4 != 0,
            asks: first & 2 != 0,
            session: reader.byte()?,
            number: reader.u16()?,
        })
    }
}

/// The byte that stands for a life.
pub(super) fn session_byte(boot: u64) -> u8 {
    (boot % 255) as u8 + 1
}

/// Who is there, in which life. In the clear, so that a shell finds the sender of a frame from an unknown place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Hello {
    pub(super) sender: u64,
    pub(super) receiver: u64,
    pub(super) boot: u64,
    /// The receiver's life as far as the sender knows; 0 for unknown.
    pub(super) known_boot: u64,
    /// When the sender's journal was born.
    pub(super) origin: u64,
    /// When the receiver's journal was born, as the sender's journal remembers it; 0 for unknown.
    pub(super) known_origin: u64,
    /// No command below this number is coming any more.
    pub(super) floor: u64,
    /// The number of the newest key that the sender has; 0 for none.
    pub(super) key: u32,
    /// The whole number of this frame on its carrier.
    pub(super) number: u64,
}

impl Hello {
    pub(super) fn write(&self, out: &mut Vec<u8>) {
        let key = u64::from(self.key);
        for number in [self.sender, self.receiver, self.boot, self.known_boot] {
            put_varint(number, out);
        }
        for number in [self.origin, self.known_origin, self.floor, key, self.number] {
            put_varint(number, out);
        }
    }

    pub(super) fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        Ok(Self {
            sender: reader.varint()?,
            receiver: reader.varint()?,
            boot: reader.varint()?,
            known_boot: reader.varint()?,
            origin: reader.varint()?,
            known_origin: reader.varint()?,
            floor: reader.varint()?,
            key: reader.varint_u32()?,
            number: reader.varint()?,
        })
    }
}

/// A command or a piece of one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct CommandItem<'a> {
    pub(super) number: u64,
    /// The number of the command before it in its stream; 0 for the first.
    pub(super) after: u64,
    /// Remaining lifespan in units of 64 ms.
    pub(super) lifespan: Option<u64>,
    /// For a piece: the length of the whole and where the piece begins.
    pub(super) piece: Option<(u32, u32)>,
    pub(super) bytes: &'a [u8],
}

/// A sample of an instance, with all that can be said of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct StateItem<'a> {
    pub(super) alias: u32,
    pub(super) change: u8,
    pub(super) origin: u32,
    pub(super) sequence: u64,
    /// Microseconds after the time in the definition of the label.
    pub(super) time: i64,
    /// Remaining lifespan in units of 64 ms.
    pub(super) lifespan: Option<u64>,
    pub(super) bytes: &'a [u8],
}

/// What a frame carries.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Item<'a> {
    /// Frames of this carrier that were taken: the last one, how long ago in units of 8 ms, and one bit for each before it.
    Ack {
        largest: u16,
        delay: u8,
        before: &'a [u8],
    },
    /// How many of 255 frames of the peer are lost on this carrier.
    Loss(u8),
    /// So many commands from this number on are not coming.
    Void {
        start: u64,
        count: u64,
    },
    /// What the sender believes that the receiver holds: how many instances, and a digest of them.
    Digest {
        count: u32,
        digest: u64,
    },
    /// The receiver holds something else: sixteen parts of its own digest.
    Differ(&'a [u8]),
    /// A large message begins: its transfer, its length and a digest of it.
    Start {
        transfer: u32,
        length: u32,
        digest: u64,
    },
    /// What the receiver holds of a large message: from its beginning on.
    Have {
        transfer: u32,
        prefix: u32,
    },
    /// A piece of a large message.
    Piece {
        transfer: u32,
        offset: u32,
        bytes: &'a [u8],
    },
    Command(CommandItem<'a>),
    State(StateItem<'a>),
    /// Samples in short form; read with the table of instances.
    Compact(&'a [u8]),
}

const ACK: u8 = 0x10;
/// An acknowledgement without a delay.
const PROMPT_ACK: u8 = 0x30;
const LOSS: u8 = 0x20;
const VOID: u8 = 0x21;
const DIGEST: u8 = 0x22;
const DIFFER: u8 = 0x23;
const START: u8 = 0x24;
const HAVE: u8 = 0x25;
const COMMAND: u8 = 0x40;
const STATE: u8 = 0x60;
const COMPACT: u8 = 0x70;
const PIECE: u8 = 0x80;
/// Flags of a command and of a state: a length follows, a lifespan follows.
const LENGTH: u8 = 1;
const LIFESPAN: u8 = 2;
/// Flags of a command: it is a piece; it follows the command just before it; it follows another one.
const IS_PIECE: u8 = 4;
const AFTER_ONE: u8 = 8;
const AFTER_SOME: u8 = 16;

/// The bytes of a digest in parts.
pub(super) const DIFFER_BYTES: usize = 32;

/// The most bytes of bits in an acknowledgement.
pub(super) const ACK_BYTES_MAX: usize = 8;

impl CommandItem<'_> {
    /// How many bytes the item takes without its content and without a length.
    pub(super) fn overhead(&self) -> usize {
        let after = match self.number.wrapping_sub(self.after) {
            1 => 0,
            _ if self.after == 0 => 0,
            distance => varint_len(distance),
        };
        let piece = self.piece.map_or(0, |(length, at)| varint_len(length.into()) + varint_len(at.into()));
        1 + varint_len(self.number) + after + self.lifespan.map_or(0, varint_len) + piece
    }

    /// Appends the item; the last one of a frame needs no length.
    pub(super) fn write(&self, last: bool, out: &mut Vec<u8>) {
        let distance = if self.after == 0 { 0 } else { self.number - self.after };
        let after = match distance {
            0 => 0,
            1 => AFTER_ONE,
            _ => AFTER_SOME,
        };
        let piece = if self.piece.is_some() { IS_PIECE } else { 0 };
        out.push(COMMAND | after | piece | flags(last, self.lifespan));
        put_varint(self.number, out);
        if distance > 1 {
            put_varint(distance, out);
        }
        if let Some(lifespan) = self.lifespan {
            put_varint(lifespan, out);
        }
        if let Some((length, at)) = self.piece {
            put_varint(length.into(), out);
            put_varint(at.into(), out);
        }
        put_content(last, self.bytes, out);
    }
}

impl StateItem<'_> {
    pub(super) fn write(&self, last: bool, out: &mut Vec<u8>) {
        out.push(STATE | self.change << 2 | flags(last, self.lifespan));
        put_varint(self.alias.into(), out);
        put_varint(self.origin.into(), out);
        put_varint(self.sequence, out);
        super::wire::put_zigzag(self.time, out);
        if let Some(lifespan) = self.lifespan {
            put_varint(lifespan, out);
        }
        put_content(last, self.bytes, out);
    }
}

fn flags(last: bool, lifespan: Option<u64>) -> u8 {
    (if last { 0 } else { LENGTH }) | if lifespan.is_some() { LIFESPAN } else { 0 }
}

fn put_content(last: bool, bytes: &[u8], out: &mut Vec<u8>) {
    match last {
        true => out.extend_from_slice(bytes),
        false => put_run(bytes, out),
    }
}

impl<'a> Item<'a> {
    /// Appends the item. `last` says that nothing follows it.
    pub(super) fn write(&self, last: bool, out: &mut Vec<u8>) {
        match self {
            Self::Ack { largest, delay, before } => {
                out.push(if *delay == 0 { PROMPT_ACK } else { ACK } + before.len() as u8);
                out.extend_from_slice(&largest.to_be_bytes());
                if *delay > 0 {
                    out.push(*delay);
                }
                out.extend_from_slice(before);
            }
            Self::Loss(of_255) => out.extend_from_slice(&[LOSS, *of_255]),
            Self::Void { start, count } => {
                out.push(VOID);
                put_varint(*start, out);
                put_varint(*count, out);
            }
            Self::Digest { count, digest } => {
                out.push(DIGEST);
                put_varint((*count).into(), out);
                out.extend_from_slice(&digest.to_be_bytes());
            }
            Self::Differ(parts) => {
                out.push(DIFFER);
                out.extend_from_slice(parts);
            }
            Self::Start { transfer, length, digest } => {
                out.push(START);
                put_varint((*transfer).into(), out);
                put_varint((*length).into(), out);
                out.extend_from_slice(&digest.to_be_bytes());
            }
            Self::Have { transfer, prefix } => {
                out.push(HAVE);
                put_varint((*transfer).into(), out);
                put_varint((*prefix).into(), out);
            }
            Self::Piece { transfer, offset, bytes } => {
                out.push(PIECE | u8::from(!last));
                put_varint((*transfer).into(), out);
                put_varint((*offset).into(), out);
                put_content(last, bytes, out);
            }
            Self::Command(command) => command.write(last, out),
            Self::State(state) => state.write(last, out),
            Self::Compact(bytes) => {
                out.push(COMPACT);
                out.extend_from_slice(bytes);
            }
        }
    }

    /// Takes the next item out of a frame.
    pub(super) fn read(reader: &mut Reader<'a>) -> Result<Self, Malformed> {
        let kind = reader.byte()?;
        Ok(match kind {
            ACK..=0x18 => Self::Ack {
                largest: reader.u16()?,
                delay: reader.byte()?,
                before: reader.take((kind - ACK).into())?,
            },
            PROMPT_ACK..=0x38 => Self::Ack {
                largest: reader.u16()?,
                delay: 0,
                before: reader.take((kind - PROMPT_ACK).into())?,
            },
            LOSS => Self::Loss(reader.byte()?),
            VOID => Self::Void { start: reader.varint()?, count: reader.varint()? },
            DIGEST => Self::Digest { count: reader.varint_u32()?, digest: reader.u64()? },
            DIFFER => Self::Differ(reader.take(DIFFER_BYTES)?),
            START => Self::Start {
                transfer: reader.varint_u32()?,
                length: reader.varint_u32()?,
                digest: reader.u64()?,
            },
            HAVE => Self::Have { transfer: reader.varint_u32()?, prefix: reader.varint_u32()? },
            COMMAND..=0x5f => Self::Command(read_command(kind, reader)?),
            STATE..=0x6b => Self::State(read_state(kind, reader)?),
            COMPACT => Self::Compact(reader.rest()),
            PIECE..=0x81 => Self::Piece {
                transfer: reader.varint_u32()?,
                offset: reader.varint_u32()?,
                bytes: content(kind, reader)?,
            },
            _ => return Err(reader.malformed()),
        })
    }
}

fn content<'a>(kind: u8, reader: &mut Reader<'a>) -> Result<&'a [u8], Malformed> {
    if kind & LENGTH != 0 { reader.run() } else { Ok(reader.rest()) }
}

fn lifespan(kind: u8, reader: &mut Reader<'_>) -> Result<Option<u64>, Malformed> {
    if kind & LIFESPAN != 0 { reader.varint().map(Some) } else { Ok(None) }
}

fn read_command<'a>(kind: u8, reader: &mut Reader<'a>) -> Result<CommandItem<'a>, Malformed> {
    let number = reader.varint()?;
    let distance = match kind & (AFTER_ONE | AFTER_SOME) {
        0 => 0,
        AFTER_ONE => 1,
        AFTER_SOME => reader.varint()?,
        _ => return Err(reader.malformed()),
    };
    // Commands count from 1; one that follows none follows 0.
    let after = match distance {
        0 => 0,
        distance => number.checked_sub(distance).filter(|&after| after > 0).ok_or(reader.malformed())?,
    };
    let lifespan = lifespan(kind, reader)?;
    let piece = match kind & IS_PIECE {
        0 => None,
        _ => Some((reader.varint_u32()?, reader.varint_u32()?)),
    };
    match number {
        0 => Err(reader.malformed()),
        _ => Ok(CommandItem { number, after, lifespan, piece, bytes: content(kind, reader)? }),
    }
}

fn read_state<'a>(kind: u8, reader: &mut Reader<'a>) -> Result<StateItem<'a>, Malformed> {
    Ok(StateItem {
        change: kind >> 2 & 3,
        alias: reader.varint_u32()?,
        origin: reader.varint_u32()?,
        sequence: reader.varint()?,
        time: reader.zigzag()?,
        lifespan: lifespan(kind, reader)?,
        bytes: content(kind, reader)?,
    })
}

#[cfg(test)]
mod tests;
