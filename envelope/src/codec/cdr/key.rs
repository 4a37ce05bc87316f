//! Keys of samples: from whole samples and from those that hold a key alone (RTPS 2.5, 9.6.4.8; DDS-XTypes 1.3, 7.6.8).
//!
//! What [`Instance::key`] holds is the form of key hashes: members in the order of their ids, everything final, XCDR2 in big
//! endian, no header. On the wire a key alone is written as its type is.

use super::cursor::{Cursor, Read};
use super::error::{CdrError, CdrFault};
use super::read::Reader;
use super::representation::{ByteOrder, Form, HEADER, Representation};
use super::schema::{Node, NodeId, Schema};
use super::value::{Tree, Value, Walk};
use super::write::Writer;
use crate::change::{Instance, KeyHash, KeyWidth};
use bytes::Bytes;

/// The representation of key hashes.
const HASHED: Representation = Representation { form: Form::PlainXcdr2, order: ByteOrder::Big };

/// The key of a type.
#[derive(Debug, Clone)]
pub struct KeySchema {
    /// The key members as the type declares them.
    holder: Schema,
    /// The same in the form of key hashes.
    normal: Schema,
    width: KeyWidth,
}

impl KeySchema {
    /// The key of a type; none where it has none.
    pub fn new(schema: &Schema) -> Option<Self> {
        if !schema.is_keyed() {
            return None;
        }
        let holder = schema.key_holder();
        let normal = holder.normalized();
        Some(Self { holder, normal, width: schema.key_width() })
    }

    /// The instance of a whole sample of the type.
    ///
    /// # Errors
    /// [`CdrError`] where the sample cannot be read, or ends before its key.
    pub fn of_sample(&self, schema: &Schema, sample: &[u8]) -> Result<Instance, Box<CdrError>> {
        let read = schema.read(sample)?;
        self.of_value(schema, &read.value)
    }

    /// The instance of a sample that has been read.
    ///
    /// # Errors
    /// [`CdrError`] where it is of another type.
    pub fn of_value(&self, schema: &Schema, value: &Value) -> Result<Instance, Box<CdrError>> {
        let key = picked((schema, schema.root), (&self.normal, self.normal.root), value)
            .map_err(|fault| CdrError::new(fault, 0))?;
        self.instance(&key)
    }

    /// The instance of a sample that holds a key alone.
    ///
    /// # Errors
    /// [`CdrError`] where it cannot be read.
    pub fn of_key_sample(&self, sample: &[u8]) -> Result<Instance, Box<CdrError>> {
        let key = self.holder.read(sample)?.value;
        let key = picked((&self.holder, self.holder.root), (&self.normal, self.normal.root), &key)
            .map_err(|fault| CdrError::new(fault, 0))?;
        self.instance(&key)
    }

    /// The instance of a key hash, where every key of the type fits one: then the hash is the key.
    pub fn of_hash(&self, hash: KeyHash) -> Option<Instance> {
        if self.width != KeyWidth::Fits16 {
            return None;
        }
        let mut tree = Tree::default();
        let mut reader = Reader::new(&self.normal, Cursor::new(&hash.0, HASHED), &mut tree);
        reader.value(self.normal.root).ok()?;
        let (key, filler) = hash.0.split_at(hash.0.len() - reader.cursor.left());
        let key = filler.iter().all(|byte| *byte == 0).then(|| Bytes::copy_from_slice(key))?;
        Some(Instance { hash, key: Some(key) })
    }

    /// A sample that holds a key alone, from the key of an instance.
    ///
    /// # Errors
    /// [`CdrError`] where the key is not one of the type.
    pub fn key_sample(&self, key: &[u8], representation: Representation) -> Result<Vec<u8>, Box<CdrError>> {
        let key = self.value(key)?;
        let key = picked((&self.normal, self.normal.root), (&self.holder, self.holder.root), &key)
            .map_err(|fault| CdrError::new(fault, 0))?;
        self.holder.write(&key, representation)
    }

    /// The key of an instance for people: its members by their names.
    ///
    /// # Errors
    /// [`CdrError`] where the key is not one of the type.
    pub fn json(&self, key: &[u8]) -> Result<serde_json::Value, Box<CdrError>> {
        Ok(self.normal.json(&self.value(key)?))
    }

    /// A value of the type in which nothing but the key is there, from the key of an instance.
    ///
    /// # Errors
    /// [`CdrError`] where the key is not one of the type.
    pub fn partial(&self, schema: &Schema, key: &[u8]) -> Result<Value, Box<CdrError>> {
        let key = self.value(key)?;
        Ok(spread((&self.normal, self.normal.root), (schema, schema.root), &key))
    }

    fn value(&self, key: &[u8]) -> Read<Value> {
        let mut tree = Tree::default();
        let mut reader = Reader::new(&self.normal, Cursor::new(key, HASHED), &mut tree);
        reader.value(self.normal.root)?;
        match (reader.cursor.left(), tree.into_value()) {
            (0, Some(value)) => Ok(value),
            (left, _) => Err(CdrError::new(CdrFault::Trailing(left), HEADER + key.len() - left)),
        }
    }

    fn instance(&self, key: &Value) -> Read<Instance> {
        let mut out = Vec::new();
        Writer::new(&self.normal, HASHED, &mut Walk::new(key), &mut out).value(self.normal.root)?;
        Ok(Instance::of_key(Bytes::from(out), self.width))
    }
}

/// The members of a value that another type has too, in its order.
fn picked(from: (&Schema, NodeId), to: (&Schema, NodeId), value: &Value) -> Result<Value, CdrFault> {
    match (&from.0.nodes[from.1], &to.0.nodes[to.1], value) {
        (Node::Structure(source), Node::Structure(wanted), Value::Structure(members)) => {
            let member = |id: u32| {
                let place = source.members.iter().position(|field| field.id == id)?;
                Some((source.members.get(place)?.node, members.get(place)?.as_ref()?))
            };
            let picked = wanted.members.iter().map(|field| {
                let (node, held) = member(field.id).ok_or(CdrFault::Absent)?;
                picked((from.0, node), (to.0, field.node), held).map(Some)
            });
            picked.collect::<Result<_, _>>().map(Value::Structure)
        }
        (Node::Structure(_), Node::Structure(_), _) => Err(CdrFault::OtherKind { expected: "a structure" }),
        _ => Ok(value.clone()),
    }
}

/// The members of a key in a value of the whole type, all others absent.
fn spread(from: (&Schema, NodeId), to: (&Schema, NodeId), value: &Value) -> Value {
    match (&from.0.nodes[from.1], &to.0.nodes[to.1], value) {
        (Node::Structure(source), Node::Structure(wanted), Value::Structure(members)) => {
            let spread = wanted.members.iter().map(|field| {
                let place = source.members.iter().position(|known| known.id == field.id)?;
                let held = members.get(place)?.as_ref()?;
                Some(spread((from.0, source.members[place].node), (to.0, field.node), held))
            });
            Value::Structure(spread.collect())
        }
        _ => value.clone(),
    }
}
