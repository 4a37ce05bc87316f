//! GUIDs of services and resources (umaa-so, GUIDs).
//!
//! ```text
//! eid 48 bits | version 8, 4 bits | fleet hash, 12 bits | variant, 2 bits | sid 32 bits | fleet hash, 30 more bits
//! ```

use crate::change::KeyHash;
use crate::id::{EntityId, ServiceId, Source};
use crate::key::Fleet;
use crate::time::Wall;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::fmt;
use std::str::FromStr;
use uuid::Uuid;

/// The namespace of name-based GUIDs: drawn once, never to change.
const NAMESPACE: Uuid = Uuid::from_u128(0x6b1d_43f2_5a0e_4c77_9d0b_a1d1_5f1a_6e55);

/// A UMAA `NumericGUID`: any RFC 4122 GUID, 16 bytes in the order of its text. In forms for people it is its text.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Guid(pub [u8; 16]);

impl Guid {
    /// The GUID of nothing, all bits zero (RFC 4122, 4.1.7): the last element of a collection that is empty.
    pub const NIL: Self = Self([0; 16]);

    /// Whether its variant is that of RFC 4122, which the ICD asks for in 3.7. Others are carried all the same.
    pub fn is_rfc4122(self) -> bool {
        Uuid::from_bytes(self.0).get_variant() == uuid::Variant::RFC4122
    }
}

impl Serialize for Guid {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            serializer.collect_str(self)
        } else {
            self.0.serialize(serializer)
        }
    }
}

impl<'de> Deserialize<'de> for Guid {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if deserializer.is_human_readable() {
            String::deserialize(deserializer)?.parse().map_err(de::Error::custom)
        } else {
            Deserialize::deserialize(deserializer).map(Self)
        }
    }
}

impl fmt::Display for Guid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Uuid::from_bytes(self.0).fmt(f)
    }
}

impl fmt::Debug for Guid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// The text is not a GUID.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a GUID like 00000000-0190-8abc-8000-000940000000")]
pub struct GuidError(String);

impl FromStr for Guid {
    type Err = GuidError;
    fn from_str(text: &str) -> Result<Self, GuidError> {
        let uuid = Uuid::parse_str(text).map_err(|_| GuidError(crate::name::shortened(text)))?;
        Ok(Self(uuid.into_bytes()))
    }
}

/// How the GUIDs of a fleet's own services are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum GuidForm {
    /// Version 8 with the ids inside: a receiver reads entity and service from it.
    #[default]
    Readable,
    /// Version 5, from names alone: never read, only learned.
    V5,
}

/// Makes and reads the GUIDs of one fleet.
#[derive(Debug, Clone)]
pub struct Guids {
    form: GuidForm,
    fleet: Fleet,
    hash: u64,
}

impl Guids {
    /// The GUIDs of a fleet.
    pub fn new(fleet: &Fleet, form: GuidForm) -> Self {
        let KeyHash(digest) = KeyHash::md5(&[fleet.as_str().as_bytes()]);
        let mut first = [0; 8];
        first.copy_from_slice(&digest[..8]);
        Self { form, fleet: fleet.clone(), hash: u64::from_be_bytes(first) >> 22 }
    }

    /// The GUID of a service.
    pub fn of_service(&self, source: Source) -> Guid {
        match self.form {
            GuidForm::Readable => self.readable(source),
            GuidForm::V5 => self.named(&source.to_string()),
        }
    }

    /// The GUID of a resource that is no service: a disk, a device.
    pub fn of_resource(&self, entity: EntityId, name: &str) -> Guid {
        self.named(&format!("eid{entity}/{name}"))
    }

    /// The GUID of a consumer's session: one for each time and number, never the same again.
    pub fn of_session(&self, consumer: Guid, at: Wall, number: u64) -> Guid {
        self.named(&format!("{consumer}/session/{}/{number}", at.0))
    }

