//! Numbers in place of names: labels, instances and origins, agreed by the link and kept in the journal of both ends.

use super::body::{LabelEntry, Origin, read_instance, write_instance};
use super::wire::{Malformed, Reader, put_varint};
use aldis_envelope::{Instance, KeyHash};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// How many numbers of each kind one direction of a link may use. A fleet's vehicle has some hundred instances; hostile peers
/// get no more memory than this.
pub(super) const NAMES_MAX: usize = 65_536;

/// An instance under a number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct InstanceEntry {
    /// The number of its label.
    pub(super) label: u32,
    pub(super) instance: Option<Arc<Instance>>,
    /// The length that its contents usually have; such need not tell theirs.
    pub(super) usual: u32,
}

/// Something that gets a number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Definition {
    Label(LabelEntry),
    Instance(InstanceEntry),
    Origin(Origin),
}

/// Which table a number is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Table {
    Label,
    Instance,
    Origin,
}

/// A number in a table.
pub(super) type NameId = (Table, u32);

impl Definition {
    fn table(&self) -> Table {
        match self {
            Self::Label(_) => Table::Label,
            Self::Instance(_) => Table::Instance,
            Self::Origin(_) => Table::Origin,
        }
    }

    /// The definition with its number, as it travels and as it is kept.
    pub(super) fn encode(&self, number: u32) -> Vec<u8> {
        let mut out = vec![self.table() as u8];
        put_varint(number.into(), &mut out);
        match self {
            Self::Label(entry) => entry.write(&mut out),
            Self::Origin(origin) => origin.write(&mut out),
            Self::Instance(entry) => {
                put_varint(entry.label.into(), &mut out);
                put_varint(entry.usual.into(), &mut out);
                write_instance(entry.instance.as_deref(), &mut out);
            }
        }
        out
    }

    pub(super) fn decode(bytes: &[u8]) -> Result<(u32, Self), Malformed> {
        let mut reader = Reader::new(bytes, "a definition");
        let table = reader.byte()?;
        let number = reader.varint_u32()?;
        let definition = match table {
            0 => Self::Label(LabelEntry::read(&mut reader)?),
            1 => Self::Instance(InstanceEntry {
                label: reader.varint_u32()?,
                usual: reader.varint_u32()?,
                instance: read_instance(&mut reader)?.map(Arc::new),
            }),
            2 => Self::Origin(Origin::read(&mut reader)?),
            _ => return Err(reader.malformed()),
        };
        if reader.is_empty() { Ok((number, definition)) } else { Err(reader.malformed()) }
    }
}

/// The names of one direction.
#[derive(Debug, Default)]
pub(super) struct Names {
    pub(super) labels: BTreeMap<u32, LabelEntry>,
    pub(super) instances: BTreeMap<u32, InstanceEntry>,
    pub(super) origins: BTreeMap<u32, Origin>,
    label_numbers: BTreeMap<(Arc<aldis_envelope::Label>, u8), u32>,
    instance_numbers: BTreeMap<(u32, Option<KeyHash>), u32>,
    origin_numbers: BTreeMap<Origin, u32>,
    /// Those that the peer is not known to have.
    unsure: BTreeSet<NameId>,
}

/// A number, and the definition that the peer must be given where it is new.
pub(super) type Numbered = (u32, Option<Definition>);

/// There are too many names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TooMany;

impl Names {
    pub(super) fn insert(&mut self, number: u32, definition: Definition) -> Result<(), TooMany> {
        let room =
            |length: usize, known: bool| if known || length < NAMES_MAX { Ok(()) } else { Err(TooMany) };
        match definition {
            Definition::Label(entry) => {
                room(self.labels.len(), self.labels.contains_key(&number))?;
                self.label_numbers.insert((entry.label.clone(), entry.priority.into()), number);
                self.labels.insert(number, entry);
            }
            Definition::Instance(entry) => {
                room(self.instances.len(), self.instances.contains_key(&number))?;
                let hash = entry.instance.as_ref().map(|instance| instance.hash);
                self.instance_numbers.insert((entry.label, hash), number);
                self.instances.insert(number, entry);
            }
            Definition::Origin(origin) => {
                room(self.origins.len(), self.origins.contains_key(&number))?;
                self.origin_numbers.insert(origin.clone(), number);
                self.origins.insert(number, origin);
            }
        }
        Ok(())
    }

