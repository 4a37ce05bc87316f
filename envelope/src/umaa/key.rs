//! Keys: the members marked `@key`, in the order of the wire. In Support Operations all are GUIDs.

use crate::change::{Instance, KeyWidth};
use crate::guid::Guid;
use bytes::Bytes;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The key of a topic.
pub trait Key: Copy + Ord + fmt::Debug + Serialize + Send + Sync + 'static {
    /// The members' names in the IDL.
    const MEMBERS: &'static [&'static str];

    /// The serialized key: big-endian CDR of the members (RTPS 2.5, 9.6.4.8). A GUID is 16 octets without padding.
    fn to_bytes(self) -> Bytes;

    /// Reads a serialized key; none when its length is wrong.
    fn from_bytes(key: &[u8]) -> Option<Self>;

    /// The instance with this key. A single GUID is its own key hash, two and more are digested.
    fn instance(self) -> Instance {
        let width = if Self::MEMBERS.len() == 1 { KeyWidth::Fits16 } else { KeyWidth::Wider };
        Instance::of_key(self.to_bytes(), width)
    }

    /// The key of an instance; none when it is told by a key hash alone from which the key cannot be read.
    fn of_instance(instance: &Instance) -> Option<Self> {
        match &instance.key {
            Some(key) => Self::from_bytes(key),
            None => Self::from_bytes(&instance.hash.0),
        }
    }
}

/// Declares a key: its GUIDs in the order of the wire.
macro_rules! key {
    ($(#[$about:meta])* $name:ident { $($(#[$member_about:meta])* $member:ident = $idl:literal,)+ }) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name { $($(#[$member_about])* #[serde(rename = $idl)] pub $member: Guid,)+ }

        impl Key for $name {
            const MEMBERS: &'static [&'static str] = &[$($idl),+];

            fn to_bytes(self) -> Bytes {
                [$(self.$member.0),+].concat().into()
            }

            fn from_bytes(key: &[u8]) -> Option<Self> {
                let mut guids = key.chunks(16).map(|bytes| bytes.try_into().map(Guid));
                let read = Self { $($member: guids.next()?.ok()?),+ };
                guids.next().is_none().then_some(read)
            }
        }
    };
}

key! {
    /// The key of a report: who reports (table 24).
    SourceKey {
        /// Who reports.
        source = "source",
    }
}

key! {
    /// The key of a health report (table 9).
    HealthKey {
        /// Who reports.
        source = "source",
        /// Whose health it is.
        resource_id = "resourceID",
    }
}

key! {
    /// The key of a command (table 23).
    CommandKey {
        /// The consumer.
        source = "source",
        /// The session, unique among all commands of its kind on the bus.
        session_id = "sessionID",
        /// The provider.
        destination = "destination",
    }
}

key! {
    /// The key of what a provider says of a command (table 25).
    SessionKey {
        /// The provider.
        source = "source",
        /// The command's session.
        session_id = "sessionID",
    }
}

key! {
    /// The key of an element of a large collection (tables 5 and 7).
    ElementKey {
        /// The element, unique among all elements on the bus.
        element_id = "elementID",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::KeyHash;

    const KEY: CommandKey =
        CommandKey { source: Guid([1; 16]), session_id: Guid([2; 16]), destination: Guid([3; 16]) };

    #[test]
    fn a_key_is_its_guids_one_after_the_other() {
        assert_eq!(KEY.to_bytes(), [[1; 16], [2; 16], [3; 16]].concat());
        assert_eq!(CommandKey::from_bytes(&KEY.to_bytes()), Some(KEY));
        for length in [0, 15, 16, 32, 47, 49, 64] {
            assert_eq!(CommandKey::from_bytes(&vec![0; length]), None, "{length} bytes");
        }
        assert_eq!(CommandKey::MEMBERS, ["source", "sessionID", "destination"]);
    }

    #[test]
    fn a_key_comes_back_from_its_instance_where_that_holds_it() {
        assert_eq!(KEY.instance().hash, KeyHash::md5(&[&KEY.to_bytes()]));
        assert_eq!(CommandKey::of_instance(&KEY.instance()), Some(KEY));
        let hash_alone = |instance: Instance| Instance { key: None, ..instance };
        assert_eq!(CommandKey::of_instance(&hash_alone(KEY.instance())), None);
        let element = ElementKey { element_id: Guid([4; 16]) };
        assert_eq!(ElementKey::of_instance(&hash_alone(element.instance())), Some(element));
    }
}
