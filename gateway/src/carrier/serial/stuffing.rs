//! Frames as runs of bytes without a zero.

/// What a block counts when it is full: 254 bytes that are not zero.
const FULL: usize = 254;

/// Appends a frame with its check sum, stuffed, and the zero that ends it.
pub(super) fn stuff(frame: &[u8], out: &mut Vec<u8>) {
    let sum = crc32fast::hash(frame).to_le_bytes();
    let mut place = out.len();
    out.push(0);
    for &byte in frame.iter().chain(&sum) {
        if byte != 0 {
            out.push(byte);
        }
        if byte == 0 || out.len() - place - 1 == FULL {
            out[place] = (out.len() - place) as u8;
            place = out.len();
            out.push(0);
        }
    }
    out[place] = (out.len() - place) as u8;
    out.push(0);
}

/// Undoes the stuffing of what stood before a zero. None where it is none of ours.
fn unstuff(mut stuffed: &[u8]) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(stuffed.len());
    while let Some((&length, rest)) = stuffed.split_first() {
        let (block, rest) = rest.split_at_checked(usize::from(length).checked_sub(1)?)?;
        out.extend_from_slice(block);
        if usize::from(length) <= FULL && !rest.is_empty() {
            out.push(0);
        }
        stuffed = rest;
    }
    let (frame, sum) = out.split_last_chunk::<4>()?;
    let length = (crc32fast::hash(frame).to_le_bytes() == *sum).then_some(frame.len())?;
    out.truncate(length);
    Some(out)
}

/// Finds frames in a stream of bytes.
#[derive(Debug)]
pub(super) struct Finder {
    /// What came since the last zero.
    pending: Vec<u8>,
    limit: usize,
    /// What came since the last zero is too long to be a frame.
    too_long: bool,
}

impl Finder {
    /// Finds frames of at most `mtu` bytes.
    pub(super) fn new(mtu: usize) -> Self {
        let whole = mtu + 4;
        Self { pending: Vec::new(), limit: whole + whole / FULL + 2, too_long: false }
    }

    /// Takes bytes in; the frames that they end, and how many stretches between zeros were none.
    pub(super) fn take(&mut self, bytes: &[u8]) -> (Vec<Vec<u8>>, u64) {
        let (mut frames, mut bad) = (Vec::new(), 0);
        for &byte in bytes {
            if byte != 0 {
                self.too_long |= self.pending.len() >= self.limit;
                if !self.too_long {
                    self.pending.push(byte);
                }
                continue;
            }
            let pending = std::mem::take(&mut self.pending);
            let too_long = std::mem::take(&mut self.too_long);
            match unstuff(&pending).filter(|_| !too_long) {
                Some(frame) => frames.push(frame),
                // Two zeros in a row are no harm.
                None => bad += u64::from(!pending.is_empty()),
            }
        }
        (frames, bad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stuffed(frame: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        stuff(frame, &mut out);
        out
    }

    #[test]
    fn frames_come_back_whatever_is_in_them_and_however_they_are_cut() {
        let mut random = fastrand::Rng::with_seed(1);
        let mut stream = Vec::new();
        let frames: Vec<Vec<u8>> = (0..300)
            .map(|length| {
                // Long runs without a zero meet the edge of a block.
                let zeros = [0, 1, 8][length % 3];
                (0..length * 4).map(|_| if random.u8(0..10) < zeros { 0 } else { random.u8(1..) }).collect()
            })
            .collect();
        frames.iter().for_each(|frame| stuff(frame, &mut stream));
        assert!(stuffed(&frames[299]).iter().rev().skip(1).all(|byte| *byte != 0));
        let mut finder = Finder::new(1_200);
        let mut found = Vec::new();
        while !stream.is_empty() {
            let rest = stream.split_off(random.usize(1..50).min(stream.len()));
            let (frames, bad) = finder.take(&stream);
            assert_eq!(bad, 0);
            found.extend(frames);
            stream = rest;
        }
        assert_eq!(found, frames);
    }

    #[test]
    fn what_the_line_has_changed_is_dropped_and_the_next_frame_is_found() {
        let mut finder = Finder::new(64);
        for place in 0..20 {
            let mut broken = stuffed(b"a frame of some bytes");
            broken[place] ^= 4;
            broken.extend(stuffed(b"whole"));
            let (frames, bad) = finder.take(&broken);
            assert!(bad >= 1, "{place}");
            assert_eq!(frames.last().map(Vec::as_slice), Some(&b"whole"[..]), "{place}");
        }
        let noise = vec![7; 100_000];
        assert_eq!(finder.take(&noise), (Vec::new(), 0));
        assert!(finder.pending.len() <= finder.limit, "nothing grows without a limit");
        assert_eq!(finder.take(&[0]), (Vec::new(), 1));
    }
}
