//! Zenoh key expressions: where an envelope is put, what a subscription declares, and the way back.
//!
//! ```text
//! aldis/<fleet>/<source eid>/<source sid>/<instance>/<address>
//! aldis/<fleet>/@<space>/…
//! ```

pub mod escape;

use crate::address::Address;
use crate::change::{Instance, KeyHash};
use crate::id::{EntityId, Source};
use crate::message::Label;
use crate::name::{NameError, looks_like_an_id};
use crate::prefix::Prefix;
use escape::{Spelling, escape, escape_prefix, unescape};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::sync::Arc;

/// The name of a fleet: one chunk of every key, letters, digits, `-` and `_`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Fleet(Arc<str>);

/// The text is not the name of a fleet.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a fleet name: 1 to 64 letters, digits, `-` or `_`")]
pub struct FleetError(String);

impl Fleet {
    /// A fleet from its name.
    ///
    /// # Errors
    /// [`FleetError`] when the name is not 1 to 64 letters, digits, `-` or `_`.
    pub fn new(name: &str) -> Result<Self, FleetError> {
        let plain = |b: u8| b.is_ascii_alphanumeric() || b == b'-' || b == b'_';
        if (1..=64).contains(&name.len()) && name.bytes().all(plain) {
            Ok(Self(name.into()))
        } else {
            Err(FleetError(crate::name::shortened(name)))
        }
    }

    /// The name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl TryFrom<String> for Fleet {
    type Error = FleetError;
    fn try_from(name: String) -> Result<Self, FleetError> {
        Self::new(&name)
    }
}

impl From<Fleet> for String {
    fn from(fleet: Fleet) -> String {
        fleet.0.as_ref().to_owned()
    }
}

impl fmt::Display for Fleet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// A part of the key space.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Space {
    /// Puts and deletes of envelopes.
    Data,
    /// Unregisters: puts that erase nothing.
    Writer,
    /// What writers' nodes tell readers' nodes of what they retain.
    State,
    /// What readers' nodes tell writers' nodes: that they are there, what they have, what they miss.
    Ack,
    /// Liveliness tokens of services.
    Alive,
}

impl Space {
    /// The chunk that stands before the source, where the space has one.
    fn chunk(self) -> Option<&'static str> {
        match self {
            Self::Data => None,
            Self::Writer => Some("@writer"),
            Self::State => Some("@state"),
            Self::Ack => Some("@ack"),
            Self::Alive => Some("@alive"),
        }
    }
}

/// Why a key is none of ours, or cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum KeyError {
    /// The key is not in the key space of the fleet.
    #[error("key `{0}` is not of this fleet's form `aldis/<fleet>/<eid>/<sid>/<instance>/<address>`")]
    Foreign(String),
    /// A chunk is not what must stand there.
    #[error("key `{key}`: {what}")]
    Chunk {
        /// The key, shortened.
        key: String,
        /// What is wrong.
        what: String,
    },
}

/// A key taken apart. The address stays escaped until the header says how it was spelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ParsedKey<'a> {
    /// Which part of the key space.
    pub space: Space,
    /// Who put it.
    pub source: Source,
    /// The instance chunk; none is `-`.
    pub instance: Option<KeyHash>,
    /// The chunks of the address; empty in [`Space::Alive`].
    pub address: &'a str,
}

/// Builds and reads the keys of one fleet.
#[derive(Debug, Clone)]
pub struct Keys {
    root: String,
}

impl Keys {
    /// The keys of a fleet.
    pub fn new(fleet: &Fleet) -> Self {
        Self { root: format!("aldis/{fleet}") }
    }

    /// Where envelopes with this label and instance are put: `Space::Writer` for an unregister, `Space::State` and
    /// `Space::Ack` for what nodes tell one another, else `Space::Data`.
    pub fn envelope(&self, space: Space, label: &Label, instance: Option<&Instance>) -> String {
        use fmt::Write;
        let mut key = String::with_capacity(self.root.len() + 96);
        key.push_str(&self.root);
        if let Some(chunk) = space.chunk() {
            key.push('/');
            key.push_str(chunk);
        }
        let source = label.source();
        // Writing to a String cannot fail.
        let _ = write!(key, "/{}/{}/", source.entity, source.service);
        let _ = match instance {
            None => key.write_str("-"),
            Some(instance) => write!(key, "{}", instance_chunk(label, instance)),
        };
        key.push('/');
        address_chunks(&label.address, &mut key);
        key
    }

    /// The one key expression that a subscription declares: it may match too much, never too little.
    pub fn subscription(&self, space: Space, prefix: &Prefix) -> String {
        let mut key = self.root.clone();
        if let Some(chunk) = space.chunk() {
            key.push('/');
            key.push_str(chunk);
        }
        key.push_str("/*/*/*/");
        match prefix {
            Prefix::Text(text) => escape_prefix(text, &mut key),
            Prefix::Id(id) => {
                address_chunks(id, &mut key);
                if matches!(id, Address::Entity(_)) {
                    key.push_str("/**");
                }
            }
        }
        key
    }

