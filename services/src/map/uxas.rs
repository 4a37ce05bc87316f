//! What a UxAS peer sends, as messages of this node (uxas-wire, Envelope).

use aldis_envelope::codec::delimited::{DelimitedError, UxasLabel, payload_offset, read_head};
use aldis_envelope::codec::multipart::{self, MultipartError};
use aldis_envelope::{ContentType, EntityId, Instance, Label, Message, Prefix, Source, lmcp};
use bytes::Bytes;
use std::collections::BTreeMap;
use std::sync::Arc;

/// How many heads are remembered: a peer repeats a few dozen. Beyond it the memory is forgotten whole.
const HEADS_MAX: usize = 4_096;

/// How many instances are remembered, likewise.
const INSTANCES_MAX: usize = 4_096;

/// Why a message of a peer does not enter.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Refused {
    /// It is no message.
    #[error(transparent)]
    Malformed(#[from] DelimitedError),
    /// It is no message in seven parts.
    #[error(transparent)]
    Parts(MultipartError),
    /// Its source is an entity that this node does not speak for.
    #[error("source {0}: this node does not speak for entity {entity}; name it in `entities`", entity = .0.entity)]
    ForeignEntity(Source),
    /// No import prefix matches its address.
    #[error("no import prefix matches")]
    Filtered,
}

#[derive(Debug, Clone)]
struct Head {
    verdict: Result<Accepted, Refused>,
    assigned: bool,
    rewritten: bool,
}

/// A head that enters.
#[derive(Debug, Clone)]
struct Accepted {
    label: Arc<Label>,
    /// Whether its type has a natural key, which makes it an instance.
    keyed: bool,
}

/// Reads the messages of UxAS peers. The head of a message repeats in a stream, so verdicts on heads are kept.
#[derive(Debug)]
pub struct Importer {
    own: Source,
    entities: Vec<EntityId>,
    import: Vec<Prefix>,
    heads: BTreeMap<Bytes, Head>,
    instances: BTreeMap<i64, Arc<Instance>>,
    last: Option<(Bytes, Accepted)>,
    self_generated: bool,
    /// Kept for its memory.
    scratch: Vec<u8>,
}

/// A message read, and whether its source had to be assigned.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Imported {
    /// The message, its content untouched.
    pub message: Message,
    /// Whether the peer left the source `0|0`.
    pub assigned: bool,
    /// Whether its source was replaced by the bridge's own.
    pub rewritten: bool,
}

impl Importer {
    /// An importer of the bridge `own` on a node that speaks for `entities`.
    pub fn new(own: Source, entities: Vec<EntityId>, import: Vec<Prefix>) -> Self {
        Self {
            own,
            entities,
            import,
            heads: BTreeMap::new(),
            instances: BTreeMap::new(),
            last: None,
            self_generated: false,
            scratch: Vec::new(),
        }
    }

    /// The same importer, which makes everything its own: what `ConsiderSelfGenerated` does in OpenUxAS.
    pub fn self_generated(self) -> Self {
        Self { self_generated: true, ..self }
    }

    /// Reads a message in delimited form.
    ///
    /// # Errors
    /// [`Refused`]: why the message does not enter.
    pub fn read(&mut self, message: Bytes) -> Result<Imported, Refused> {
        if let Some((head, accepted)) = &self.last
            && message.starts_with(head)
            && message.len() > head.len()
        {
            let (content, accepted) = (message.slice(head.len()..), accepted.clone());
            return Ok(self.imported(&accepted, content));
        }
        let offset = payload_offset(&message)?;
        let head = self.head(&message[..offset]);
        let accepted = head.verdict?;
        if !head.assigned && !head.rewritten {
            self.last = Some((Bytes::copy_from_slice(&message[..offset]), accepted.clone()));
        }
        let (assigned, rewritten) = (head.assigned, head.rewritten);
        Ok(Imported { assigned, rewritten, ..self.imported(&accepted, message.slice(offset..)) })
    }

    /// Reads a message in seven parts.
    ///
    /// # Errors
    /// [`Refused`]: why the message does not enter.
    pub fn read_parts(&mut self, frames: &[Bytes]) -> Result<Imported, Refused> {
        let [address, attributes @ .., payload] = frames else {
            return Err(Refused::Parts(MultipartError::Frames(frames.len())));
        };
        if frames.len() != 7 {
            return Err(Refused::Parts(MultipartError::Frames(frames.len())));
        }
        if payload.is_empty() {
            return Err(Refused::Parts(DelimitedError::NoPayload.into()));
        }
        // The head as the delimited form has it finds what is remembered of it. A part that holds a delimiter makes a head
        // with more of them than any good one, so that the two are never taken for each other.
        let mut head = std::mem::take(&mut self.scratch);
        head.clear();
        head.extend_from_slice(address);
        head.push(b'$');
        for (place, part) in attributes.iter().enumerate() {
            if place > 0 {
                head.push(b'|');
            }
            head.extend_from_slice(part);
        }
        head.push(b'$');
        let judged = match self.heads.get(head.as_slice()) {
            Some(known) => known.clone(),
            None => {
                let label = multipart::read(frames).map(|(label, _)| label).map_err(Refused::Parts);
                self.remember(&head, label)
            }
        };
        self.scratch = head;
        let accepted = judged.verdict?;
        let (assigned, rewritten) = (judged.assigned, judged.rewritten);
        Ok(Imported { assigned, rewritten, ..self.imported(&accepted, payload.clone()) })
    }

