//! What goes wrong between bytes and objects: each error says what, at which byte, in which field.

use std::fmt;

use thiserror::Error;

use super::schema::SeriesName;

/// Why a message was not decoded.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{fault}, at byte {offset}{}", Within(path))]
pub struct DecodeError {
    /// What is wrong.
    pub fault: DecodeFault,
    /// Where, in bytes from the start of what was given to decode.
    pub offset: usize,
    /// In which field; empty for the message as a whole.
    pub path: FieldPath,
}

impl DecodeError {
    pub(super) fn new(fault: DecodeFault, offset: usize) -> Self {
        Self { fault, offset, path: FieldPath::default() }
    }

    /// The same error, seen from bytes that have `before` more in front.
    pub fn after(mut self, before: usize) -> Self {
        self.offset += before;
        self
    }

    /// The same error, seen from the object that has the field.
    #[cold]
    pub(super) fn in_field(mut self: Box<Self>, name: &'static str) -> Box<Self> {
        self.path.push_field(name);
        self
    }

    /// The same error, seen from the array that has the element.
    #[cold]
    pub(super) fn in_element(mut self: Box<Self>, index: usize) -> Box<Self> {
        self.path.push_index(index);
        self
    }

    /// Whether the message may be sound, only its type or version is not known here: such a message
    /// is carried opaque.
    pub fn is_unknown_type(&self) -> bool {
        matches!(
            self.fault,
            DecodeFault::UnknownSeries(_) | DecodeFault::UnknownType { .. } | DecodeFault::Version { .. }
        )
    }
}

/// What is wrong with the bytes of a message.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum DecodeFault {
    /// The message does not begin with `LMCP`.
    #[error("not an LMCP message")]
    NotLmcp,
    /// The bytes end inside a value.
    #[error("{needed} bytes expected and {left} left")]
    Truncated {
        /// Bytes that the value takes.
        needed: usize,
        /// Bytes that are left.
        left: usize,
    },
    /// The message is longer or shorter than its header declares.
    #[error("{declared} bytes declared and {found} found")]
    Length {
        /// The whole length by the header: its size field and 12.
        declared: u64,
        /// The length that was given.
        found: usize,
    },
    /// The checksum is neither 0 nor the sum of the bytes before it.
    #[error("checksum {declared:#010x} declared and {computed:#010x} computed")]
    Checksum {
        /// What the message ends with.
        declared: u32,
        /// The sum of all bytes before.
        computed: u32,
    },
    /// The root object ends before the size that the header declares for it.
    #[error("{0} bytes after the root object")]
    Trailing(usize),
    /// The root object is null.
    #[error("no root object")]
    NullRoot,
    /// No such series is declared here.
    #[error("series {0} is not known")]
    UnknownSeries(SeriesName),
    /// The series has no type of this number.
    #[error("type {id} of series {series} is not known")]
    UnknownType {
        /// The series.
        series: SeriesName,
        /// The type number.
        id: u32,
    },
    /// The series is known in another version.
    #[error("version {found} of series {series} where {known} is known")]
    Version {
        /// The series.
        series: SeriesName,
        /// The version of the object.
        found: u16,
        /// The version declared here.
        known: u16,
    },
    /// The byte that tells whether an object is there is neither 0 nor 1.
    #[error("presence is 0 or 1, not {0}")]
    Presence(u8),
    /// The byte of a truth value is neither 0 nor 1.
    #[error("a truth value is 0 or 1, not {0}")]
    Bool(u8),
    /// Text is not UTF-8.
    #[error("text is not UTF-8")]
    Text,
    /// So many elements cannot be in the bytes that are left.
    #[error("an array of {count} elements does not fit in {left} bytes")]
    Count {
        /// The declared number of elements.
        count: usize,
        /// Bytes that are left.
        left: usize,
    },
    /// An object of a type that its field does not hold.
    #[error("{found} where {expected} is declared")]
    Kind {
        /// The type that the field declares.
        expected: &'static str,
        /// The type of the object.
        found: &'static str,
    },
    /// Objects are nested deeper than [`DEPTH_MAX`](super::DEPTH_MAX).
    #[error("objects nested too deep")]
    Depth,
    /// The decoded form would take more memory than a message of this length is allowed.
    #[error("the decoded form takes more memory than the message is allowed")]
    Memory,
}

/// Why an object was not encoded.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{fault}{}", Within(path))]
pub struct EncodeError {
    /// What is wrong.
    pub fault: EncodeFault,
    /// In which field; empty for the message as a whole.
    pub path: FieldPath,
}

impl EncodeError {
    pub(super) fn new(fault: EncodeFault) -> Self {
        Self { fault, path: FieldPath::default() }
    }

    /// The same error, seen from the object that has the field.
    #[cold]
    pub(super) fn in_field(mut self: Box<Self>, name: &'static str) -> Box<Self> {
        self.path.push_field(name);
        self
    }

    /// The same error, seen from the array that has the element.
    #[cold]
    pub(super) fn in_element(mut self: Box<Self>, index: usize) -> Box<Self> {
        self.path.push_index(index);
        self
    }
}

/// What the wire cannot carry.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum EncodeFault {
    /// An array longer than its count can tell.
    #[error("an array of {count} elements, {max} at most")]
    Count {
        /// Elements in the array.
        count: usize,
        /// The most that the count can tell.
        max: usize,
    },
    /// A text longer than its length can tell.
    #[error("a text of {0} bytes, 65535 at most")]
    Text(usize),
    /// A message longer than its size can tell.
    #[error("a message of {0} bytes, 4294967295 at most")]
    Size(usize),
    /// Objects are nested deeper than [`DEPTH_MAX`](super::DEPTH_MAX).
    #[error("objects nested too deep")]
    Depth,
}

/// The way from the root object to a value, such as `WaypointList[3].Latitude`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FieldPath {
    /// Innermost first: an error meets them on its way up.
    steps: Vec<Step>,
}

/// What one step of a path takes in memory.
pub(super) const PATH_STEP: usize = size_of::<Step>();

#[derive(Debug, Clone, PartialEq, Eq)]
enum Step {
    Field(&'static str),
    Index(usize),
}

impl FieldPath {
    /// Whether the path names no field.
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    pub(super) fn push_field(&mut self, name: &'static str) {
        self.push(Step::Field(name));
    }

    pub(super) fn push_index(&mut self, index: usize) {
        self.push(Step::Index(index));
    }

    /// Room for this one step alone, so that what an error takes is known.
    fn push(&mut self, step: Step) {
        self.steps.reserve_exact(1);
        self.steps.push(step);
    }
}

impl fmt::Display for FieldPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (depth, step) in self.steps.iter().rev().enumerate() {
            match step {
                Step::Field(name) if depth == 0 => f.write_str(name)?,
                Step::Field(name) => write!(f, ".{name}")?,
                Step::Index(index) => write!(f, "[{index}]")?,
            }
        }
        Ok(())
    }
}

/// ` in PATH`, or nothing for the empty path.
pub(super) struct Within<'a>(pub(super) &'a FieldPath);

impl fmt::Display for Within<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() { Ok(()) } else { write!(f, " in {}", self.0) }
    }
}
