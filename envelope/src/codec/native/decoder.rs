//! From key, header and content to an envelope, with what is known of the stream kept.

use super::reader::Reader;
use super::{HeaderError, NO_MORE, VERSION};
use crate::call::Call;
use crate::change::{Change, Instance};
use crate::id::{BootId, EntityId};
use crate::key::escape::Spelling;
use crate::key::{Keys, ParsedKey, Space, address_from_chunks, instance_chunk};
use crate::message::{Attributes, Envelope, Label, Message};
use crate::name::{ContentType, Descriptor, Group, Name};
use crate::stamp::{Priority, Stamp, VIA_MAX, Via};
use crate::time::Wall;
use bytes::Bytes;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// How many keys and labels a decoder remembers. A fleet of 100 vehicles with 40 streams each stays below; beyond it
/// the memory is forgotten whole, which costs time but nothing else.
const REMEMBERED_MAX: usize = 8_192;

/// A key counts as learned with so many samples: the instances of a command live for a handful, and are better left alone.
const LEARNED_AFTER: u32 = 8;

/// How many keys of one label count as learned: those of a topic with more instances than this are better left alone.
const LEARNED_OF_LABEL_MAX: u32 = 64;

/// Reads envelopes. It remembers keys and labels, so that the messages of one stream share their label.
#[derive(Debug)]
pub struct Decoder {
    keys: Keys,
    known: BTreeMap<Arc<str>, Arc<Known>>,
    /// With the number of keys learned of each.
    labels: BTreeMap<Arc<Label>, u32>,
    last: Option<(Arc<str>, Arc<Known>)>,
    learned: bool,
}

/// What the constant part of a header said on a key.
#[derive(Debug)]
struct Known {
    constant: Box<[u8]>,
    label: Arc<Label>,
    /// What all its stamps have in common; the rest is of one that says no more than its number and its time.
    stamp: Stamp,
    space: Space,
    instance: Option<Arc<Instance>>,
    /// How many samples came, up to [`LEARNED_AFTER`].
    samples: AtomicU32,
}

impl Decoder {
    /// A decoder of one fleet's keys.
    pub fn new(keys: Keys) -> Self {
        Self { keys, known: BTreeMap::new(), labels: BTreeMap::new(), last: None, learned: false }
    }

    /// Reads an envelope from a sample; `deleted` says that the sample is a Zenoh DELETE.
    ///
    /// # Errors
    /// [`HeaderError`] when key or header cannot be read or do not agree.
    pub fn decode(
        &mut self,
        key: &str,
        deleted: bool,
        header: &[u8],
        content: Bytes,
    ) -> Result<Envelope, HeaderError> {
        if !self.is_last(key, header) {
            self.last = Some(self.find(key, header)?);
        }
        let Some((_, known)) = &self.last else { return Err(HeaderError::Missing) };
        let mut rest = Reader::new(&header[known.constant.len()..]);
        let sequence = rest.varint("sequence")?;
        if sequence == 0 {
            return Err(invalid("sequence")("0, but streams count from 1"));
        }
        let source_time = Wall(rest.zigzag("source time")?);
        let mut stamp = Stamp { sequence, source_time, ..known.stamp.clone() };
        let (change, instance, call) = if !deleted && known.space == Space::Data && rest.is(&NO_MORE) {
            (Change::Put, known.instance.clone(), None)
        } else {
            read_rest_of_stamp(&mut stamp, &mut rest)?;
            read_change(known, &mut rest, deleted)?
        };
        if rest.left() > 0 {
            return Err(HeaderError::Trailing(rest.left()));
        }
        let label = known.label.clone();
        self.count();
        Ok(Envelope { message: Message { label, change, instance, call, content }, stamp })
    }

    /// Whether the key of the last sample has come often enough to be declared, and is one of few of its label.
    pub fn take_learned(&mut self) -> bool {
        std::mem::take(&mut self.learned)
    }