    fn add(&mut self, number: u32, definition: Definition) -> Result<Numbered, TooMany> {
        self.insert(number, definition.clone())?;
        self.unsure.insert((definition.table(), number));
        Ok((number, Some(definition)))
    }

    /// The number of a label. Labels count from 1.
    pub(super) fn label(&mut self, entry: LabelEntry) -> Result<Numbered, TooMany> {
        match self.label_numbers.get(&(entry.label.clone(), entry.priority.into())) {
            Some(&number) => Ok((number, None)),
            None => self.add(self.labels.len() as u32 + 1, Definition::Label(entry)),
        }
    }

    /// The number of an origin.
    pub(super) fn origin(&mut self, origin: Origin) -> Result<Numbered, TooMany> {
        match self.origin_numbers.get(&origin) {
            Some(&number) => Ok((number, None)),
            None => self.add(self.origins.len() as u32, Definition::Origin(origin)),
        }
    }

    /// The number of an instance.
    pub(super) fn instance(&mut self, entry: InstanceEntry) -> Result<Numbered, TooMany> {
        let hash = entry.instance.as_ref().map(|instance| instance.hash);
        match self.instance_numbers.get(&(entry.label, hash)) {
            Some(&number) => Ok((number, None)),
            None => self.add(self.instances.len() as u32, Definition::Instance(entry)),
        }
    }

    /// The peer has the definition, or may have lost it.
    pub(super) fn set_sure(&mut self, name: NameId, sure: bool) {
        if sure {
            self.unsure.remove(&name);
        } else {
            self.unsure.insert(name);
        }
    }

    pub(super) fn is_sure(&self, name: NameId) -> bool {
        !self.unsure.contains(&name)
    }

    /// All definitions, encoded.
    pub(super) fn all(&self) -> Vec<(NameId, Vec<u8>)> {
        let labels = self.labels.iter().map(|(&n, entry)| (n, Definition::Label(entry.clone())));
        let instances = self.instances.iter().map(|(&n, entry)| (n, Definition::Instance(entry.clone())));
        let origins = self.origins.iter().map(|(&n, origin)| (n, Definition::Origin(origin.clone())));
        let all = labels.chain(origins).chain(instances);
        all.map(|(number, definition)| ((definition.table(), number), definition.encode(number))).collect()
    }
}

/// Which name an encoded definition gives.
pub(super) fn name_of(bytes: &[u8]) -> Option<NameId> {
    let (number, definition) = Definition::decode(bytes).ok()?;
    Some((definition.table(), number))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::body::tests::envelope;
    use proptest::prelude::*;

    fn label() -> LabelEntry {
        let envelope = envelope(1, b"");
        LabelEntry { label: envelope.message.label, priority: envelope.stamp.priority, base: 5 }
    }

    #[test]
    fn a_name_is_defined_once() {
        let mut names = Names::default();
        assert!(matches!(names.label(label()), Ok((1, Some(_)))));
        assert!(matches!(names.label(label()), Ok((1, None))));
        assert!(!names.is_sure((Table::Label, 1)));
        names.set_sure((Table::Label, 1), true);
        let entry = InstanceEntry { label: 1, instance: Some(Arc::new(Instance::of_number(7))), usual: 24 };
        assert!(matches!(names.instance(entry), Ok((0, Some(_)))));
        assert!(names.is_sure((Table::Label, 1)) && !names.is_sure((Table::Instance, 0)));
        for (name, bytes) in names.all() {
            assert_eq!(name_of(&bytes), Some(name));
            let (number, definition) = Definition::decode(&bytes).unwrap();
            assert_eq!(definition.encode(number), bytes);
        }
    }

    proptest! {
        #[test]
        fn strange_definitions_are_refused(bytes: Vec<u8>) {
            if let Ok((number, definition)) = Definition::decode(&bytes) {
                prop_assert!(Definition::decode(&definition.encode(number)).is_ok());
            }
        }
    }
}
