//! The files byte by byte. Integers are little-endian; checksums are CRC-32.
//!
//! ```text
//! segment   header, then frames, each beginning at a multiple of 8
//! header    "AldisJnl" | version u16 | 0 u16 | segment u32 | salt u64 | start u64 | first sequence u64 | 0.. | crc u32     64 bytes
//! frame     crc of what follows to the body u32 | crc of the body u32 | body length u32 | unsynced u32 | sequence u64 | body
//! identity  two slots of 512 bytes: "AldisId1" | version u16 | 0 u16 | 0 u32 | salt u64 | start u64 | 0.. | crc u32   64 bytes
//! ```
//!
//! A frame is a batch. `sequence` counts all frames of the journal without holes; the `unsynced` ones before and including
//! this one were not known to be on disk when it was written. So a hole shows whether it was torn, or damaged later. Both
//! checksums of a frame begin with a number made of salt and segment: neither content nor what a removed file left on the disk
//! passes for a frame. Every later version keeps the first 64 bytes of a file as they are here.

/// The version of the format that this program writes.
pub const VERSION: u16 = 1;

/// Bytes of a header of a segment and of a slot of the identity.
pub(super) const HEADER: usize = 64;
/// Bytes of a frame before its body.
pub(super) const FRAME_HEADER: usize = 24;
/// Where frames begin.
pub(super) const ALIGNMENT: usize = 8;
/// Where the second slot of the identity begins: in a sector of its own, so that no torn write harms both.
pub(super) const SLOT: usize = 512;
/// The file that holds the count of starts.
pub(super) const IDENTITY: &str = "identity.journal";

const SEGMENT_MAGIC: &[u8; 8] = b"AldisJnl";
const IDENTITY_MAGIC: &[u8; 8] = b"AldisId1";

/// The file of a segment.
pub(super) fn segment_name(segment: u32) -> String {
    format!("{segment:08}.journal")
}

/// The segment of a file, if it has the name of one.
pub(super) fn segment_of(file: &str) -> Option<u32> {
    let number: u32 = file.strip_suffix(".journal")?.parse().ok()?;
    (segment_name(number) == file).then_some(number)
}

/// The first 64 bytes of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Header {
    /// The segment's number; zero in the identity.
    pub(super) segment: u32,
    pub(super) salt: u64,
    /// The number of the start that wrote it.
    pub(super) start: u64,
    /// The number of the first frame to come in it; zero in the identity.
    pub(super) first_sequence: u64,
}

/// What the first bytes of a file are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Opened {
    Header(Header),
    Newer(u16),
    Damaged,
}

fn magic(header: &Header) -> &'static [u8; 8] {
    if header.segment == 0 { IDENTITY_MAGIC } else { SEGMENT_MAGIC }
}

impl Header {
    pub(super) fn encode(&self) -> [u8; HEADER] {
        let mut bytes = [0; HEADER];
        bytes[..8].copy_from_slice(magic(self));
        bytes[8..10].copy_from_slice(&VERSION.to_le_bytes());
        bytes[12..16].copy_from_slice(&self.segment.to_le_bytes());
        bytes[16..24].copy_from_slice(&self.salt.to_le_bytes());
        bytes[24..32].copy_from_slice(&self.start.to_le_bytes());
        bytes[32..40].copy_from_slice(&self.first_sequence.to_le_bytes());
        let crc = crc32fast::hash(&bytes[..HEADER - 4]);
        bytes[HEADER - 4..].copy_from_slice(&crc.to_le_bytes());
        bytes
    }

    /// Reads the beginning of a file; `segment` is what its name says, zero for the identity.
    pub(super) fn decode(bytes: &[u8], segment: u32) -> Opened {
        let Some(bytes) = bytes.get(..HEADER) else { return Opened::Damaged };
        if u32_at(bytes, HEADER - 4) != crc32fast::hash(&bytes[..HEADER - 4]) {
            return Opened::Damaged;
        }
        let header = Self {
            segment: u32_at(bytes, 12),
            salt: u64_at(bytes, 16),
            start: u64_at(bytes, 24),
            first_sequence: u64_at(bytes, 32),
        };
        let version = u16::from_le_bytes([bytes[8], bytes[9]]);
        match header.segment == segment && bytes[..8] == magic(&header)[..] {
            false => Opened::Damaged,
            true if version > VERSION => Opened::Newer(version),
            true => Opened::Header(header),
        }
    }
}

/// What the checksums of a segment's frames begin with.
pub(super) fn checksum_seed(salt: u64, segment: u32) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&salt.to_le_bytes());
    hasher.update(&segment.to_le_bytes());
    hasher.finalize()
}

fn checksum(seed: u32, bytes: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new_with_initial(seed);
    hasher.update(bytes);
    hasher.finalize()
}

/// What a frame says of itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Frame {
    pub(super) sequence: u64,
    /// The last frame that was known to be on disk when this one was written.
    pub(super) synced: u64,
}

