//! One topic: its samples as envelopes, and envelopes as its samples.

use super::error::{ExportError, ImportError, malformed};
use super::sender::{Sender, address_of};
use aldis_envelope::codec::cdr::{HEADER, KeySchema, Representation, Schema};
use aldis_envelope::description::{Extensibility, Library};
use aldis_envelope::name::NameError;
use aldis_envelope::umaa::{self, TopicInfo};
use aldis_envelope::{Change, ContentType, Instance, KeyHash, Label, Message, Name, Wall};
use bytes::Bytes;
use std::collections::BTreeMap;
use std::sync::Arc;

/// How many instances' keys are remembered: 1 000 instances of 48 bytes are 0.1 MB, so this is 10 MB at the most.
const KEYS_MAX: usize = 100_000;

/// A writer on the bus, by its GUID.
pub type Writer = [u8; 16];

/// What a taken sample holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Body {
    /// All of it, header included.
    Sample(Bytes),
    /// Its key alone, header included.
    Key(Bytes),
    /// Nothing but its key hash.
    Hash(KeyHash),
}

/// A sample that was taken from the bus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Taken {
    /// Who has written it.
    pub writer: Writer,
    /// When, by the writer's clock. It stays: the newer of two decides.
    pub source_time: Wall,
    /// What it does to its instance.
    pub change: Change,
    /// What it holds.
    pub body: Body,
}

/// A message for the fleet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Imported {
    /// The message.
    pub message: Message,
    /// When it was written, by its writer's clock.
    pub source_time: Wall,
}

/// A sample for the bus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Given {
    /// What it does to its instance.
    pub change: Change,
    /// All of it where it is put, its key alone otherwise; header included.
    pub bytes: Bytes,
}

/// A type as it is written on the bus: appendable or final.
#[derive(Debug, Clone)]
struct Shape {
    schema: Schema,
    keys: Option<KeySchema>,
}

impl Shape {
    fn new(schema: Schema) -> Self {
        Self { keys: KeySchema::new(&schema), schema }
    }
}

/// A topic that is bridged.
#[derive(Debug, Clone)]
pub struct TopicMap {
    name: String,
    /// The labels of contents that are exactly ours, and of all others.
    ours: Arc<Label>,
    theirs: Arc<Label>,
    /// As described, and with everything final. None: the type is not known.
    shapes: Option<[Shape; 2]>,
    info: Option<&'static TopicInfo>,
    keys: BTreeMap<KeyHash, Bytes>,
}

impl TopicMap {
    /// A topic of Support Operations in version 5.2.1 becomes `umaa` contents, every other stays `cdr`. A type that the library lacks or
    /// that is mutable is carried as it is.
    ///
    /// # Errors
    /// [`NameError`] where the topic's name is none that an envelope can have.
    pub fn new(topic: &str, type_name: &str, library: &Library, sender: &Sender) -> Result<Self, NameError> {
        let name = Name::new(&address_of(topic))?;
        let schema = Schema::new(library, type_name).ok();
        let shapes = schema.map(|schema| {
            let closed = schema.as_final();
            [Shape::new(schema), Shape::new(closed)]
        });
        Ok(Self {
            name: topic.to_owned(),
            ours: sender.label(ContentType::Umaa, &name),
            theirs: sender.label(ContentType::Cdr, &name),
            shapes,
            info: umaa::topic(topic).filter(|info| info.type_name == type_name),
            keys: BTreeMap::new(),
        })
    }

    /// The same for a type that has its name of Support Operations and is another: all of it stays `cdr`.
    pub fn as_it_comes(self) -> Self {
        Self { info: None, ..self }
    }

    /// The topic's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// How many instances are remembered with their keys.
    pub fn instances(&self) -> usize {
        self.keys.len()
    }