    /// The service that a readable GUID of this fleet names; none for any other GUID.
    pub fn service(&self, guid: Guid) -> Option<Source> {
        let bits = u128::from_be_bytes(guid.0);
        let entity = EntityId::new((bits >> 80) as u64).ok()?;
        let service = ServiceId::new((bits >> 30) as u64 & u64::from(u32::MAX)).ok()?;
        let source = Source::new(entity, service);
        (self.readable(source) == guid).then_some(source)
    }

    fn readable(&self, source: Source) -> Guid {
        let upper_hash = u128::from(self.hash >> 30);
        let lower_hash = u128::from(self.hash & 0x3fff_ffff);
        let bits = u128::from(source.entity.get()) << 80
            | 8 << 76
            | upper_hash << 64
            | 0b10 << 62
            | u128::from(source.service.get()) << 30
            | lower_hash;
        Guid(bits.to_be_bytes())
    }

    fn named(&self, name: &str) -> Guid {
        Guid(Uuid::new_v5(&NAMESPACE, format!("{}/{name}", self.fleet).as_bytes()).into_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn guids(form: GuidForm) -> Guids {
        Guids::new(&Fleet::new("blue").unwrap(), form)
    }

    fn source(entity: u64, service: u64) -> Source {
        Source::new(EntityId::new(entity).unwrap(), ServiceId::new(service).unwrap())
    }

    #[test]
    fn version_and_variant_are_those_of_rfc_9562() {
        for (form, version) in [(GuidForm::Readable, 8), (GuidForm::V5, 5)] {
            let uuid = Uuid::from_bytes(guids(form).of_service(source(400, 37)).0);
            assert_eq!(uuid.get_version_num(), version);
            assert_eq!(uuid.get_variant(), uuid::Variant::RFC4122);
        }
        assert!(
            guids(GuidForm::Readable).of_service(source(400, 37)).to_string().starts_with("00000000-0190-8")
        );
    }

    #[test]
    fn sessions_differ_by_consumer_time_and_number() {
        let guids = guids(GuidForm::Readable);
        let (one, other) = (guids.of_service(source(1, 100)), guids.of_service(source(2, 100)));
        let session = guids.of_session(one, Wall(5), 1);
        assert_eq!(session, guids.of_session(one, Wall(5), 1));
        let others = [(other, 5, 1), (one, 6, 1), (one, 5, 2)];
        assert!(others.iter().all(|&(who, at, number)| guids.of_session(who, Wall(at), number) != session));
        assert!(session.is_rfc4122());
    }

    #[test]
    fn only_readable_guids_of_the_own_fleet_are_read() {
        let blue = guids(GuidForm::Readable);
        let red = Guids::new(&Fleet::new("red").unwrap(), GuidForm::Readable);
        assert_eq!(blue.service(red.of_service(source(400, 37))), None);
        assert_eq!(blue.service(guids(GuidForm::V5).of_service(source(400, 37))), None);
        assert_eq!(blue.service(blue.of_resource(EntityId::new(400).unwrap(), "disk")), None);
    }

    #[test]
    fn people_read_text_and_machines_read_bytes() {
        let guid = guids(GuidForm::Readable).of_service(source(400, 37));
        let text = serde_json::to_string(&guid).unwrap();
        assert_eq!(text, format!("\"{guid}\""));
        assert_eq!(serde_json::from_str::<Guid>(&text).unwrap(), guid);
        let why = serde_json::from_str::<Guid>("\"400\"").unwrap_err().to_string();
        assert!(why.contains("`400` is not a GUID"), "{why}");
        assert_eq!(postcard::to_allocvec(&guid).unwrap(), guid.0);
        assert!(guid.is_rfc4122() && !Guid::NIL.is_rfc4122());
    }

    proptest! {
        #[test]
        fn a_readable_guid_gives_its_ids_back(entity in 1..=EntityId::MAX, service in 1..=ServiceId::MAX) {
            let guids = guids(GuidForm::Readable);
            prop_assert_eq!(guids.service(guids.of_service(source(entity, service))), Some(source(entity, service)));
        }
    }
}
