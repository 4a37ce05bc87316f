//! What Cyclone DDS refuses.

use cyclors::{dds_return_t, dds_strretcode};
use std::ffi::CStr;

/// A call that failed, of what, and why.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{call} of {what}: {cause}")]
pub struct DdsError {
    /// The function of Cyclone DDS.
    pub call: &'static str,
    /// What it was to be done for: a topic, a type, a domain.
    pub what: String,
    /// The cause in words.
    pub cause: String,
}

impl DdsError {
    pub(crate) fn new(call: &'static str, what: impl Into<String>, cause: impl Into<String>) -> Self {
        Self { call, what: what.into(), cause: cause.into() }
    }
}

/// The value that a call returned, or why it failed.
pub(crate) fn check(
    call: &'static str,
    what: impl FnOnce() -> String,
    code: dds_return_t,
) -> Result<dds_return_t, DdsError> {
    if code >= 0 {
        return Ok(code);
    }
    // SAFETY: the function takes any code and returns a text with a terminator that lives as long as the program.
    let text = unsafe { CStr::from_ptr(dds_strretcode(-code)) };
    Err(DdsError::new(call, what(), format!("{} ({code})", text.to_string_lossy())))
}

/// A text for C; one that holds a zero byte is refused.
pub(crate) fn text(call: &'static str, text: &str) -> Result<std::ffi::CString, DdsError> {
    std::ffi::CString::new(text).map_err(|_| DdsError::new(call, format!("{text:?}"), "it holds a zero byte"))
}
