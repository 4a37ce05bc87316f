//! Envelopes as bytes: our own header, and the forms that UxAS knows.

pub mod cdr;
pub mod delimited;
pub mod multipart;
pub mod native;
pub mod recording;
pub mod stream;
pub mod zmtp;
