//! One value in the words of the other version: members by their names, GUIDs and identifiers for each other.

use super::{Lost, REMEMBERED_MAX, Sample, Translator};
use aldis_envelope::codec::cdr::Value;
use aldis_envelope::description::{Definition, Library, Resolved, Structure, Type};
use aldis_envelope::umaa::v6_0::IDENTIFIER;
use aldis_envelope::{Change, Guid};

/// One conversion.
struct Conversion<'a> {
    from: &'a Library,
    to: &'a Library,
    topic: &'a str,
    /// Whether members that must be there may be absent: in what ends an instance.
    partial: bool,
    parents: &'a mut std::collections::BTreeMap<Guid, Guid>,
    lost: &'a mut Vec<Lost>,
}

impl Translator {
    /// A sample of a type in the other version, where the type has the same name.
    pub(super) fn converted(&mut self, sample: &Sample, type_name: &str, newer: bool) -> Result<Value, Lost> {
        self.converted_value(&sample.topic, type_name, &sample.value, sample.change != Change::Put, newer)
    }

    /// A value of a type in the other version.
    pub(super) fn converted_value(
        &mut self,
        topic: &str,
        type_name: &str,
        value: &Value,
        partial: bool,
        newer: bool,
    ) -> Result<Value, Lost> {
        let (from, to) = if newer { (&self.older, &self.newer) } else { (&self.newer, &self.older) };
        let mut conversion =
            Conversion { from, to, topic, partial, parents: &mut self.parents, lost: &mut self.lost };
        let held = Type::named(type_name);
        conversion.value(&held, &held, value, "")
    }
}

impl Conversion<'_> {
    fn value(&mut self, from: &Type, to: &Type, value: &Value, member: &str) -> Result<Value, Lost> {
        let (source, wanted) = (self.from.resolved(from), self.to.resolved(to));
        match (source, wanted, value) {
            (Resolved::Plain(_), Resolved::Defined(IDENTIFIER, _), Value::Octets(id)) => {
                Ok(self.identifier(id))
            }
            (Resolved::Defined(IDENTIFIER, _), Resolved::Plain(_), Value::Structure(members)) => {
                self.guid(members, member)
            }
            (
                Resolved::Defined(_, Definition::Structure(source)),
                Resolved::Defined(_, Definition::Structure(wanted)),
                Value::Structure(members),
            ) => self.structure((source, wanted), members),
            (
                Resolved::Plain(Type::Sequence { element: source, .. }),
                Resolved::Plain(Type::Sequence { element: wanted, bound }),
                Value::List(elements),
            ) => {
                let length = elements.len();
                if let Some(bound) = bound.filter(|bound| length > *bound as usize) {
                    let (topic, member) = (self.topic.to_owned(), member.to_owned());
                    return Err(Lost::TooLong { topic, member, length, bound });
                }
                let elements = elements.iter().map(|held| self.value(source, wanted, held, member));
                elements.collect::<Result<_, _>>().map(Value::List)
            }
            _ => Ok(value.clone()),
        }
    }

    fn structure(
        &mut self,
        (source, wanted): (&Structure, &Structure),
        members: &[Option<Value>],
    ) -> Result<Value, Lost> {
        let mut converted = Vec::with_capacity(wanted.members.len());
        for member in &wanted.members {
            let place = source.members.iter().position(|known| known.name == member.name);
            let held = place.and_then(|place| Some((&source.members[place], members.get(place)?.as_ref()?)));
            converted.push(match held {
                Some((known, held)) => Some(self.value(&known.r#type, &member.r#type, held, &member.name)?),
                None if member.optional || self.partial => None,
                // A text that may be left out in the one is empty in the other.
                None if matches!(self.to.resolved(&member.r#type), Resolved::Plain(Type::String { .. })) => {
                    Some(Value::Text(String::new()))
                }
                None => {
                    let (topic, member) = (self.topic.to_owned(), member.name.clone());
                    return Err(Lost::Member { topic, member });
                }
            });
        }
        Ok(Value::Structure(converted))
    }

    /// A GUID with the parent that it had, nil where none was told.
    fn identifier(&self, id: &[u8]) -> Value {
        let parent = id.try_into().ok().and_then(|id| self.parents.get(&Guid(id))).copied();
        let parent = parent.unwrap_or(Guid::NIL);
        Value::Structure(vec![Some(Value::Octets(id.to_vec())), Some(Value::Octets(parent.0.to_vec()))])
    }

    fn guid(&mut self, members: &[Option<Value>], member: &str) -> Result<Value, Lost> {
        let part = |place: usize| match members.get(place) {
            Some(Some(Value::Octets(octets))) => octets.as_slice().try_into().ok().map(Guid),
            _ => None,
        };
        let Some(id) = part(0) else {
            return Err(Lost::Member { topic: self.topic.to_owned(), member: member.to_owned() });
        };
        if let Some(parent) = part(1).filter(|parent| *parent != Guid::NIL) {
            if self.parents.len() >= REMEMBERED_MAX {
                self.parents.pop_first();
            }
            self.parents.insert(id, parent);
            self.lost.push(Lost::Parents { topic: self.topic.to_owned() });
        }
        Ok(Value::Octets(id.0.to_vec()))
    }
}

/// A member of a structure's value by its name.
pub(super) fn member<'a>(
    library: &Library,
    type_name: &str,
    value: &'a Value,
    name: &str,
) -> Option<&'a Value> {
    let place = place_of(library, type_name, name)?;
    match value {
        Value::Structure(members) => members.get(place)?.as_ref(),
        _ => None,
    }
}

/// Sets a member of a structure's value by its name.
pub(super) fn set(library: &Library, type_name: &str, value: &mut Value, name: &str, held: Option<Value>) {
    if let (Some(place), Value::Structure(members)) = (place_of(library, type_name, name), value)
        && let Some(member) = members.get_mut(place)
    {
        *member = held;
    }
}

fn place_of(library: &Library, type_name: &str, name: &str) -> Option<usize> {
    library.structure(type_name)?.members.iter().position(|member| member.name == name)
}

/// A GUID of 5.2.1, or the id of an identifier.
pub(super) fn guid_of(value: Option<&Value>) -> Option<Guid> {
    match value? {
        Value::Octets(octets) => octets.as_slice().try_into().ok().map(Guid),
        Value::Structure(members) => guid_of(members.first()?.as_ref()),
        _ => None,
    }
}