/// Appends a frame; `body` appends its body.
pub(super) fn encode_frame(buffer: &mut Vec<u8>, seed: u32, frame: Frame, body: impl FnOnce(&mut Vec<u8>)) {
    let begin = buffer.len();
    buffer.extend([0; FRAME_HEADER]);
    body(buffer);
    let body_length = buffer.len() - begin - FRAME_HEADER;
    let body_crc = checksum(seed, &buffer[begin + FRAME_HEADER..]);
    let header = &mut buffer[begin..begin + FRAME_HEADER];
    header[4..8].copy_from_slice(&body_crc.to_le_bytes());
    header[8..12].copy_from_slice(&(body_length as u32).to_le_bytes());
    header[12..16].copy_from_slice(&((frame.sequence - frame.synced) as u32).to_le_bytes());
    header[16..24].copy_from_slice(&frame.sequence.to_le_bytes());
    let crc = checksum(seed, &header[4..]);
    header[..4].copy_from_slice(&crc.to_le_bytes());
    buffer.resize(buffer.len().next_multiple_of(ALIGNMENT), 0);
}

/// What stands at a place where a frame may begin.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Parsed<'a> {
    /// A whole frame, its body, and its bytes with the padding.
    Frame(Frame, &'a [u8], usize),
    /// No frame; the next may begin after so many bytes.
    Bad(usize),
    /// So many bytes are needed to tell.
    Short(usize),
}

/// Reads what stands at the beginning of `buffer`, where `left` bytes are left in the file.
pub(super) fn parse(buffer: &[u8], left: usize, seed: u32) -> Parsed<'_> {
    if left < FRAME_HEADER {
        return Parsed::Bad(left);
    }
    if buffer.len() < FRAME_HEADER {
        return Parsed::Short(FRAME_HEADER);
    }
    let (sequence, unsynced) = (u64_at(buffer, 16), u64::from(u32_at(buffer, 12)));
    if u32_at(buffer, 0) != checksum(seed, &buffer[4..FRAME_HEADER]) || unsynced > sequence {
        return Parsed::Bad(ALIGNMENT);
    }
    let whole = FRAME_HEADER.saturating_add(u32_at(buffer, 8) as usize);
    // The padding of the last frame may be cut off without harm.
    let padded = whole.next_multiple_of(ALIGNMENT).min(left.max(whole));
    if whole > left {
        return Parsed::Bad(ALIGNMENT);
    }
    let Some(body) = buffer.get(FRAME_HEADER..whole) else { return Parsed::Short(padded) };
    if u32_at(buffer, 4) != checksum(seed, body) {
        // The length is vouched for by the checksum of the header: the next frame begins behind.
        return Parsed::Bad(padded);
    }
    Parsed::Frame(Frame { sequence, synced: sequence - unsynced }, body, padded)
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from(u32_at(bytes, at)) | u64::from(u32_at(bytes, at + 4)) << 32
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Frame = Frame { sequence: 7, synced: 5 };

    fn frame(body: &[u8]) -> Vec<u8> {
        let mut buffer = Vec::new();
        encode_frame(&mut buffer, 9, FRAME, |buffer| buffer.extend_from_slice(body));
        buffer
    }

    #[test]
    fn a_frame_is_read_again_and_every_flipped_bit_is_seen() {
        let whole = frame(b"hello");
        assert_eq!(parse(&whole, whole.len(), 9), Parsed::Frame(FRAME, b"hello", 32));
        assert!(matches!(parse(&whole, whole.len(), 8), Parsed::Bad(_)), "another segment's");
        for bit in 0..(FRAME_HEADER + 5) * 8 {
            let mut bent = whole.clone();
            bent[bit / 8] ^= 1 << (bit % 8);
            assert!(matches!(parse(&bent, bent.len(), 9), Parsed::Bad(_)), "bit {bit}");
        }
    }

    #[test]
    fn no_frame_reaches_beyond_its_file() {
        let whole = frame(b"hello");
        for length in 0..FRAME_HEADER + 5 {
            assert!(matches!(parse(&whole[..length], length, 9), Parsed::Bad(_)), "{length}");
        }
        assert_eq!(
            parse(&whole[..FRAME_HEADER + 5], FRAME_HEADER + 5, 9),
            Parsed::Frame(FRAME, b"hello", 29)
        );
        assert_eq!(parse(&whole[..10], 100, 9), Parsed::Short(FRAME_HEADER));
        assert_eq!(parse(&whole[..26], 100, 9), Parsed::Short(32));
    }

    #[test]
    fn headers_say_what_they_are() {
        let header = Header { segment: 3, salt: 1, start: 2, first_sequence: 9 };
        assert_eq!(Header::decode(&header.encode(), 3), Opened::Header(header));
        assert_eq!(Header::decode(&header.encode(), 4), Opened::Damaged, "under another name");
        assert_eq!(Header::decode(&header.encode()[..63], 3), Opened::Damaged);
        let mut newer = header.encode();
        newer[8] = 2;
        assert_eq!(Header::decode(&newer, 3), Opened::Damaged, "a flipped bit is no new version");
        let crc = crc32fast::hash(&newer[..HEADER - 4]);
        newer[HEADER - 4..].copy_from_slice(&crc.to_le_bytes());
        assert_eq!(Header::decode(&newer, 3), Opened::Newer(2));
    }

    #[test]
    fn names_of_segments_are_read_as_they_are_written() {
        assert_eq!(segment_of(&segment_name(7)), Some(7));
        for other in ["7.journal", "00000007", "identity.journal", "+0000007.journal", "00000007.journal.gz"]
        {
            assert_eq!(segment_of(other), None, "{other}");
        }
    }
}