    fn imported(&mut self, accepted: &Accepted, content: Bytes) -> Imported {
        Imported { message: self.message(accepted, content), assigned: false, rewritten: false }
    }

    fn message(&mut self, accepted: &Accepted, content: Bytes) -> Message {
        let label = accepted.label.clone();
        let key = if accepted.keyed { lmcp::natural_key(label.descriptor(), &content) } else { None };
        Message { instance: key.map(|key| self.instance(key)), ..Message::new(label, content) }
    }

    fn instance(&mut self, key: i64) -> Arc<Instance> {
        if self.instances.len() >= INSTANCES_MAX {
            self.instances.clear();
        }
        self.instances.entry(key).or_insert_with(|| Arc::new(Instance::of_number(key))).clone()
    }

    fn head(&mut self, bytes: &[u8]) -> Head {
        if let Some(head) = self.heads.get(bytes) {
            return head.clone();
        }
        let label = read_head(bytes).map_err(Refused::Malformed);
        self.remember(bytes, label)
    }

    fn remember(&mut self, bytes: &[u8], label: Result<UxasLabel, Refused>) -> Head {
        let head = self.judge(label);
        if self.heads.len() >= HEADS_MAX {
            self.heads.clear();
        }
        self.heads.insert(Bytes::copy_from_slice(bytes), head.clone());
        head
    }

    fn judge(&self, label: Result<UxasLabel, Refused>) -> Head {
        let mut label = match label {
            Ok(label) => label,
            Err(why) => return Head { verdict: Err(why), assigned: false, rewritten: false },
        };
        let assigned = label.source.is_none();
        let rewritten = self.self_generated && !assigned;
        if rewritten {
            label.source = None;
        }
        let label = label.or_source(self.own);
        let source = label.source();
        let verdict = if !self.entities.contains(&source.entity) {
            Err(Refused::ForeignEntity(source))
        } else if !self.import.iter().any(|prefix| prefix.matches(&label.address)) {
            Err(Refused::Filtered)
        } else {
            let keyed = label.attributes.content_type == ContentType::Lmcp
                && lmcp::type_of(label.descriptor()).is_some_and(|info| lmcp::key_of(info).is_some());
            Ok(Accepted { label: Arc::new(label), keyed })
        };
        Head { verdict, assigned, rewritten }
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
    fn a_type_with_a_natural_key_is_an_instance() {
        let mut importer = importer(&[""]);
        let base = lmcp::cmasi::EntityState { id: 7, ..Default::default() };
        let state = lmcp::cmasi::AirVehicleState { base, ..Default::default() };
        let mut instance = |content: &[u8]| {
            let head = b"afrl.cmasi.AirVehicleState$lmcp|afrl.cmasi.AirVehicleState||100|61$".as_slice();
            importer
                .read([head, content].concat().into())
                .unwrap()
                .message
                .instance
                .map(|instance| instance.hash)
        };
        assert_eq!(instance(&lmcp::encode(&state).unwrap()), Some(Instance::of_number(7).hash));
        assert_eq!(instance(b"garbage is carried without a key"), None);
    }

    #[test]
    fn seven_parts_are_read_as_the_delimited_form_is() {
        let mut importer = importer(&["a."]);
        let parts = |texts: [&'static str; 7]| texts.map(Bytes::from).to_vec();
        for _ in 0..2 {
            let read = importer.read_parts(&parts(["a.B", "lmcp", "a.B", "", "100", "61", "x$y|"])).unwrap();
            let delimited = importer.read(Bytes::from_static(b"a.B$lmcp|a.B||100|61$x$y|")).unwrap();
            assert_eq!(read, delimited);
            assert!(importer.read_parts(&parts(["a.B", "lmcp", "a.B", "", "0", "0", "x"])).unwrap().assigned);
        }
        let mut refused = |texts| importer.read_parts(&parts(texts)).unwrap_err();
        assert!(matches!(refused(["a.B", "lmcp", "a.B", "", "300", "61", "x"]), Refused::ForeignEntity(_)));
        assert!(matches!(refused(["b.B", "lmcp", "b.B", "", "100", "61", "x"]), Refused::Filtered));
        assert!(matches!(refused(["a.B", "lmcp", "a.B", "", "100", "61", ""]), Refused::Parts(_)));
        // Delimiters inside a part are no way to write another head.
        assert!(matches!(refused(["a.B$lmcp", "a.B", "", "100", "61", "", "x"]), Refused::Parts(_)));
        assert!(matches!(refused(["a.B", "lmcp|a.B", "", "100", "61", "", "x"]), Refused::Parts(_)));
        assert!(importer.read_parts(&[]).is_err() && importer.read_parts(&parts([""; 7])[..6]).is_err());
    }

    #[test]
    fn a_bridge_may_make_everything_its_own() {
        let mut importer = importer(&[""]).self_generated();
        for _ in 0..2 {
            let read = importer.read(Bytes::from_static(b"a.B$lmcp|a.B||300|61$x")).unwrap();
            assert_eq!(read.message.label.source().to_string(), "eid400sid20");
            assert!(read.rewritten && !read.assigned);
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
