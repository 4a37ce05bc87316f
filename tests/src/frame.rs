//! Frames of the stream form, made by hand: a test that used the product's writer would only compare it with itself.

/// The four sentinels of the stream form, in the order of a frame.
pub const fn sentinels() -> [&'static str; 4] {
    ["+=+=+=+=", "#@#@#@#@", "!%!%!%!%", "?^?^?^?^"]
}

/// A message in delimited form: `address$lmcp|address||entity|service$payload`.
pub fn delimited(address: &str, entity: u64, service: u64, payload: &[u8]) -> Vec<u8> {
    let mut message = format!("{address}$lmcp|{address}||{entity}|{service}$").into_bytes();
    message.extend_from_slice(payload);
    message
}

/// A message in a whole and right frame.
pub fn frame(message: &[u8]) -> Vec<u8> {
    let [head, size_end, body_end, tail] = sentinels();
    let sum = message.iter().fold(0u32, |sum, &byte| sum.wrapping_add(u32::from(byte)));
    let mut frame = format!("{head}{}{size_end}", message.len()).into_bytes();
    frame.extend_from_slice(message);
    frame.extend_from_slice(format!("{body_end}{sum}{tail}").as_bytes());
    frame
}
