//! How structures are declared: once, with the names and keys of the IDL, for Rust, for JSON and as descriptions.

use super::{
    CommandAckReport, CommandState, CommandStatus, CommandStatusReason, LongDescription, Sequence, Topic,
};
use super::{DurationSeconds, LargeCollectionSize};
use crate::description::{Definition, DescriptionError, Draft, Extensibility, Member, Structure, Type};
use crate::guid::Guid;
use crate::time::DateTime;

/// A type that says of itself what its IDL says of it.
pub trait Described {
    /// Whether a member of this type may be absent.
    const OPTIONAL: bool = false;

    /// Its type, after all that it needs has been added to the draft.
    ///
    /// # Errors
    /// [`DescriptionError`] where the draft holds something else under a name that it needs.
    fn described(draft: &mut Draft) -> Result<Type, DescriptionError>;
}

/// Adds a definition and gives its name as a type.
pub(super) fn define(
    draft: &mut Draft,
    name: &str,
    definition: Definition,
) -> Result<Type, DescriptionError> {
    draft.add(name, definition)?;
    Ok(Type::named(name))
}

/// Members of a structure, numbered in their order.
#[derive(Default)]
pub(super) struct Members(Vec<Member>);

impl Members {
    pub(super) fn add<T: Described>(
        &mut self,
        draft: &mut Draft,
        name: &str,
        key: bool,
    ) -> Result<(), DescriptionError> {
        let member = Member::new(self.0.len() as u32, name, T::described(draft)?);
        self.0.push(Member { key, optional: T::OPTIONAL, ..member });
        Ok(())
    }

    /// The structure with these members. UMAA's IDL annotates none: all are appendable (spec: types on the wire).
    pub(super) fn define(self, draft: &mut Draft, name: &str) -> Result<Type, DescriptionError> {
        let extensibility = Extensibility::Appendable;
        let structure = Structure { extensibility, base: None, members: self.0 };
        define(draft, name, Definition::Structure(structure))
    }
}

/// Declares a structure: its members in the order of the wire, each with its name in the IDL and `[key]` where it is one.
macro_rules! structure {
    ($(#[$about:meta])* $name:ident = $idl:literal {
        $($(#[$member_about:meta])* $member:ident: $held:ty = $member_idl:literal $([$key:ident])?,)+
    }) => {
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        $(#[$about])*
        pub struct $name {
            $($(#[$member_about])* #[serde(rename = $member_idl)] pub $member: $held,)+
        }

        impl $crate::umaa::structure::Described for $name {
            fn described(
                draft: &mut $crate::description::Draft,
            ) -> Result<$crate::description::Type, $crate::description::DescriptionError> {
                let mut members = $crate::umaa::structure::Members::default();
                $(members.add::<$held>(draft, $member_idl, !concat!("", $(stringify!($key))?).is_empty())?;)+
                members.define(draft, $idl)
            }
        }
    };
}

pub(super) use structure;

/// Names a plain type as the ICD does (table 38).
macro_rules! plain {
    ($($held:ty = $idl:literal: $plain:expr;)+) => {
        $(impl Described for $held {
            fn described(draft: &mut Draft) -> Result<Type, DescriptionError> {
                define(draft, $idl, Definition::Alias($plain))
            }
        })+
    };
}

plain! {
    Guid = "UMAA::Common::Measurement::NumericGUID": Type::array(Type::Octet, 16);
    LongDescription = "UMAA::Common::Measurement::StringLongDescription":
        Type::String { bound: Some(LongDescription::MAX as u32) };
    DurationSeconds = "UMAA::Common::Measurement::DurationSeconds": Type::Float64;
    LargeCollectionSize = "UMAA::Common::Measurement::LargeCollectionSize": Type::Int32;
}

impl Described for DateTime {
    fn described(draft: &mut Draft) -> Result<Type, DescriptionError> {
        let members =
            vec![Member::new(0, "seconds", Type::Int64), Member::new(1, "nanoseconds", Type::Int32)];
        let structure = Structure { extensibility: Extensibility::Appendable, base: None, members };
        define(draft, "UMAA::Common::Measurement::DateTime", Definition::Structure(structure))
    }
}

impl<T: Described> Described for Option<T> {
    const OPTIONAL: bool = true;

    fn described(draft: &mut Draft) -> Result<Type, DescriptionError> {
        T::described(draft)
    }
}

impl<T: Described, const MAX: usize> Described for Sequence<T, MAX> {
    fn described(draft: &mut Draft) -> Result<Type, DescriptionError> {
        Ok(Type::sequence(T::described(draft)?, u32::try_from(MAX).ok()))
    }
}

impl<C: super::Command> Described for CommandStatus<C> {
    fn described(draft: &mut Draft) -> Result<Type, DescriptionError> {
        let mut members = Members::default();
        members.add::<DateTime>(draft, "timeStamp", false)?;
        members.add::<Guid>(draft, "source", true)?;
        members.add::<Guid>(draft, "sessionID", true)?;
        members.add::<CommandState>(draft, "commandStatus", false)?;
        members.add::<CommandStatusReason>(draft, "commandStatusReason", false)?;
        members.add::<LongDescription>(draft, "logMessage", false)?;
        members.define(draft, Self::TYPE_NAME)
    }
}

impl<C: super::Command + Described> Described for CommandAckReport<C> {
    fn described(draft: &mut Draft) -> Result<Type, DescriptionError> {
        let mut members = Members::default();
        members.add::<C>(draft, "command", false)?;
        members.add::<DateTime>(draft, "timeStamp", false)?;
        members.add::<Guid>(draft, "source", true)?;
        members.add::<Guid>(draft, "sessionID", true)?;
        members.define(draft, Self::TYPE_NAME)
    }
}
