//! What a UxAS peer sends, as messages of this node (uxas-wire, Envelope).

use aldis_envelope::codec::delimited::{DelimitedError, payload_offset, read_head};
use aldis_envelope::{EntityId, Label, Message, Prefix, Source};
use bytes::Bytes;
use std::collections::BTreeMap;
use std::sync::Arc;

/// How many heads are remembered: a peer repeats a few dozen. Beyond it the memory is forgotten whole.
const HEADS_MAX: usize = 4_096;

/// Why a message of a peer does not enter.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Refused {
    /// It is no message.
    #[error(transparent)]
    Malformed(#[from] DelimitedError),
    /// Its source is an entity that this node does not speak for.
    #[error("source {0}: this node does not speak for entity {entity}; name it in `entities`", entity = .0.entity)]
    ForeignEntity(Source),
    /// No import prefix matches its address.
    #[error("no import prefix matches")]
    Filtered,
}

#[derive(Debug, Clone)]
struct Head {
    verdict: Result<Arc<Label>, Refused>,
    assigned: bool,
}

/// Reads the messages of UxAS peers. The head of a message repeats in a stream, so verdicts on heads are kept.
#[derive(Debug)]
pub struct Importer {
    own: Source,
    entities: Vec<EntityId>,
    import: Vec<Prefix>,
    heads: BTreeMap<Bytes, Head>,
    last: Option<(Bytes, Arc<Label>)>,
}

/// A message read, and whether its source had to be assigned.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Imported {
    /// The message, its content untouched.
    pub message: Message,
    /// Whether the peer left the source `0|0`.
    pub assigned: bool,
}

impl Importer {
    /// An importer of the bridge `own` on a node that speaks for `entities`.
    pub fn new(own: Source, entities: Vec<EntityId>, import: Vec<Prefix>) -> Self {
        Self { own, entities, import, heads: BTreeMap::new(), last: None }
    }

    /// Reads a message in delimited form.
    ///
    /// # Errors
    /// [`Refused`]: why the message does not enter.
    pub fn read(&mut self, message: Bytes) -> Result<Imported, Refused> {
        if let Some((head, label)) = &self.last
            && message.starts_with(head)
            && message.len() > head.len()
        {
            let content = message.slice(head.len()..);
            return Ok(Imported { message: Message::new(label.clone(), content), assigned: false });
        }
        let offset = payload_offset(&message)?;
        let head = self.head(&message[..offset]);
        let label = head.verdict?;
        if !head.assigned {
            self.last = Some((Bytes::copy_from_slice(&message[..offset]), label.clone()));
        }
        Ok(Imported { message: Message::new(label, message.slice(offset..)), assigned: head.assigned })
    }

    fn head(&mut self, bytes: &[u8]) -> Head {
        if let Some(head) = self.heads.get(bytes) {
            return head.clone();
        }
        let head = self.judge(bytes);
        if self.heads.len() >= HEADS_MAX {
            self.heads.clear();
        }
        self.heads.insert(Bytes::copy_from_slice(bytes), head.clone());
        head
    }

    fn judge(&self, bytes: &[u8]) -> Head {
        let label = match read_head(bytes) {
            Ok(label) => label,
            Err(why) => return Head { verdict: Err(why.into()), assigned: false },
        };
        let assigned = label.source.is_none();
        let label = label.or_source(self.own);
        let source = label.source();
        let verdict = if !self.entities.contains(&source.entity) {
            Err(Refused::ForeignEntity(source))
        } else if !self.import.iter().any(|prefix| prefix.matches(&label.address)) {
            Err(Refused::Filtered)
        } else {
            Ok(Arc::new(label))
        };
        Head { verdict, assigned }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use aldis_envelope::ServiceId;

    fn importer(import: &[&str]) -> Importer {
        let id = |n| EntityId::new(n).unwrap();
        let own = Source::new(id(400), ServiceId::new(20).unwrap());
        let import = import.iter().map(|p| Prefix::new(p).unwrap()).collect();
        Importer::new(own, vec![id(400), id(100)], import)
    }

    #[test]
    fn origin_ids_stay_and_a_missing_source_is_assigned() {
        let mut importer = importer(&[""]);
        for _ in 0..2 {
            let read = importer.read(Bytes::from_static(b"a.B$lmcp|a.B||100|61$x$y")).unwrap();
            assert_eq!(read.message.label.source().to_string(), "eid100sid61");
            assert_eq!((&read.message.content[..], read.assigned), (&b"x$y"[..], false));
            let read = importer.read(Bytes::from_static(b"a.B$lmcp|a.B||0|0$x")).unwrap();
            assert_eq!(
                (read.message.label.source().to_string().as_str(), read.assigned),
                ("eid400sid20", true)
            );
        }
    }

    #[test]
    fn what_must_not_enter_is_refused_by_name() {
        let mut importer = importer(&["a.", "eid400"]);
        let mut refused = |message: &'static str| importer.read(message.into()).unwrap_err();
        assert!(matches!(refused("a.B$lmcp|a.B||300|61$x"), Refused::ForeignEntity(_)));
        assert!(matches!(refused("b.B$lmcp|b.B||100|61$x"), Refused::Filtered));
        assert!(matches!(refused("a.B$lmcp|a.B||100$x"), Refused::Malformed(_)));
        assert!(importer.read("eid400.sid2$lmcp|a.B||100|61$x".into()).is_ok());
        // The head of the last message alone is no message.
        assert!(matches!(importer.read("eid400.sid2$lmcp|a.B||100|61$".into()), Err(Refused::Malformed(_))));
    }
}
