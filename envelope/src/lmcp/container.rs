//! The container of a message: `LMCP`, u32 size of the root object, the object, u32 checksum.

use super::error::{DecodeError, DecodeFault, EncodeError, EncodeFault};
use super::object::{Object, Struct};
use super::reader::{Decoded, Header, Reader};
use super::writer::{self, Writer};

/// What every message begins with.
pub const MAGIC: [u8; 4] = *b"LMCP";

/// Bytes before the root object: the magic and the size.
const PREFIX: usize = 8;

/// Bytes of the container: what a message is longer than its root object.
pub const CONTAINER: usize = PREFIX + 4;

/// Decodes a message into an object of whatever type it says.
///
/// Encoding the object again gives the same bytes, but for a checksum of 0, which is computed then.
///
/// # Errors
/// Says what is wrong, at which byte, in which field. [`DecodeError::is_unknown_type`] tells a message
/// of a type or version not declared here, which is to be carried as it is.
pub fn decode(message: &[u8]) -> Result<Box<dyn Object>, DecodeError> {
    decode_root(message, |header, reader| {
        let mut object = (header.type_info().or_else(|fault| reader.fail_header(fault))?.default)();
        reader.allocate(size_of_val(object.as_ref()))?;
        object.decode_fields(reader)?;
        Ok(object)
    })
}

/// Decodes a message that is known to be of type `T`, without a box around it.
///
/// # Errors
/// As [`decode`], and when the message is of another type than `T`, be it a descendant.
pub fn decode_as<T: Struct>(message: &[u8]) -> Result<T, DecodeError> {
    decode_root(message, |header, reader| {
        let info = header.type_info().or_else(|fault| reader.fail_header(fault))?;
        if info != T::TYPE {
            let (expected, found) = (T::TYPE.full_name, info.full_name);
            return reader.fail_header(DecodeFault::Kind { expected, found });
        }
        let mut object = T::default();
        object.decode_fields(reader)?;
        Ok(object)
    })
}

/// The messages that follow one another in some bytes, as a file of them holds them. What is inside a message is not
/// looked at. After an error there are no more: where the next message begins is not known.
pub fn split(bytes: &[u8]) -> impl Iterator<Item = Result<&[u8], DecodeError>> {
    let mut offset = 0;
    std::iter::from_fn(move || {
        let rest = bytes.get(offset..).filter(|rest| !rest.is_empty())?;
        let length = first_length(rest);
        offset = length.as_ref().map_or(bytes.len(), |length| offset + length);
        Some(length.map(|length| &rest[..length]).map_err(|error| error.after(bytes.len() - rest.len())))
    })
}

/// The length of the message that the bytes begin with.
fn first_length(bytes: &[u8]) -> Result<usize, DecodeError> {
    let Some(&[m0, m1, m2, m3, s0, s1, s2, s3]) = bytes.first_chunk::<PREFIX>() else {
        return root(bytes).map(|_| bytes.len());
    };
    let declared = u64::from(u32::from_be_bytes([s0, s1, s2, s3])) + CONTAINER as u64;
    match usize::try_from(declared) {
        _ if [m0, m1, m2, m3] != MAGIC => Err(DecodeError::new(DecodeFault::NotLmcp, 0)),
        Ok(length) if length <= bytes.len() => Ok(length),
        _ => Err(DecodeError::new(DecodeFault::Length { declared, found: bytes.len() }, MAGIC.len())),
    }
}

/// Encodes an object as a message, with its checksum.
///
/// # Errors
/// Names the field that the wire cannot carry.
pub fn encode(object: &dyn Object) -> Result<Vec<u8>, EncodeError> {
    let mut message = Vec::with_capacity(256);
    encode_into(object, &mut message)?;
    Ok(message)
}

/// Encodes an object as a message in place of what `message` holds, so that its memory is used again.
///
/// # Errors
/// Names the field that the wire cannot carry; `message` then holds nothing of use.
pub fn encode_into(object: &dyn Object, message: &mut Vec<u8>) -> Result<(), EncodeError> {
    message.clear();
    message.extend_from_slice(&MAGIC);
    message.extend_from_slice(&[0; 4]);
    Writer::new(message).object(object).map_err(|error| *error)?;
    let size = message.len() - PREFIX;
    let wire = u32::try_from(size).map_err(|_| EncodeError::new(EncodeFault::Size(size)))?;
    message[4..PREFIX].copy_from_slice(&wire.to_be_bytes());
    let sum = checksum(message);
    message.extend_from_slice(&sum.to_be_bytes());
    Ok(())
}

