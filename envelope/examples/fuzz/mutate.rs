//! Mistakes.

use fastrand::Rng;

/// Numbers at the edges of what fits.
const EDGES: [u32; 10] = [0, 1, 0x7f, 0x80, 0xff, 0x7fff, 0xffff, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff];

/// How long an input may grow.
const LENGTH_MAX: usize = 64 * 1024;

/// Makes an input: random bytes, or a sample with some mistakes.
pub(crate) fn make(random: &mut Rng, samples: &[Vec<u8>], input: &mut Vec<u8>) {
    input.clear();
    if random.u8(..16) == 0 {
        input.resize(random.usize(..256), 0);
        random.fill(input);
        return;
    }
    input.extend_from_slice(&samples[random.usize(..samples.len())]);
    for _ in 0..random.usize(..8) {
        mistake(random, samples, input);
    }
}

fn mistake(random: &mut Rng, samples: &[Vec<u8>], input: &mut Vec<u8>) {
    if input.is_empty() {
        return;
    }
    let place = random.usize(..input.len());
    let upto = (place + random.usize(1..=32)).min(input.len());
    match random.u8(..9) {
        0 => input[place] ^= 1 << random.u8(..8),
        1 => input[place] = random.u8(..),
        2 => input[place] = EDGES[random.usize(..EDGES.len())] as u8,
        3 => {
            let number = EDGES[random.usize(..EDGES.len())].to_be_bytes();
            let width = if random.bool() { 2 } else { 4 };
            let end = (place + width).min(input.len());
            input[place..end].copy_from_slice(&number[4 - width..4 - width + (end - place)]);
        }
        4 => input.truncate(place),
        5 => drop(input.drain(place..upto)),
        6 if input.len() < LENGTH_MAX => {
            let piece = input[place..upto].repeat(random.usize(1..=16));
            drop(input.splice(place..place, piece));
        }
        7 if input.len() < LENGTH_MAX => {
            let other = &samples[random.usize(..samples.len())];
            let from = random.usize(..other.len());
            let end = (from + random.usize(1..=128)).min(other.len());
            drop(input.splice(place..upto, other[from..end].iter().copied()));
        }
        _ => {
            let byte = random.u8(..);
            input[place..upto].fill(if random.bool() { 0 } else { byte });
        }
    }
}