    /// Whether a sample is of the stream of the last one.
    fn is_last(&self, key: &str, header: &[u8]) -> bool {
        self.last.as_ref().is_some_and(|(last, known)| **last == *key && header.starts_with(&known.constant))
    }

    fn find(&mut self, key: &str, header: &[u8]) -> Result<(Arc<str>, Arc<Known>), HeaderError> {
        let remembered =
            self.known.get_key_value(key).filter(|(_, known)| header.starts_with(&known.constant));
        match remembered {
            Some((key, known)) => Ok((key.clone(), known.clone())),
            None => self.learn(key, header),
        }
    }

    /// One more sample of the last stream.
    fn count(&mut self) {
        let Some((_, known)) = &self.last else { return };
        // Not shared: the decoder alone counts, and is borrowed by whoever has it do so.
        let samples = known.samples.load(Ordering::Relaxed);
        if samples >= LEARNED_AFTER {
            return;
        }
        known.samples.store(samples + 1, Ordering::Relaxed);
        if samples + 1 == LEARNED_AFTER {
            let of_label = self.labels.entry(known.label.clone()).or_default();
            *of_label += 1;
            self.learned |= *of_label <= LEARNED_OF_LABEL_MAX;
        }
    }

    fn learn(&mut self, key: &str, header: &[u8]) -> Result<(Arc<str>, Arc<Known>), HeaderError> {
        let parsed = self.keys.parse(key)?;
        if parsed.space == Space::Alive {
            return Err(HeaderError::Disagrees("an envelope on a liveliness key".into()));
        }
        let mut known = read_constant(&parsed, header)?;
        if self.known.len() >= REMEMBERED_MAX || self.labels.len() >= REMEMBERED_MAX {
            self.known.clear();
            self.labels.clear();
        }
        if let Some((label, _)) = self.labels.get_key_value(&known.label) {
            known.label = label.clone();
        }
        let (key, known): (Arc<str>, _) = (key.into(), Arc::new(known));
        self.known.insert(key.clone(), known.clone());
        self.labels.entry(known.label.clone()).or_default();
        Ok((key, known))
    }
}

fn invalid<E: ToString>(field: &'static str) -> impl Fn(E) -> HeaderError {
    move |why| HeaderError::Invalid { field, why: why.to_string() }
}

fn read_constant(key: &ParsedKey<'_>, header: &[u8]) -> Result<Known, HeaderError> {
    let mut rest = Reader::new(header);
    match rest.byte("version").map_err(|_| HeaderError::Missing)? {
        VERSION => {}
        other => return Err(HeaderError::Version(other)),
    }
    let spelled = match rest.byte("spelling")? {
        0 => Spelling::Dots,
        1 => Spelling::Colons,
        2 => Spelling::Exact(rest.text("spelling")?.to_owned()),
        other => return Err(invalid("spelling")(format!("{other} is outside 0 to 2"))),
    };
    let address = address_from_chunks(key.address, &spelled).map_err(HeaderError::Disagrees)?;
    let content_type = match rest.byte("content type")? {
        0 => ContentType::Lmcp,
        1 => ContentType::Umaa,
        2 => ContentType::Cdr,
        3 => ContentType::Aldis,
        4 => ContentType::Other(Name::new(rest.text("content type")?).map_err(invalid("content type"))?),
        other => return Err(invalid("content type")(format!("{other} is outside 0 to 4"))),
    };
    let descriptor = if rest.present("descriptor")? {
        Descriptor::new(rest.text("descriptor")?).map_err(invalid("descriptor"))?
    } else {
        match &address {
            crate::Address::Name(name) => name.clone().into(),
            _ => return Err(invalid("descriptor")("missing, and the address is no name")),
        }
    };
    let source_group = Group::new(rest.text("source group")?).map_err(invalid("source group"))?;
    let node = EntityId::new(rest.varint("node")?).map_err(invalid("node"))?;
    let boot = BootId(rest.varint("boot id")?);
    let priority = Priority::try_from(rest.byte("priority")?).map_err(invalid("priority"))?;
    let constant = header[..header.len() - rest.left()].into();
    let attributes = Attributes { content_type, descriptor, source_group, source: key.source };
    let label = Arc::new(Label { address, attributes });
    let instance = key.instance.map(|hash| Arc::new(Instance { hash, key: None }));
    let stamp = Stamp {
        node,
        boot,
        sequence: 0,
        source_time: Wall(0),
        lifespan_left_ms: None,
        priority,
        skipped: 0,
        via: Via::default(),
    };
    Ok(Known { constant, label, stamp, space: key.space, instance, samples: AtomicU32::new(0) })
}