/// The sum of all bytes, as a message ends with it.
pub fn checksum(bytes: &[u8]) -> u32 {
    /// Every second byte of a word.
    const EVEN: u64 = 0x00ff_00ff_00ff_00ff;
    let (words, rest) = bytes.as_chunks::<8>();
    let rest = rest.iter().fold(0, |sum: u32, &byte| sum + u32::from(byte));
    // Four sums of 16 bits side by side: 128 words cannot overflow one of them.
    words.chunks(128).fold(rest, |sum, block| {
        let sums = block.iter().fold(0, |sums, word| {
            let word = u64::from_le_bytes(*word);
            sums + (word & EVEN) + (word >> 8 & EVEN)
        });
        let pairs = (sums & 0x0000_ffff_0000_ffff) + (sums >> 16 & 0x0000_ffff_0000_ffff);
        sum.wrapping_add(pairs as u32).wrapping_add((pairs >> 32) as u32)
    })
}

/// The root object's bytes, once the magic and the length are right; the checksum is not looked at.
#[inline]
fn root(message: &[u8]) -> Result<&[u8], DecodeError> {
    let fail = |fault, offset| Err(DecodeError::new(fault, offset));
    let Some((prefix, rest)) = message.split_first_chunk::<PREFIX>() else {
        let is_lmcp =
            MAGIC.starts_with(&message[..message.len().min(MAGIC.len())]) || message.starts_with(&MAGIC);
        let truncated = DecodeFault::Truncated { needed: PREFIX, left: message.len() };
        return fail(if is_lmcp { truncated } else { DecodeFault::NotLmcp }, 0);
    };
    let [m0, m1, m2, m3, s0, s1, s2, s3] = *prefix;
    if [m0, m1, m2, m3] != MAGIC {
        return fail(DecodeFault::NotLmcp, 0);
    }
    let declared = u64::from(u32::from_be_bytes([s0, s1, s2, s3])) + CONTAINER as u64;
    match rest.split_last_chunk::<4>() {
        Some((root, _)) if declared == message.len() as u64 => Ok(root),
        _ => fail(DecodeFault::Length { declared, found: message.len() }, MAGIC.len()),
    }
}

/// The root object's type and a reader at its first field; the checksum is not looked at.
#[inline]
pub(super) fn read_root_header(message: &[u8]) -> Result<(Header, Reader<'_>), DecodeError> {
    let mut reader = Reader::new(root(message)?, PREFIX);
    match reader.header() {
        Ok(Some(header)) => Ok((header, reader)),
        Ok(None) => Err(DecodeError::new(DecodeFault::NullRoot, PREFIX)),
        Err(error) => Err(*error),
    }
}

/// Checks the container and reads the root object by `read`, which must use it up.
fn decode_root<T>(
    message: &[u8],
    read: impl FnOnce(Header, &mut Reader<'_>) -> Decoded<T>,
) -> Result<T, DecodeError> {
    let (header, mut reader) = read_root_header(message)?;
    verify_checksum(message)?;
    let object = read(header, &mut reader).map_err(|error| *error)?;
    match reader.left() {
        0 => Ok(object),
        left => Err(DecodeError::new(DecodeFault::Trailing(left), message.len() - 4 - left)),
    }
}

fn verify_checksum(message: &[u8]) -> Result<(), DecodeError> {
    let Some((summed, &declared)) = message.split_last_chunk() else { return Ok(()) };
    let declared = u32::from_be_bytes(declared);
    let computed = if declared == 0 { 0 } else { checksum(summed) };
    if declared == computed {
        return Ok(());
    }
    Err(DecodeError::new(DecodeFault::Checksum { declared, computed }, summed.len()))
}

impl Writer<'_> {
    /// An object with what tells its type.
    pub(super) fn object(&mut self, object: &dyn Object) -> writer::Encoded {
        self.put(&object.type_info().header);
        self.nested(|writer| object.encode_fields(writer))
    }

    /// A null in place of an object.
    pub(super) fn null(&mut self) -> writer::Encoded {
        self.put(&[0]);
        Ok(())
    }
}
