//! Samples of a domain as contents of envelopes, and back.

use crate::service::domain::{Arrival, Sending, Xcdr};
use aldis_envelope::codec::cdr::{CdrError, Form as Written, HEADER, KeySchema, Representation, Schema};
use aldis_envelope::description::{Extensibility, Library};
use aldis_envelope::{Change, ContentType, Instance, Message};
use bytes::Bytes;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Topics that are not of UMAA stand under this, so that no mailbox has their name.
const OTHER_TOPICS: &str = "dds::";

/// The address of a topic.
pub(super) fn address_of(topic: &str) -> String {
    if topic.starts_with("UMAA::") { topic.to_owned() } else { format!("{OTHER_TOPICS}{topic}") }
}

/// The topic of an address, if it is one.
pub(super) fn topic_of(address: &str) -> Option<&str> {
    if address.starts_with("UMAA::") { Some(address) } else { address.strip_prefix(OTHER_TOPICS) }
}

/// Whether samples of a type can be read at all.
pub(super) fn has_form(types: &Library, type_name: &str) -> bool {
    types.structure(type_name).is_some() || types.union(type_name).is_some()
}

/// A type made ready for one extensibility.
#[derive(Debug)]
pub(super) struct Form {
    schema: Schema,
    keys: Option<KeySchema>,
    exact: bool,
}

/// The types of a bridge, made ready as they are met.
#[derive(Debug)]
pub(super) struct Forms {
    types: Arc<Library>,
    exact: Arc<BTreeSet<String>>,
    made: BTreeMap<(String, Extensibility), Option<Arc<Form>>>,
}

/// What a change is for the fleet.
#[derive(Debug)]
pub(super) struct Incoming {
    pub(super) content_type: ContentType,
    pub(super) content: Bytes,
    pub(super) instance: Option<Instance>,
}

impl Forms {
    pub(super) fn new(types: Arc<Library>, exact: Arc<BTreeSet<String>>) -> Self {
        Self { types, exact, made: BTreeMap::new() }
    }

    /// A type as an endpoint has it.
    pub(super) fn form(&mut self, type_name: &str, extensibility: Extensibility) -> Option<Arc<Form>> {
        let key = (type_name.to_owned(), extensibility);
        if let Some(made) = self.made.get(&key) {
            return made.clone();
        }
        let schema = Schema::new(&self.types, type_name).ok();
        let schema = schema.map(|schema| match extensibility {
            Extensibility::Final => schema.as_final(),
            _ => schema,
        });
        let exact = self.exact.contains(type_name);
        let form = schema.map(|schema| Arc::new(Form { keys: KeySchema::new(&schema), schema, exact }));
        self.made.insert(key, form.clone());
        form
    }
}

impl Form {
    /// Reads a change.
    pub(super) fn read(&self, arrival: &Arrival) -> Result<Incoming, Box<CdrError>> {
        if !arrival.is_sample {
            let instance = self.keys.as_ref().map(|keys| keys.of_key_sample(&arrival.cdr)).transpose()?;
            return Ok(Incoming { content_type: self.content_type(), content: Bytes::new(), instance });
        }
        let instance =
            self.keys.as_ref().map(|keys| keys.of_sample(&self.schema, &arrival.cdr)).transpose()?;
        let exact = if self.exact { self.schema.to_postcard(&arrival.cdr)? } else { None };
        let (content_type, content) = match exact {
            Some(content) => (ContentType::Umaa, content.into()),
            None => (ContentType::Cdr, arrival.cdr.clone()),
        };
        Ok(Incoming { content_type, content, instance })
    }

    /// What ends of instances are written as: as the samples of the topic are.
    fn content_type(&self) -> ContentType {
        if self.exact { ContentType::Umaa } else { ContentType::Cdr }
    }

    /// Writes a message as a sample; none where its content is of another kind.
    pub(super) fn sample(&self, message: &Message, xcdr: Xcdr) -> Result<Option<Bytes>, Box<CdrError>> {
        let representation = self.representation(xcdr);
        match message.label.attributes.content_type {
            ContentType::Umaa => {
                self.schema.of_postcard(&message.content, representation).map(|cdr| Some(cdr.into()))
            }
            ContentType::Cdr if self.is_written_so(&message.content, representation) => {
                Ok(Some(message.content.clone()))
            }
            ContentType::Cdr => {
                let sample = self.schema.read(&message.content)?;
                if sample.differs {
                    // Written anew it would lose what its type has more.
                    return Ok(None);
                }
                self.schema.write(&sample.value, representation).map(|cdr| Some(cdr.into()))
            }
            _ => Ok(None),
        }
    }

    /// The key of a message's instance, as a sample that holds it alone.
    pub(super) fn key(&self, message: &Message, xcdr: Xcdr) -> Result<Option<Bytes>, Box<CdrError>> {
        let (Some(keys), representation) = (&self.keys, self.representation(xcdr)) else { return Ok(None) };
        let known = message.instance.as_ref().and_then(|instance| instance.key.clone());
        let key = match known {
            Some(key) => Some(key),
            None if message.change != Change::Put => None,
            None => {
                let sample = self.sample(message, xcdr)?;
                sample.map(|cdr| keys.of_sample(&self.schema, &cdr)).transpose()?.and_then(|i| i.key)
            }
        };
        key.map(|key| keys.key_sample(&key, representation).map(Bytes::from)).transpose()
    }

    /// What of a message is written, and how.
    pub(super) fn write(
        &self,
        message: &Message,
        xcdr: Xcdr,
    ) -> Result<Option<(Sending, Bytes)>, Box<CdrError>> {
        let written = match message.change {
            Change::Put => (Sending::Sample, self.sample(message, xcdr)?),
            Change::Dispose => (Sending::Dispose, self.key(message, xcdr)?),
            Change::Unregister => (Sending::Unregister, self.key(message, xcdr)?),
        };
        Ok(written.1.map(|cdr| (written.0, cdr)))
    }

    fn is_written_so(&self, cdr: &[u8], representation: Representation) -> bool {
        let id = cdr.first_chunk::<HEADER>().map(|head| u16::from_be_bytes([head[0], head[1]]));
        id.and_then(Representation::of_id).is_some_and(|found| found.form == representation.form)
    }

    fn representation(&self, xcdr: Xcdr) -> Representation {
        match xcdr {
            Xcdr::V1 => Representation { form: Written::Xcdr1, ..Representation::XCDR1 },
            Xcdr::V2 => Representation::xcdr2(self.schema.extensibility()),
        }
    }
}
