//! A bus that speaks version 6.0: its samples as the envelopes of 5.2.1 that the fleet knows, and back.

use super::topic::malformed;
use super::version::{Lost, Sample, Translator};
use super::{ExportError, Given, ImportError, Imported, Taken, TopicMap};
use aldis_envelope::codec::cdr::{CdrError, KeySchema, Representation, Schema, SchemaError};
use aldis_envelope::description::{DescriptionError, Extensibility};
use aldis_envelope::umaa::{self, TopicInfo, v6_0};
use aldis_envelope::{Change, ContentType, Instance, KeyHash, Label, Message, Name, NameError, Source};
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

/// One topic of 6.0.
#[derive(Debug)]
struct Newer {
    map: TopicMap,
    schema: Schema,
    keys: Option<KeySchema>,
}

/// One topic of 5.2.1.
#[derive(Debug)]
struct Older {
    info: &'static TopicInfo,
    label: Arc<Label>,
    schema: Schema,
    keys: Option<KeySchema>,
}

/// The bus.
#[derive(Debug)]
pub struct NewerBus {
    translator: Translator,
    newer: BTreeMap<String, Newer>,
    older: BTreeMap<&'static str, Older>,
}

/// The form in which values pass between the two.
const BETWEEN: Extensibility = Extensibility::Appendable;

impl NewerBus {
    /// A bus of which nothing is known yet. `source` is the bridge's.
    ///
    /// # Errors
    /// [`NewerError`], which a test rules out.
    pub fn new(source: Source) -> Result<Self, NewerError> {
        let translator = Translator::new().map_err(NewerError::Types)?;
        let (mut newer, mut older) = (BTreeMap::new(), BTreeMap::new());
        for topic in v6_0::topics() {
            let schema = Schema::new(translator.newer(), &topic.type_name)?;
            let map = TopicMap::new(&topic.name, &topic.type_name, translator.newer(), source)?;
            newer.insert(topic.name, Newer { map, keys: KeySchema::new(&schema), schema });
        }
        for info in umaa::topics() {
            let label = Arc::new(Label::broadcast(ContentType::Umaa, Name::new(info.name)?, source));
            let schema = Schema::new(translator.older(), info.type_name)?;
            older.insert(info.name, Older { info, label, keys: KeySchema::new(&schema), schema });
        }
        Ok(Self { translator, newer, older })
    }

    /// Makes envelopes of a sample of a topic of 6.0, and says what is lost for the first time.
    ///
    /// # Errors
    /// [`ImportError`] as of any topic.
    pub fn import(&mut self, topic: &str, taken: &Taken) -> Result<(Vec<Imported>, Vec<Lost>), ImportError> {
        let Some(newer) = self.newer.get_mut(topic) else {
            return Ok((Vec::new(), vec![Lost::Topic(topic.to_owned())]));
        };
        let Imported { message, source_time } = newer.map.import(taken)?;
        let value = if message.change == Change::Put {
            newer.schema_of(&message.content).read(&message.content).map(|read| read.value)
        } else {
            newer.partial(message.instance.as_deref())
        };
        let value = value.map_err(malformed(topic))?;
        let sample = Sample { topic: topic.to_owned(), change: message.change, value };
        let outcome = self.translator.to_older(&sample);
        let messages = outcome.samples.iter().filter_map(|sample| self.message(sample));
        let imported = messages.map(|message| Imported { message, source_time }).collect();
        Ok((imported, outcome.lost))
    }

    /// The envelope of a sample of 5.2.1; none where a value is outside its range there.
    fn message(&self, sample: &Sample) -> Option<Message> {
        let older = self.older.get(sample.topic.as_str())?;
        let instance = older.keys.as_ref()?.of_value(&older.schema, &sample.value).ok()?;
        if sample.change != Change::Put {
            let message = Message::new(older.label.clone(), Bytes::new()).of_instance(instance);
            return Some(Message { change: sample.change, ..message });
        }
        let bytes = older.schema.write(&sample.value, Representation::xcdr2(BETWEEN)).ok()?;
        let content = Bytes::from(older.schema.to_postcard(&bytes).ok()??);
        older.info.key(&content).ok()?;
        Some(Message::new(older.label.clone(), content).of_instance(instance))
    }

