//! What the name of a topic says of its samples (umaa-so, Quality of service).

/// The patterns of data in UMAA.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Pattern {
    /// A command.
    Command,
    /// The status of a command: no transition may be skipped.
    Status,
    /// Another answer to a command: its acknowledgement, its execution status.
    Response,
    /// An entry of a log.
    Log,
    /// An element of a large set or list: the order across elements counts.
    Element,
    /// A state that is reported.
    State,
}

impl Pattern {
    /// The pattern of a topic's name; none where it is not UMAA's. Version 6.0 names topics by their types.
    pub fn of(name: &str) -> Option<Self> {
        let name = name.strip_prefix("UMAA::")?;
        let name = name.strip_suffix("Type").unwrap_or(name);
        let ends = |ends: &[&str]| ends.iter().any(|end| name.ends_with(end));
        Some(if ends(&["CommandStatus"]) {
            Self::Status
        } else if ends(&["CommandAckReport", "ExecutionStatusReport"]) {
            Self::Response
        } else if ends(&["LogReport"]) {
            Self::Log
        } else if ends(&["SetElement", "ListElement"]) {
            Self::Element
        } else if ends(&["Command"]) {
            Self::Command
        } else {
            Self::State
        })
    }
}
