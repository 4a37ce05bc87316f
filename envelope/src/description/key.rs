//! Keys of types: which members they are, down to the last number, and whether they always fit a key hash.

use super::library::Resolved;
use super::{Definition, Library, Member, Type};
use crate::change::KeyWidth;

/// A member that is part of a key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeyMember {
    /// The way to it from the sample, as in `source.id`.
    pub path: String,
    /// Its type, which is no structure.
    pub r#type: Type,
}

impl Library {
    /// The members of a structure's key in the order of their declaration, those of nested structures one by one. A nested structure
    /// without a key of its own is a key with all its members (DDS-XTypes 1.3, 7.2.2.4.4.4.8).
    pub fn key_members(&self, type_name: &str) -> Vec<KeyMember> {
        let mut found = Vec::new();
        if let Some(structure) = self.structure(type_name) {
            let keys = self.members(structure).into_iter().filter(|member| member.key);
            keys.for_each(|member| self.keys_of("", member, &mut found));
        }
        found
    }

    fn keys_of(&self, before: &str, member: &Member, found: &mut Vec<KeyMember>) {
        let path = format!("{before}{}", member.name);
        match self.resolved(&member.r#type) {
            Resolved::Defined(_, Definition::Structure(structure)) => {
                let before = format!("{path}.");
                let members = self.key_part(self.members(structure));
                members.iter().for_each(|member| self.keys_of(&before, member, found));
            }
            _ => found.push(KeyMember { path, r#type: member.r#type.clone() }),
        }
    }

    /// The members of a nested structure that are part of a key which it is part of.
    pub(crate) fn key_part<'a>(&self, mut members: Vec<&'a Member>) -> Vec<&'a Member> {
        let some = members.iter().any(|member| member.key);
        members.retain(|member| if some { member.key } else { !member.optional });
        members
    }

    /// Whether every key of a type fits the 16 bytes of a key hash (RTPS 2.5, 9.6.4.8).
    pub fn key_width(&self, type_name: &str) -> KeyWidth {
        let Some(structure) = self.structure(type_name) else { return KeyWidth::Wider };
        let mut keys: Vec<_> = self.members(structure).into_iter().filter(|member| member.key).collect();
        keys.sort_by_key(|member| member.id);
        let end = keys.iter().try_fold(0, |at, member| self.end_of(&member.r#type, at));
        if end.is_some_and(|end| end <= 16) { KeyWidth::Fits16 } else { KeyWidth::Wider }
    }

    /// Where the longest value of a type ends that begins at `at`, in XCDR2 without headers; none beyond 16 bytes.
    fn end_of(&self, r#type: &Type, at: usize) -> Option<usize> {
        let number = |size: usize| {
            let end = at.next_multiple_of(size.min(4)) + size;
            (end <= 16).then_some(end)
        };
        match self.resolved(r#type) {
            Resolved::Plain(Type::String { bound: Some(bound) }) => {
                let end = at.next_multiple_of(4) + 5 + *bound as usize;
                (end <= 16).then_some(end)
            }
            Resolved::Plain(Type::Array { element, dimensions }) => {
                let length = dimensions.iter().try_fold(1_u32, |all, one| all.checked_mul(*one))?;
                if length > 16 {
                    return None;
                }
                // Elements that are no plain numbers have their length in bytes in front.
                let headed = match self.resolved(element) {
                    Resolved::Plain(plain) => plain.primitive_size().is_none(),
                    Resolved::Defined(..) => true,
                };
                let at = if headed { at.next_multiple_of(4) + 4 } else { at };
                (0..length).try_fold(at, |at, _| self.end_of(element, at))
            }
            Resolved::Plain(plain) => number(plain.primitive_size()?),
            Resolved::Defined(_, Definition::Enumeration(enumeration)) => number(enumeration.size()),
            Resolved::Defined(_, Definition::Bitmask(bitmask)) => number(bitmask.size()),
            Resolved::Defined(_, Definition::Structure(structure)) => {
                let mut members = self.key_part(self.members(structure));
                members.sort_by_key(|member| member.id);
                members.iter().try_fold(at, |at, member| self.end_of(&member.r#type, at))
            }
            Resolved::Defined(..) => None,
        }
    }
}
