//! What goes wrong between CDR bytes and values: each error says what, at which byte, in which member.

/// The deepest nesting of values: far above any sample of UMAA, and low enough that no walk runs out of stack.
pub(super) const DEPTH_MAX: usize = 256;

/// Why a sample was not read or written.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{fault}, at byte {offset}{}", if path.is_empty() { String::new() } else { format!(" in `{path}`") })]
pub struct CdrError {
    /// What is wrong.
    pub fault: CdrFault,
    /// Where, in bytes from the start of the sample, its header included.
    pub offset: usize,
    /// In which member; empty for the sample as a whole.
    pub path: String,
}

impl CdrError {
    pub(super) fn new(fault: CdrFault, offset: usize) -> Box<Self> {
        Box::new(Self { fault, offset, path: String::new() })
    }

    /// The same error, seen from what has the member.
    #[cold]
    pub(super) fn within(mut self: Box<Self>, name: &str) -> Box<Self> {
        self.path = match self.path.as_str() {
            "" => name.to_owned(),
            inner if inner.starts_with('[') => format!("{name}{inner}"),
            inner => format!("{name}.{inner}"),
        };
        self
    }

    /// The same error, seen from what has the element.
    #[cold]
    pub(super) fn at_element(self: Box<Self>, index: usize) -> Box<Self> {
        self.within(&format!("[{index}]"))
    }
}

/// What is wrong.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum CdrFault {
    /// The bytes end inside a value.
    #[error("{needed} bytes expected and {left} left")]
    Truncated { needed: usize, left: usize },
    /// The header names no representation that is read here.
    #[error("representation {0:#06x} is not read: plain CDR, plain CDR2 and delimited CDR2 are")]
    Representation(u16),
    /// The header names a representation that the type does not have.
    #[error("a type that is {is} cannot be in representation {found:#06x}")]
    OtherExtensibility { is: &'static str, found: u16 },
    /// A text or a sequence is longer than its bound, or shorter or longer than its array.
    #[error("length {found}, {allowed} allowed")]
    Length { found: u64, allowed: u64 },
    /// A length beyond all bytes that are left.
    #[error("{declared} elements declared and {left} bytes left")]
    LengthBeyondEnd { declared: u64, left: usize },
    /// A text does not end in a zero byte.
    #[error("a text without a zero byte at its end")]
    NoTerminator,
    /// A text is not in its encoding.
    #[error("a text that is not {0}")]
    NotText(&'static str),
    /// A boolean is neither 0 nor 1.
    #[error("a boolean of {0}")]
    NotBoolean(u8),
    /// A value is none of its enumeration.
    #[error("{0} is no value of the enumeration")]
    UnknownLiteral(i64),
    /// A value is outside what its type holds.
    #[error("a value that its type does not hold")]
    OutOfRange,
    /// A parameter header names another member.
    #[error("the header of member {found} where that of member {expected} is due")]
    OtherMember { found: u32, expected: u32 },
    /// A delimiter and what it encloses do not agree.
    #[error("{left} bytes left inside a delimiter after all that it encloses")]
    InsideDelimiter { left: usize },
    /// Nested deeper than any type.
    #[error("nested more than {DEPTH_MAX} deep")]
    TooDeep,
    /// A member that must be there is absent.
    #[error("it must be there and is absent")]
    Absent,
    /// The value is of another kind than its type.
    #[error("{expected} expected")]
    OtherKind { expected: &'static str },
    /// Bytes are left at the end.
    #[error("{0} bytes follow the end")]
    Trailing(usize),
}

/// Why a type cannot be read or written.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SchemaError {
    /// The library does not have it.
    #[error("no structure or union `{0}` is known")]
    Unknown(String),
    /// It is mutable, or holds what is.
    #[error("`{0}` is mutable: only final and appendable types are read and written")]
    Mutable(String),
}