    /// The key expressions that receive all that some prefixes receive, none inside another: a session gets a sample
    /// once for each of its subscribers that match.
    pub fn cover(&self, space: Space, prefixes: &[Prefix]) -> Vec<String> {
        let mut expressions: Vec<_> = prefixes.iter().map(|p| self.subscription(space, p)).collect();
        expressions.sort();
        expressions.dedup();
        // What an expression meets is every key that begins with its certain part; an id's ends at a chunk's end.
        let certain =
            |e: &str| e.trim_end_matches("/**").trim_end_matches("$*").trim_end_matches("**").to_owned();
        let inside = |inner: &String, outer: &String| {
            let is_text = outer.ends_with("$*/**") || outer.ends_with("*/*/**");
            let (i, o) = (certain(inner), certain(outer));
            inner != outer && i.strip_prefix(&o).is_some_and(|rest| is_text || rest.starts_with('/'))
        };
        let kept = |e: &&String| !expressions.iter().any(|outer| inside(e, outer));
        expressions.iter().filter(kept).cloned().collect()
    }

    /// All that an entity puts in a space: what access control allows it.
    pub fn of_entity(&self, space: &str, entity: EntityId) -> String {
        match space {
            "" => format!("{}/{entity}/**", self.root),
            space => format!("{}/{space}/{entity}/**", self.root),
        }
    }

    /// Where one entity puts the frames of a link to another, by the carrier with this number.
    pub fn link_frames(&self, from: EntityId, to: EntityId, carrier: u8) -> String {
        format!("{}/@link/{from}/{to}/{carrier}", self.root)
    }

    /// The liveliness token of a service.
    pub fn alive(&self, source: Source) -> String {
        format!("{}/@alive/{}/{}", self.root, source.entity, source.service)
    }

    /// All liveliness tokens of the fleet.
    pub fn every_alive(&self) -> String {
        format!("{}/@alive/*/*", self.root)
    }

    /// Everything of the fleet in the data space.
    pub fn everything(&self) -> String {
        format!("{}/**", self.root)
    }

    /// Takes a key apart.
    ///
    /// # Errors
    /// [`KeyError`] when the key is of another fleet or form.
    pub fn parse<'a>(&self, key: &'a str) -> Result<ParsedKey<'a>, KeyError> {
        let foreign = || KeyError::Foreign(crate::name::shortened(key));
        let chunk = |what: String| KeyError::Chunk { key: crate::name::shortened(key), what };
        let rest = key.strip_prefix(&self.root).and_then(|r| r.strip_prefix('/')).ok_or_else(foreign)?;
        let (space, rest) = match rest.split_once('/') {
            Some(("@writer", rest)) => (Space::Writer, rest),
            Some(("@state", rest)) => (Space::State, rest),
            Some(("@ack", rest)) => (Space::Ack, rest),
            Some(("@alive", rest)) => (Space::Alive, rest),
            Some(_) if !rest.starts_with('@') => (Space::Data, rest),
            _ => return Err(foreign()),
        };
        let mut chunks = rest.splitn(if space == Space::Alive { 2 } else { 4 }, '/');
        let mut next = || chunks.next().ok_or_else(foreign);
        let entity = next()?.parse().map_err(|e| chunk(format!("source entity: {e}")))?;
        let service = next()?.parse().map_err(|e| chunk(format!("source service: {e}")))?;
        let source = Source::new(entity, service);
        if space == Space::Alive {
            return Ok(ParsedKey { space, source, instance: None, address: "" });
        }
        let instance = match next()? {
            "-" => None,
            hash => Some(hash.parse().map_err(|e| chunk(format!("instance: {e}")))?),
        };
        Ok(ParsedKey { space, source, instance, address: next()? })
    }
}

/// The instance chunk: the key hash, or on a limitedcast a digest that keeps two topics to one service apart.
pub(crate) fn instance_chunk(label: &Label, instance: &Instance) -> KeyHash {
    match (&instance.key, label.is_broadcast()) {
        (Some(key), false) => KeyHash::md5(&[label.descriptor().as_bytes(), &[0], key]),
        _ => instance.hash,
    }
}

fn address_chunks(address: &Address, key: &mut String) {
    use fmt::Write;
    // Writing to a String cannot fail.
    let _ = match address {
        Address::Name(name) => {
            escape(name.as_str(), key);
            Ok(())
        }
        Address::Service(to) => write!(key, "eid{}/sid{}", to.entity, to.service),
        Address::EntityServices(entity) => write!(key, "eid{entity}/sidall"),
        Address::Entity(entity) => write!(key, "eid{entity}"),
    };
}

/// The address that stands in chunks of a key, spelled as the header says.
///
/// # Errors
/// What is wrong, in words, when the chunks hold no address or the exact text does not belong to them.
pub(crate) fn address_from_chunks(chunks: &str, spelling: &Spelling) -> Result<Address, String> {
    if looks_like_an_id(chunks) {
        let text = chunks.replacen('/', ".", 1);
        let address = Address::new(&text).map_err(|e: NameError| e.to_string())?;
        let mut again = String::with_capacity(chunks.len());
        address_chunks(&address, &mut again);
        // On a key of its own spelling a message would pass by those who subscribed to the id.
        return if again == chunks {
            Ok(address)
        } else {
            Err(format!("the chunks `{chunks}` are not those of `{address}`"))
        };
    }
    let text = unescape(chunks, spelling)?;
    Address::new(&text).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests;
