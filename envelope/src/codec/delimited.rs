//! The delimited form of UxAS: `address$contentType|descriptor|sourceGroup|sourceEntityId|sourceServiceId$payload`.

use crate::address::{Address, Dialect};
use crate::id::{EntityId, ServiceId, Source, decimal};
use crate::message::{Attributes, Label};
use crate::name::{ContentType, Descriptor, Group, NameError, shortened};
use std::io::Write;

/// Why bytes are not a message in delimited form.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DelimitedError {
    /// One of the two `$` is missing.
    #[error("no `$` after the {0}")]
    NoDelimiter(&'static str),
    /// There are not exactly five attributes.
    #[error("{0} attributes between the `$`, five are needed")]
    Attributes(usize),
    /// The payload is empty.
    #[error("the payload is empty")]
    NoPayload,
    /// Address or attributes are not UTF-8.
    #[error("address or attributes are not UTF-8")]
    NotText,
    /// A text cannot stand in an envelope.
    #[error(transparent)]
    Name(#[from] NameError),
    /// The source ids are no ids.
    #[error("source `{entity}|{service}`: {why}")]
    Source {
        /// The entity's text, shortened.
        entity: String,
        /// The service's text, shortened.
        service: String,
        /// What is wrong.
        why: String,
    },
}

/// Address and attributes as a UxAS peer wrote them. The source is none where the peer left it `0|0`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UxasLabel {
    /// Where the message goes.
    pub address: Address,
    /// What the content is written in.
    pub content_type: ContentType,
    /// What the content is.
    pub descriptor: Descriptor,
    /// Free text, often empty.
    pub source_group: Group,
    /// Who sent it; none for `0|0`, which usual OpenUxAS clients write.
    pub source: Option<Source>,
}

impl UxasLabel {
    /// The label with a source in place of a missing one.
    pub fn or_source(self, assigned: Source) -> Label {
        let source = self.source.unwrap_or(assigned);
        let Self { address, content_type, descriptor, source_group, .. } = self;
        Label { address, attributes: Attributes { content_type, descriptor, source_group, source } }
    }

    /// A label from the texts of its six fields, in the order of the wire.
    pub(super) fn from_fields(fields: [&str; 6]) -> Result<Self, DelimitedError> {
        let [address, content_type, descriptor, group, entity, service] = fields;
        Ok(Self {
            address: Address::new(address)?,
            content_type: ContentType::new(content_type)?,
            descriptor: Descriptor::new(descriptor)?,
            source_group: Group::new(group)?,
            source: source(entity, service)?,
        })
    }
}

/// Source ids in either dialect: `400` or `eid400`, `37` or `sid37`.
fn source(entity: &str, service: &str) -> Result<Option<Source>, DelimitedError> {
    let error =
        |why: String| DelimitedError::Source { entity: shortened(entity), service: shortened(service), why };
    let number = |text: &str, prefix: &str| {
        decimal(text.strip_prefix(prefix).unwrap_or(text)).map_err(|e| error(e.to_string()))
    };
    let (e, s) = (number(entity, "eid")?, number(service, "sid")?);
    if (e, s) == (0, 0) {
        return Ok(None);
    }
    let entity = EntityId::new(e).map_err(|e| error(e.to_string()))?;
    let service = ServiceId::new(s).map_err(|e| error(e.to_string()))?;
    Ok(Some(Source::new(entity, service)))
}

/// Where the payload begins: after the second `$`. The bytes before it are the head, which a stream repeats.
///
/// # Errors
/// [`DelimitedError`] when a `$` is missing or nothing follows the second.
pub fn payload_offset(message: &[u8]) -> Result<usize, DelimitedError> {
    let after = |from: usize| message[from..].iter().position(|&b| b == b'$').map(|at| from + at + 1);
    let attributes = after(0).ok_or(DelimitedError::NoDelimiter("address"))?;
    let payload = after(attributes).ok_or(DelimitedError::NoDelimiter("attributes"))?;
    if payload == message.len() { Err(DelimitedError::NoPayload) } else { Ok(payload) }
}

