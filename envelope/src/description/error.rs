//! What makes descriptions unsound.

use super::{ARRAY_ELEMENTS_MAX, DEPTH_MAX, MEMBER_ID_MAX, MEMBERS_MAX};

/// What is wrong with a definition, and where.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{type_name}`{}: {fault}", member.as_ref().map(|name| format!(", member `{name}`")).unwrap_or_default())]
pub struct DescriptionError {
    /// The definition's fully scoped name.
    pub type_name: String,
    /// The member that is wrong, where it is one.
    pub member: Option<String>,
    /// What is wrong.
    pub fault: Fault,
}

/// What is wrong with a definition.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum Fault {
    /// The name is none.
    #[error("this is no name: names are letters, digits and `_`, joined by `::`")]
    BadName,
    /// The name has two meanings.
    #[error("defined twice with different contents: keep one of them")]
    DefinedTwice,
    /// Nothing has that name.
    #[error("no type `{0}` is known: define it, or include the file that does")]
    UnknownType(String),
    /// A value would hold another one of its own type, without end.
    #[error("it holds itself: let it hold a sequence of its own type, or make a member optional")]
    HoldsItself,
    /// The nesting is deeper than [`DEPTH_MAX`].
    #[error("nested more than {DEPTH_MAX} deep")]
    TooDeep,
    /// Two members, values or bits share a name.
    #[error("the name `{0}` is there twice")]
    DuplicateName(String),
    /// Two members share an id, or two values a number.
    #[error("the number {0} is there twice")]
    DuplicateNumber(i64),
    /// The id of a member is too high.
    #[error("the id {0} is over {MEMBER_ID_MAX}")]
    IdTooHigh(u32),
    /// A number does not fit.
    #[error("{value} does not fit in {bits} bits")]
    DoesNotFit { value: i64, bits: u16 },
    /// The bits of an enumeration or a bitmask are too many, or none.
    #[error("{found} bits, 1 to {max} are allowed")]
    BadBitBound { found: u16, max: u16 },
    /// An enumeration without values, or a union without cases.
    #[error("there is nothing in it")]
    Empty,
    /// The default is no value of the enumeration.
    #[error("the default {0} is none of its values")]
    UnknownDefault(i32),
    /// The bound of a text or sequence is zero, or a dimension of an array.
    #[error("a bound or dimension of 0")]
    ZeroBound,
    /// An array is larger than [`ARRAY_ELEMENTS_MAX`], with all that it stands in.
    #[error("more than {ARRAY_ELEMENTS_MAX} elements in arrays")]
    ArrayTooLarge,
    /// Members of members of members are more than [`MEMBERS_MAX`].
    #[error("more than {MEMBERS_MAX} members, with those of all that it holds")]
    TooManyMembers,
    /// A key may not be absent.
    #[error("a key cannot be optional")]
    OptionalKey,
    /// What is inherited from is no structure.
    #[error("`{0}` is no structure, so nothing can inherit from it")]
    BaseIsNoStructure(String),
    /// What is inherited from grows in another way.
    #[error("its extensibility differs from that of `{0}`, which it inherits from")]
    BaseGrowsOtherwise(String),
    /// The discriminator's type cannot choose.
    #[error("a discriminator is a boolean, an octet, a character, a whole number or an enumeration")]
    BadDiscriminator,
    /// Two cases are default.
    #[error("two cases are the default")]
    TwoDefaults,
    /// A case that nothing chooses.
    #[error("a case without a label")]
    NoLabel,
}