    /// Makes samples of an envelope of 5.2.1, each with its topic, and says what is lost for the first time. `representation`
    /// gives that of the writer of a topic.
    ///
    /// # Errors
    /// [`ExportError`] as of any topic.
    #[allow(clippy::type_complexity, reason = "the samples with their topics, and what is lost")]
    pub fn export(
        &mut self,
        message: &Message,
        representation: impl Fn(&str) -> Representation,
    ) -> Result<(Vec<(String, Given)>, Vec<Lost>), ExportError> {
        let topic = message.label.descriptor();
        let no_sample = |why: Box<CdrError>| ExportError::NoSample { topic: topic.to_owned(), why };
        let Some(older) = self.older.get(topic) else {
            return Ok((Vec::new(), vec![Lost::Topic(topic.to_owned())]));
        };
        let value = if message.change == Change::Put {
            let between = Representation::xcdr2(BETWEEN);
            let bytes = older.schema.of_postcard(&message.content, between).map_err(no_sample)?;
            older.schema.read(&bytes).map_err(no_sample)?.value
        } else {
            let instance = message.instance.as_deref();
            let key = instance.and_then(|instance| instance.key.clone());
            let of_hash = || older.keys.as_ref()?.of_hash(instance?.hash)?.key;
            let hash = instance.map_or(KeyHash([0; 16]), |instance| instance.hash);
            let unknown = || ExportError::UnknownKey { topic: topic.to_owned(), hash };
            let key = key.or_else(of_hash).ok_or_else(unknown)?;
            let keys = older.keys.as_ref().ok_or_else(unknown)?;
            keys.partial(&older.schema, &key).map_err(no_sample)?
        };
        let sample = Sample { topic: topic.to_owned(), change: message.change, value };
        let outcome = self.translator.to_newer(&sample);
        let mut given = Vec::new();
        for sample in outcome.samples {
            if let Some(newer) = self.newer.get(&sample.topic) {
                let bytes = newer.written(&sample, representation(&sample.topic)).map_err(no_sample)?;
                given.push((sample.topic, Given { change: sample.change, bytes }));
            }
        }
        Ok((given, outcome.lost))
    }
}

impl Newer {
    /// The type as the header of a sample tells of it: appendable, or with everything final.
    fn schema_of(&self, sample: &[u8]) -> Schema {
        let plain = matches!(sample, [0, 6 | 7, ..]);
        if plain { self.schema.as_final() } else { self.schema.clone() }
    }

    fn partial(
        &self,
        instance: Option<&Instance>,
    ) -> Result<aldis_envelope::codec::cdr::Value, Box<CdrError>> {
        let key = instance.and_then(|instance| instance.key.as_deref()).unwrap_or_default();
        match &self.keys {
            Some(keys) => keys.partial(&self.schema, key),
            None => self.schema.read(key).map(|read| read.value),
        }
    }

    fn written(&self, sample: &Sample, representation: Representation) -> Result<Vec<u8>, Box<CdrError>> {
        let schema = self.schema_of(&representation.id().to_be_bytes());
        if sample.change == Change::Put {
            return schema.write(&sample.value, representation);
        }
        let keys = KeySchema::new(&schema);
        let Some(keys) = keys else { return schema.write(&sample.value, representation) };
        let key = keys.of_value(&schema, &sample.value)?.key.unwrap_or_default();
        keys.key_sample(&key, representation)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Body;
    use super::*;
    use aldis_envelope::umaa::{CommandKey, ResourceAllocationCommand};
    use aldis_envelope::{DateTime, EntityId, Guid, ServiceId, Wall};

    #[test]
    fn a_command_and_its_cancel_cross_between_the_versions() {
        let source = Source::new(EntityId::new(400).unwrap(), ServiceId::new(20).unwrap());
        let mut bus = NewerBus::new(source).unwrap();
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
                let (mut given, lost) = bus.export(message, |_| representation).unwrap();
                assert_eq!((given.len(), lost), (1, vec![]));
                let (topic, Given { change, bytes }) = given.remove(0);
                assert_eq!(topic, "UMAA::SO::ResourceAllocation::ResourceAllocationCommandType");
                let body = Bytes::from(bytes);
                let body = if change == Change::Put { Body::Sample(body) } else { Body::Key(body) };
                let taken = Taken { writer: [1; 16], source_time: Wall(5), change, body };
                let (came, lost) = bus.import(&topic, &taken).unwrap();
                assert_eq!(lost, []);
                assert_eq!(came, [Imported { message: message.clone(), source_time: Wall(5) }]);
            }
        }
        let other = Message::new(
            Arc::new(Label::broadcast(ContentType::Cdr, Name::new("X").unwrap(), source)),
            Bytes::new(),
        );
        assert_eq!(bus.export(&other, |_| plain).unwrap().1, [Lost::Topic("X".to_owned())]);
    }
}