/// Reads a head: the bytes of a message before [`payload_offset`].
///
/// # Errors
/// [`DelimitedError`] when it has not five attributes or one of its texts is invalid.
pub fn read_head(head: &[u8]) -> Result<UxasLabel, DelimitedError> {
    let text = std::str::from_utf8(head).map_err(|_| DelimitedError::NotText)?;
    let (address, rest) = text.split_once('$').ok_or(DelimitedError::NoDelimiter("address"))?;
    let attributes = rest.strip_suffix('$').ok_or(DelimitedError::NoDelimiter("attributes"))?;
    let count = attributes.split('|').count();
    let mut fields = attributes.split('|');
    let mut next = || fields.next().ok_or(DelimitedError::Attributes(count));
    let six = [address, next()?, next()?, next()?, next()?, next()?];
    if count != 5 {
        return Err(DelimitedError::Attributes(count));
    }
    UxasLabel::from_fields(six)
}

/// Appends a head in a dialect.
pub fn write_head(label: &Label, dialect: Dialect, out: &mut Vec<u8>) {
    let Attributes { content_type, descriptor, source_group, source } = &label.attributes;
    let (eid, sid) = match dialect {
        Dialect::OpenUxas => ("", ""),
        Dialect::Slides => ("eid", "sid"),
    };
    let mut address = String::new();
    // Writing to a String or a Vec cannot fail.
    let _ = label.address.write(dialect, &mut address);
    let (entity, service) = (source.entity, source.service);
    let _ = write!(out, "{address}${content_type}|{descriptor}|{source_group}|{eid}{entity}|{sid}{service}$");
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(message: &[u8]) -> Result<UxasLabel, DelimitedError> {
        read_head(&message[..payload_offset(message)?])
    }

    #[test]
    fn a_payload_may_hold_every_delimiter() {
        let message = b"afrl.cmasi.Circle$lmcp|afrl.cmasi.Circle||100|61$a$b|c$";
        assert_eq!(&message[payload_offset(message).unwrap()..], b"a$b|c$");
        let label = read(message).unwrap();
        assert_eq!(label.source.unwrap().to_string(), "eid100sid61");
        assert_eq!(label.address.to_string(), "afrl.cmasi.Circle");
    }

    #[test]
    fn both_dialects_write_what_both_read() {
        for (dialect, text) in [
            (Dialect::OpenUxas, "eid1.sid2$lmcp|x|g|400|37$"),
            (Dialect::Slides, "eid1sid2$lmcp|x|g|eid400|sid37$"),
        ] {
            let label = read_head(text.as_bytes()).unwrap();
            let mut out = Vec::new();
            write_head(
                &label.or_source(Source::new(EntityId::new(9).unwrap(), ServiceId::NODE)),
                dialect,
                &mut out,
            );
            assert_eq!(String::from_utf8(out).unwrap(), text);
        }
    }

    #[test]
    fn a_missing_source_is_assigned_and_a_wrong_one_refused() {
        assert_eq!(read(b"a$lmcp|a||0|0$x").unwrap().source, None);
        for source in ["0|5", "5|0", "x|1", "281474976710656|1", "1|4294967296", "-1|1"] {
            let message = format!("a$lmcp|a||{source}$x");
            assert!(matches!(read(message.as_bytes()), Err(DelimitedError::Source { .. })), "{source}");
        }
    }

    #[test]
    fn each_malformation_has_its_name() {
        for (message, error) in [
            (&b""[..], "no `$` after the address"),
            (b"a", "no `$` after the address"),
            (b"a$lmcp|a||1|1", "no `$` after the attributes"),
            (b"a$lmcp|a||1|1$", "the payload is empty"),
            (b"a$lmcp|a|1|1$x", "4 attributes between the `$`, five are needed"),
            (b"a$lmcp|a|||1|1$x", "6 attributes between the `$`, five are needed"),
            (b"$lmcp|a||1|1$x", "the name is empty"),
            (b"a$|a||1|1$x", "the content type is empty"),
            (b"a$lmcp|||1|1$x", "the descriptor is empty"),
            (b"a\xff$lmcp|a||1|1$x", "address or attributes are not UTF-8"),
        ] {
            assert_eq!(read(message).unwrap_err().to_string(), error);
        }
    }
}
