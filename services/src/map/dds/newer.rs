//! A bus that speaks version 6.0: its samples as the envelopes of 5.2.1 that the fleet knows, and back.

use super::error::malformed;
use super::version::{Lost, Sample, Translator};
use super::{ExportError, Given, ImportError, Sender};
use aldis_envelope::codec::cdr::{CdrError, KeySchema, Representation, Schema, SchemaError, Value};
use aldis_envelope::description::{DescriptionError, Extensibility, Library};
use aldis_envelope::name::NameError;
use aldis_envelope::umaa::{self, TopicInfo, v6_0};
use aldis_envelope::{Change, ContentType, Instance, KeyHash, Label, Message, Name};
use bytes::Bytes;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Why a bus of 6.0 cannot be served. A test of all topics rules each out.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NewerError {
    /// The built-in types are unsound.
    #[error("the types of Support Operations are unsound: {0:?}")]
    Types(Vec<DescriptionError>),
    /// A topic has no type.
    #[error(transparent)]
    Schema(#[from] SchemaError),
    /// A topic's name is none.
    #[error(transparent)]
    Name(#[from] NameError),
}

/// A type as it is written: as described, and with everything final.
#[derive(Debug)]
struct Shapes([(Schema, Option<KeySchema>); 2]);

impl Shapes {
    fn new(library: &Library, type_name: &str) -> Result<Self, SchemaError> {
        let schema = Schema::new(library, type_name)?;
        Ok(Self([schema.clone(), schema.as_final()].map(|schema| {
            let keys = KeySchema::new(&schema);
            (schema, keys)
        })))
    }

    /// The type as the header of a sample tells of it.
    fn of(&self, sample: &[u8]) -> &(Schema, Option<KeySchema>) {
        &self.0[usize::from(matches!(sample, [0, 6 | 7, ..]))]
    }

    /// The key members that an instance's key holds.
    fn partial(&self, key: &[u8]) -> Result<Value, Box<CdrError>> {
        match &self.0[0] {
            (schema, Some(keys)) => keys.partial(schema, key),
            (schema, None) => schema.read(key).map(|read| read.value),
        }
    }
}

/// One topic of 5.2.1.
#[derive(Debug)]
struct Older {
    info: &'static TopicInfo,
    label: Arc<Label>,
    shapes: Shapes,
}

/// The bus.
#[derive(Debug)]
pub struct NewerBus {
    translator: Translator,
    newer: BTreeMap<String, Shapes>,
    older: BTreeMap<&'static str, Older>,
}

/// The form in which values pass between the two.
const BETWEEN: Extensibility = Extensibility::Appendable;

impl NewerBus {
    /// A bus of which nothing is known yet.
    ///
    /// # Errors
    /// [`NewerError`], which a test rules out.
    pub fn new(sender: &Sender) -> Result<Self, NewerError> {
        let translator = Translator::new().map_err(NewerError::Types)?;
        let (mut newer, mut older) = (BTreeMap::new(), BTreeMap::new());
        for topic in v6_0::topics() {
            newer.insert(topic.name, Shapes::new(translator.newer(), &topic.type_name)?);
        }
        for info in umaa::topics() {
            let label = sender.label(ContentType::Umaa, &Name::new(info.name)?);
            let shapes = Shapes::new(translator.older(), info.type_name)?;
            older.insert(info.name, Older { info, label, shapes });
        }
        Ok(Self { translator, newer, older })
    }

    /// The topic of 5.2.1 that a topic of 6.0 belongs to; none where it is none of Support Operations.
    pub fn older_topic(&self, topic: &str) -> Option<&'static str> {
        self.newer.contains_key(topic).then(|| super::version::older_topic(topic))?
    }

    /// Makes envelopes of 5.2.1 of what a topic of 6.0 says, as [`TopicMap`](super::TopicMap) imports it, and says what is lost for the
    /// first time.
    ///
    /// # Errors
    /// [`ImportError`] where it is no sample of its type.
    pub fn for_fleet(
        &mut self,
        topic: &str,
        came: &Message,
    ) -> Result<(Vec<Message>, Vec<Lost>), ImportError> {
        let Some(newer) = self.newer.get(topic) else {
            return Ok((Vec::new(), vec![Lost::Topic(topic.to_owned())]));
        };
        let mut differs = false;
        let value = if came.change == Change::Put {
            newer.of(&came.content).0.read(&came.content).map(|read| {
                differs = read.differs;
                read.value
            })
        } else {
            let instance = came.instance.as_deref();
            newer.partial(instance.and_then(|instance| instance.key.as_deref()).unwrap_or_default())
        };
        let value = value.map_err(malformed(topic))?;
        let sample = Sample { topic: topic.to_owned(), change: came.change, value };
        if differs {
            self.translator.more_members(topic);
        }
        let outcome = self.translator.to_older(&sample);
        Ok((outcome.samples.iter().filter_map(|sample| self.message(sample)).collect(), outcome.lost))
    }

    /// The envelope of a sample of 5.2.1; none where a value is outside its range there.
    fn message(&self, sample: &Sample) -> Option<Message> {
        let older = self.older.get(sample.topic.as_str())?;
        let (schema, keys) = &older.shapes.0[0];
        let instance = keys.as_ref()?.of_value(schema, &sample.value).ok()?;
        if sample.change != Change::Put {
            let message = Message::new(older.label.clone(), Bytes::new()).of_instance(instance);
            return Some(Message { change: sample.change, ..message });
        }
        let bytes = schema.write(&sample.value, Representation::xcdr2(BETWEEN)).ok()?;
        let content = Bytes::from(schema.to_postcard(&bytes).ok()??);
        older.info.key(&content).ok()?;
        Some(Message::new(older.label.clone(), content).of_instance(instance))
    }

    /// What an envelope of 5.2.1 is on the bus, and what is lost for the first time.
    ///
    /// # Errors
    /// [`ExportError`] where its content is no sample of its topic, or it ends an instance of which the key is not known.
    pub fn for_bus(&mut self, message: &Message) -> Result<(Vec<Sample>, Vec<Lost>), ExportError> {
        let topic = message.label.descriptor();
        let no_sample = |why: Box<CdrError>| ExportError::NoSample { topic: topic.to_owned(), why };
        let Some(older) = self.older.get(topic) else {
            return Ok((Vec::new(), vec![Lost::Topic(topic.to_owned())]));
        };
        let mut differs = false;
        let value = if message.change == Change::Put {
            let shapes = &older.shapes;
            let read = match &message.label.attributes.content_type {
                ContentType::Umaa => {
                    let schema = &shapes.0[0].0;
                    let between = Representation::xcdr2(BETWEEN);
                    schema.of_postcard(&message.content, between).and_then(|bytes| schema.read(&bytes))
                }
                ContentType::Cdr => shapes.of(&message.content).0.read(&message.content),
                other => {
                    let found = format!("{other:?}");
                    return Err(ExportError::OtherContent { topic: topic.to_owned(), found });
                }
            };
            let read = read.map_err(no_sample)?;
            differs = read.differs;
            read.value
        } else {
            let instance = message.instance.as_deref();
            let keys = older.shapes.0[0].1.as_ref();
            let of_hash = || keys?.of_hash(instance?.hash)?.key;
            let hash = instance.map_or(KeyHash([0; 16]), |instance| instance.hash);
            let key = instance.and_then(|instance| instance.key.clone()).or_else(of_hash);
            let key = key.ok_or_else(|| ExportError::UnknownKey { topic: topic.to_owned(), hash })?;
            older.shapes.partial(&key).map_err(no_sample)?
        };
        let sample = Sample { topic: topic.to_owned(), change: message.change, value };
        if differs {
            self.translator.more_members(topic);
        }
        let outcome = self.translator.to_newer(&sample);
        Ok((outcome.samples, outcome.lost))
    }

    /// The bytes of a sample of 6.0 for a writer of this representation, and its instance.
    ///
    /// # Errors
    /// [`ExportError::NoSample`] where it is none, which a test rules out for what [`Self::for_bus`] makes.
    pub fn given(
        &self,
        sample: &Sample,
        representation: Representation,
    ) -> Result<(Option<Instance>, Given), ExportError> {
        let no_sample = |why| ExportError::NoSample { topic: sample.topic.clone(), why };
        let Some(newer) = self.newer.get(&sample.topic) else {
            return Err(ExportError::UnknownType { topic: sample.topic.clone() });
        };
        let (schema, keys) = newer.of(&representation.id().to_be_bytes());
        let instance = keys.as_ref().map(|keys| keys.of_value(schema, &sample.value)).transpose();
        let instance = instance.map_err(no_sample)?;
        let key = instance.as_ref().and_then(|instance| instance.key.as_deref()).unwrap_or_default();
        let bytes = match keys {
            Some(keys) if sample.change != Change::Put => keys.key_sample(key, representation),
            _ => schema.write(&sample.value, representation),
        };
        let bytes = bytes.map_err(no_sample)?.into();
        Ok((instance, Given { change: sample.change, bytes }))
    }

    /// Forgets what was said on the bus of configurations: there is a reader that has heard nothing of it, or what was said has lost its
    /// writer. So all of it is said again.
    pub fn say_all_again(&mut self) {
        self.translator.say_all_again();
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Body, Taken, TopicMap};
    use super::*;
    use aldis_envelope::umaa::{CommandKey, ResourceAllocationCommand};
    use aldis_envelope::{DateTime, EntityId, Guid, ServiceId, Source, Wall};

    #[test]
    fn a_command_and_its_cancel_cross_between_the_versions() {
        let source = Source::new(EntityId::new(400).unwrap(), ServiceId::new(20).unwrap());
        let mut bus = NewerBus::new(&source.into()).unwrap();
        let name = "UMAA::SO::ResourceAllocation::ResourceAllocationCommandType";
        let mut map = TopicMap::new(name, name, bus.translator.newer(), &source.into()).unwrap();
        let command = ResourceAllocationCommand {
            duration: None,
            resource_id: Guid([1; 16]),
            time_stamp: DateTime::new(1, 2).unwrap(),
            source: Guid([2; 16]),
            session_id: Guid([3; 16]),
            destination: Guid([4; 16]),
        };
        let label = umaa::label::<ResourceAllocationCommand>(source).unwrap();
        let put = umaa::put(label.clone(), &command);
        let key: CommandKey = umaa::Topic::key(&command);
        let cancel = umaa::about_instance(label, Change::Dispose, key);
        let plain = Representation::xcdr2(Extensibility::Final);
        for representation in [Representation::XCDR1, plain, Representation::xcdr2(BETWEEN)] {
            for message in [&put, &cancel] {
                let (samples, lost) = bus.for_bus(message).unwrap();
                assert_eq!((samples.len(), lost, samples[0].topic.as_str()), (1, vec![], name));
                let (instance, Given { change, bytes }) = bus.given(&samples[0], representation).unwrap();
                let body = if change == Change::Put { Body::Sample(bytes) } else { Body::Key(bytes) };
                let taken = Taken { writer: [1; 16], source_time: Wall(5), change, body };
                let native = map.import(&taken).unwrap().message;
                assert_eq!(native.instance.as_deref(), instance.as_ref());
                let (came, lost) = bus.for_fleet(name, &native).unwrap();
                assert_eq!((came, lost), (vec![message.clone()], vec![]));
            }
        }
        let other = Message::new(
            Arc::new(Label::broadcast(ContentType::Cdr, Name::new("X").unwrap(), source)),
            Bytes::new(),
        );
        assert_eq!(bus.for_bus(&other).unwrap().1, [Lost::Topic("X".to_owned())]);
        assert_eq!(
            (bus.older_topic(name), bus.older_topic("X")),
            (Some(name.strip_suffix("Type").unwrap()), None)
        );
    }
}
