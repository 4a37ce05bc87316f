//! The seven-part form of UxAS over ZeroMQ: address, content type, descriptor, group, entity, service, payload.

use super::delimited::{DelimitedError, UxasLabel};
use crate::address::Dialect;
use crate::message::{Attributes, Label};
use bytes::Bytes;

/// Why frames are not a message in seven parts.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MultipartError {
    /// The number of frames is wrong.
    #[error("{0} frames, seven are needed")]
    Frames(usize),
    /// A part is wrong.
    #[error(transparent)]
    Part(#[from] DelimitedError),
}

/// Reads label and payload from the frames of one message.
///
/// # Errors
/// [`MultipartError`] when there are not seven frames or one of them is invalid.
pub fn read(frames: &[Bytes]) -> Result<(UxasLabel, Bytes), MultipartError> {
    let [texts @ .., payload] = frames else { return Err(MultipartError::Frames(0)) };
    let texts: &[Bytes; 6] = texts.try_into().map_err(|_| MultipartError::Frames(frames.len()))?;
    let mut fields = [""; 6];
    for (field, text) in fields.iter_mut().zip(texts) {
        *field = std::str::from_utf8(text).map_err(|_| DelimitedError::NotText)?;
    }
    if payload.is_empty() {
        return Err(DelimitedError::NoPayload.into());
    }
    Ok((UxasLabel::from_fields(fields)?, payload.clone()))
}

/// The frames of a message.
pub fn write(label: &Label, payload: Bytes, dialect: Dialect) -> [Bytes; 7] {
    let Attributes { content_type, descriptor, source_group, source } = &label.attributes;
    let mut address = String::new();
    // Writing to a String cannot fail.
    let _ = label.address.write(dialect, &mut address);
    let id = |prefix: &str, number: u64| match dialect {
        Dialect::OpenUxas => Bytes::from(number.to_string()),
        Dialect::Slides => Bytes::from(format!("{prefix}{number}")),
    };
    [
        address.into(),
        Bytes::copy_from_slice(content_type.as_str().as_bytes()),
        Bytes::copy_from_slice(descriptor.as_str().as_bytes()),
        Bytes::copy_from_slice(source_group.as_str().as_bytes()),
        id("eid", source.entity.into()),
        id("sid", source.service.into()),
        payload,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ContentType, EntityId, Name, ServiceId, Source};

    #[test]
    fn seven_frames_go_there_and_back() {
        let source = Source::new(EntityId::new(400).unwrap(), ServiceId::new(37).unwrap());
        let label = Label::broadcast(ContentType::Lmcp, Name::new("afrl.cmasi.Circle").unwrap(), source);
        for (dialect, entity) in [(Dialect::OpenUxas, "400"), (Dialect::Slides, "eid400")] {
            let frames = write(&label, Bytes::from_static(b"$|"), dialect);
            assert_eq!(frames[4], entity);
            let (read, payload) = read(&frames).unwrap();
            assert_eq!((read.source, &payload[..]), (Some(source), &b"$|"[..]));
        }
    }

    #[test]
    fn another_number_of_frames_is_refused() {
        let frame = Bytes::from_static(b"a$lmcp|a||1|1$x");
        assert_eq!(read(&[frame]), Err(MultipartError::Frames(1)));
        assert_eq!(read(&[]), Err(MultipartError::Frames(0)));
    }
}
