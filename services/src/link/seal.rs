//! Authenticated frames: XChaCha20-Poly1305 with the first 8 bytes of its tag.
//!
//! The nonce is never sent: sender, its boot id, the carrier and the number of the frame make it. What else both ends must agree on
//! (the receiver's life) goes in as associated data, so that a frame to an earlier life of the receiver fails.

use aldis_envelope::EntityId;
use chacha20poly1305::aead::{AeadInOut, KeyInit};
use chacha20poly1305::{Tag, XChaCha20Poly1305, XNonce};

/// The bytes of a tag on the wire.
pub const TAG_BYTES: usize = 8;

/// A key that two entities share.
#[derive(Clone, PartialEq, Eq)]
pub struct LinkKey {
    /// Its number; a key with a larger one replaces it. The lowest bit travels in every frame.
    pub number: u32,
    /// The secret, from a good source of chance.
    pub secret: [u8; 32],
}

impl std::fmt::Debug for LinkKey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "LinkKey({}, …)", self.number)
    }
}

/// What makes the nonce of one frame. Never the same twice under one key, because a life numbers its frames.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrameId {
    pub(super) sender: EntityId,
    pub(super) boot: u64,
    pub(super) carrier: u8,
    pub(super) number: u64,
}

impl FrameId {
    fn nonce(self) -> XNonce {
        let mut nonce = [0; 24];
        nonce[..8].copy_from_slice(&self.sender.get().to_be_bytes());
        nonce[8..16].copy_from_slice(&self.boot.to_be_bytes());
        nonce[16..].copy_from_slice(&self.number.to_be_bytes());
        nonce[16] = self.carrier;
        XNonce::from(nonce)
    }
}

fn apply(key: &LinkKey, frame: FrameId, associated: &[u8], bytes: &mut [u8]) -> Option<Tag> {
    XChaCha20Poly1305::new(&key.secret.into())
        .encrypt_inout_detached(&frame.nonce(), associated, bytes.into())
        .ok()
}

/// Encrypts `frame[clear..]` in place and appends the tag; the bytes before `clear` are authenticated too. `context` is what
/// both ends know without its being sent.
pub(super) fn seal(key: &LinkKey, id: FrameId, context: u64, clear: usize, frame: &mut Vec<u8>) {
    let associated = [&frame[..clear], &context.to_be_bytes()].concat();
    if let Some(tag) = apply(key, id, &associated, &mut frame[clear..]) {
        frame.extend_from_slice(&tag[..TAG_BYTES]);
    }
}

/// Decrypts `frame[clear..]`; none where the tag is wrong. The cipher is a stream: to encrypt what is encrypted decrypts it, and to
/// encrypt that again gives the tag of what came.
pub(super) fn open(key: &LinkKey, id: FrameId, context: u64, clear: usize, frame: &[u8]) -> Option<Vec<u8>> {
    let (sealed, told) = frame.split_at_checked(frame.len().checked_sub(TAG_BYTES)?)?;
    let associated = [sealed.get(..clear)?, &context.to_be_bytes()].concat();
    let mut content = sealed[clear..].to_vec();
    apply(key, id, &associated, &mut content)?;
    let mut again = content.clone();
    let tag = apply(key, id, &associated, &mut again)?;
    // All bytes are compared whatever the first says, so that time tells nothing.
    let difference = tag.iter().zip(told).fold(0, |sum, (ours, theirs)| sum | (ours ^ theirs));
    (difference == 0).then_some(content)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn id(number: u64) -> FrameId {
        FrameId { sender: EntityId::new(400).unwrap(), boot: 7, carrier: 1, number }
    }

    #[test]
    fn a_frame_opens_for_its_own_key_number_and_context_alone() {
        let key = LinkKey { number: 1, secret: [9; 32] };
        let mut frame = b"headcontent".to_vec();
        seal(&key, id(5), 33, 4, &mut frame);
        assert_eq!(frame.len(), 11 + TAG_BYTES);
        assert_eq!(open(&key, id(5), 33, 4, &frame).as_deref(), Some(&b"content"[..]));
        assert_eq!(open(&key, id(6), 33, 4, &frame), None);
        assert_eq!(open(&key, id(5), 34, 4, &frame), None);
        assert_eq!(open(&LinkKey { number: 1, secret: [8; 32] }, id(5), 33, 4, &frame), None);
        for at in 0..frame.len() {
            let mut changed = frame.clone();
            changed[at] ^= 1;
            assert_eq!(open(&key, id(5), 33, 4, &changed), None, "byte {at}");
        }
        assert_eq!(open(&key, id(5), 33, 4, &frame[..7]), None);
    }

    #[test]
    fn the_secret_is_not_shown() {
        assert_eq!(format!("{:?}", LinkKey { number: 3, secret: [1; 32] }), "LinkKey(3, …)");
    }
}