    /// Makes an envelope of a sample.
    ///
    /// # Errors
    /// [`ImportError`] where the sample is malformed, or ends an instance of which nothing is known.
    pub fn import(&mut self, taken: &Taken) -> Result<Imported, ImportError> {
        let (label, instance, content) = match &taken.body {
            Body::Sample(bytes) => {
                let (label, instance, content) = self.sample(bytes)?;
                // A whole sample may also end its instance; then its key is all that counts.
                let content = if taken.change == Change::Put { content } else { Bytes::new() };
                (label, instance, content)
            }
            Body::Key(bytes) => (self.ending(), Some(self.key(bytes)?), Bytes::new()),
            Body::Hash(hash) => (self.ending(), Some(self.remembered(*hash)?), Bytes::new()),
        };
        self.note(taken.change, instance.as_ref());
        let mut message = Message::new(label, content);
        message.change = taken.change;
        message.instance = instance.map(Arc::new);
        Ok(Imported { message, source_time: taken.source_time })
    }

    /// The envelope that ends an instance.
    pub fn end(&self, change: Change, instance: Arc<Instance>) -> Message {
        Message { change, instance: Some(instance), ..Message::new(self.ending(), Bytes::new()) }
    }

    /// The key of a whole sample, as a sample that holds it alone; none where its type has none.
    ///
    /// # Errors
    /// [`ExportError::NoSample`] where it is none.
    pub fn key_sample(
        &self,
        sample: &[u8],
        representation: Representation,
    ) -> Result<Option<Bytes>, ExportError> {
        let Some((shape, keys)) = self.shape_of(sample).and_then(|shape| Some((shape, shape.keys.as_ref()?)))
        else {
            return Ok(None);
        };
        let no_sample = |why| ExportError::NoSample { topic: self.name.clone(), why };
        let Some(key) = keys.of_sample(&shape.schema, sample).map_err(no_sample)?.key else {
            return Ok(None);
        };
        keys.key_sample(&key, representation).map(|bytes| Some(bytes.into())).map_err(no_sample)
    }

    /// The label of messages without a content: that of what the topic's contents usually are.
    fn ending(&self) -> Arc<Label> {
        if self.info.is_some() { self.ours.clone() } else { self.theirs.clone() }
    }

    fn sample(&self, bytes: &Bytes) -> Result<(Arc<Label>, Option<Instance>, Bytes), ImportError> {
        let malformed = malformed(&self.name);
        let Some(shape) = self.shape_of(bytes) else { return Ok((self.theirs.clone(), None, bytes.clone())) };
        if let Some(info) = self.info {
            let content = shape.schema.to_postcard(bytes).map_err(&malformed)?;
            // A value outside its range makes no content of ours; as it came, nothing of it is lost.
            if let Some((content, key)) = content.and_then(|content| {
                let key = info.key(&content).ok()?;
                Some((content, key))
            }) {
                let instance = Instance::of_key(key, shape.schema.key_width());
                return Ok((self.ours.clone(), Some(instance), content.into()));
            }
        }
        let instance = shape.keys.as_ref().map(|keys| keys.of_sample(&shape.schema, bytes));
        Ok((self.theirs.clone(), instance.transpose().map_err(malformed)?, bytes.clone()))
    }

    /// The shape that the header of a sample tells of.
    fn shape_of(&self, bytes: &[u8]) -> Option<&Shape> {
        let shapes = self.shapes.as_ref()?;
        let id = u16::from_be_bytes([*bytes.first()?, *bytes.get(1)?]);
        let plain = matches!(id, 0x0006 | 0x0007);
        let described = shapes[0].schema.extensibility();
        Some(&shapes[usize::from(plain && described != Extensibility::Final)])
    }

    fn key(&self, bytes: &Bytes) -> Result<Instance, ImportError> {
        let unknown = || ImportError::UnknownType { topic: self.name.clone() };
        let keys = self.shape_of(bytes).and_then(|shape| shape.keys.as_ref()).ok_or_else(unknown)?;
        keys.of_key_sample(bytes).map_err(malformed(&self.name))
    }

    fn remembered(&self, hash: KeyHash) -> Result<Instance, ImportError> {
        self.instance_of(hash).ok_or_else(|| ImportError::UnknownKey { topic: self.name.clone(), hash })
    }