fn read_rest_of_stamp(stamp: &mut Stamp, rest: &mut Reader<'_>) -> Result<(), HeaderError> {
    stamp.lifespan_left_ms = match rest.present("lifespan")? {
        true => Some(rest.varint_u32("lifespan")?),
        false => None,
    };
    stamp.skipped = rest.varint_u32("skipped")?;
    let passed = rest.varint("via")?;
    if passed > VIA_MAX as u64 {
        return Err(invalid("via")(format!("{passed} nodes passed, at most {VIA_MAX} are allowed")));
    }
    for _ in 0..passed {
        stamp.via.push(EntityId::new(rest.varint("via")?).map_err(invalid("via"))?);
    }
    Ok(())
}

type Changed = (Change, Option<Arc<Instance>>, Option<Box<Call>>);

fn read_change(known: &Known, rest: &mut Reader<'_>, deleted: bool) -> Result<Changed, HeaderError> {
    let change = match rest.byte("change")? {
        0 => Change::Put,
        1 => Change::Dispose,
        2 => Change::Unregister,
        other => return Err(invalid("change")(format!("{other} is outside 0 to 2"))),
    };
    let agrees = deleted == (change == Change::Dispose)
        && (known.space == Space::Writer) == (change == Change::Unregister);
    let among_nodes = matches!(known.space, Space::State | Space::Ack);
    if among_nodes && (change != Change::Put || known.label.attributes.content_type != ContentType::Aldis) {
        return Err(HeaderError::Disagrees(format!("{:?} in {:?}", known.label.descriptor(), known.space)));
    }
    if !agrees {
        let how = if deleted { "a delete" } else { "a put" };
        return Err(HeaderError::Disagrees(format!("{change:?} came as {how} in {:?}", known.space)));
    }
    let instance = match rest.present("key")? {
        true => Some(instance_of_key(known, rest.bytes("key")?)?),
        false => known.instance.clone(),
    };
    if change != Change::Put && instance.is_none() {
        return Err(HeaderError::Disagrees(format!("{change:?} without an instance")));
    }
    let call = match rest.present("call")? {
        true => Some(Box::new(rest.value("call")?)),
        false => None,
    };
    Ok((change, instance, call))
}

/// The instance of a serialized key, which must be the one that the Zenoh key names.
fn instance_of_key(known: &Known, key: &[u8]) -> Result<Arc<Instance>, HeaderError> {
    let disagrees = || HeaderError::Disagrees("the instance is not that of the serialized key".into());
    let named = known.instance.as_ref().ok_or_else(disagrees)?.hash;
    let bytes = Bytes::copy_from_slice(key);
    let instance = if known.label.is_broadcast() {
        if !Instance::hash_fits(named, key) {
            return Err(disagrees());
        }
        Instance { hash: named, key: Some(bytes) }
    } else {
        let width = if key.len() <= 16 { crate::KeyWidth::Fits16 } else { crate::KeyWidth::Wider };
        let instance = Instance::of_key(bytes, width);
        if instance_chunk(&known.label, &instance) != named {
            return Err(disagrees());
        }
        instance
    };
    Ok(Arc::new(instance))
}