    /// The instance of a key hash: from the hash itself where it is the key, otherwise from memory.
    fn instance_of(&self, hash: KeyHash) -> Option<Instance> {
        let keys = self.shapes.as_ref().and_then(|shapes| shapes[0].keys.as_ref());
        let remembered = || Some(Instance { hash, key: Some(self.keys.get(&hash)?.clone()) });
        keys.and_then(|keys| keys.of_hash(hash)).or_else(remembered)
    }

    /// Remembers the keys of instances that live. An instance that ends is remembered too, until there are too many: its writer's
    /// unregister may follow its dispose.
    fn note(&mut self, change: Change, instance: Option<&Instance>) {
        let Some(Instance { hash, key: Some(key) }) = instance else { return };
        if change == Change::Put && !self.keys.contains_key(hash) {
            if self.keys.len() >= KEYS_MAX {
                self.keys.pop_first();
            }
            self.keys.insert(*hash, key.clone());
        } else if change == Change::Unregister {
            self.keys.remove(hash);
        }
    }

    /// Makes a sample of an envelope, for a writer of this extensibility and representation.
    ///
    /// # Errors
    /// [`ExportError`] where it is none, or ends an instance of which the key is not known.
    pub fn export(
        &mut self,
        message: &Message,
        representation: Representation,
    ) -> Result<Given, ExportError> {
        let change = message.change;
        if change == Change::Put {
            let bytes = self.written(message, representation)?;
            if let Some(instance) = &message.instance {
                self.note(change, Some(instance));
            }
            return Ok(Given { change, bytes });
        }
        let topic = || self.name.clone();
        let Some(instance) = &message.instance else {
            return Err(ExportError::UnknownKey { topic: topic(), hash: KeyHash([0; 16]) });
        };
        let shape =
            self.shape_for(representation).ok_or_else(|| ExportError::UnknownType { topic: topic() })?;
        let keys = shape.keys.as_ref().ok_or_else(|| ExportError::UnknownType { topic: topic() })?;
        let known = instance.key.clone().or_else(|| self.instance_of(instance.hash)?.key);
        let key = known.ok_or_else(|| ExportError::UnknownKey { topic: topic(), hash: instance.hash })?;
        let bytes = keys
            .key_sample(&key, representation)
            .map_err(|why| ExportError::NoSample { topic: topic(), why })?;
        self.note(change, Some(instance));
        Ok(Given { change, bytes: bytes.into() })
    }

    fn shape_for(&self, representation: Representation) -> Option<&Shape> {
        let [high, low] = representation.id().to_be_bytes();
        self.shape_of(&[high, low])
    }

    fn written(&self, message: &Message, representation: Representation) -> Result<Bytes, ExportError> {
        let topic = || self.name.clone();
        let no_sample = |why| ExportError::NoSample { topic: topic(), why };
        let unknown = || ExportError::UnknownType { topic: topic() };
        let bytes = match &message.label.attributes.content_type {
            ContentType::Umaa => {
                let shape = self.shape_for(representation).ok_or_else(unknown)?;
                shape.schema.of_postcard(&message.content, representation).map_err(no_sample)?
            }
            ContentType::Cdr => {
                let head = message.content.first_chunk::<HEADER>();
                let found =
                    head.and_then(|head| Representation::of_id(u16::from_be_bytes([head[0], head[1]])));
                if found.is_some_and(|found| found.form == representation.form) {
                    return Ok(message.content.clone());
                }
                // Another representation than the writer's: read by the one, written by the other.
                let shape = self.shape_of(&message.content).ok_or_else(unknown)?;
                let sample = shape.schema.read(&message.content).map_err(no_sample)?;
                if sample.differs {
                    return Err(ExportError::OtherVersion { topic: topic() });
                }
                let wanted = self.shape_for(representation).ok_or_else(unknown)?;
                wanted.schema.write(&sample.value, representation).map_err(no_sample)?
            }
            other => return Err(ExportError::OtherContent { topic: topic(), found: format!("{other:?}") }),
        };
        Ok(bytes.into())
    }
}
