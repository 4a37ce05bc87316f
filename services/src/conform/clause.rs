//! The clauses that are watched: a name, where they stand in the ICD, and what they ask.

/// Declares the clauses with their places and texts.
macro_rules! clauses {
    ($($clause:ident = $name:literal, $place:literal, $text:literal;)+) => {
        /// A clause of the ICD, as far as it can be seen from outside.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Clause { $(#[doc = $text] $clause,)+ }

        impl Clause {
            /// All clauses, in the order of the ICD.
            pub const ALL: &'static [Self] = &[$(Self::$clause),+];

            /// A short name that stays the same.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$clause => $name),+ }
            }

            /// Where it stands in the ICD.
            pub const fn place(self) -> &'static str {
                match self { $(Self::$clause => $place),+ }
            }

            /// What it asks.
            pub const fn text(self) -> &'static str {
                match self { $(Self::$clause => $text),+ }
            }
        }
    };
}

clauses! {
    TopicName = "topic-name", "3.5, 5.1", "A topic is named as the ICD names it, with its whole namespace.";
    TypeName = "type-name", "5.1", "The type of a topic is named as the ICD names it.";
    GuidVariant = "guid-variant", "3.7", "A GUID has the variant of RFC 4122.";
    UpdateEnd = "update-end", "3.8.2", "The element that metadata names as the last of an update comes.";
    EmptyCollection = "empty-collection", "3.8.3", "Metadata names the nil element for an empty collection alone.";
    ElementId = "element-id", "3.8.4, table 5", "An element's id is unique among all elements on the bus.";
    CollectionSize = "collection-size", "3.8.4, table 4", "After an update a collection has as many elements as its metadata says.";
    ListOrder = "list-order", "3.8.5, tables 6 and 7", "The links of a list lead from its start to its end over every element once.";
    SessionUnique = "session-unique", "4.1", "A session id is unique among the active commands of its kind.";
    Destination = "destination", "4.1", "A command is answered by its destination alone.";
    Correlated = "correlated", "4.1", "Status, acknowledgement and execution status belong to a command.";
    Answered = "answered", "4.1, 4.1.4 item 3", "Every command is answered by its destination.";
    FirstStatus = "first-status", "4.1.4 item 3", "The first status of a command is ISSUED.";
    Transition = "transition", "4.1, figure 4", "States follow each other as in figure 4: none is skipped, none is published twice.";
    Reason = "reason", "4.1, figure 5", "The reason fits the transition as in figure 5.";
    AckFirst = "ack-first", "4.1.4.1 item 1", "The acknowledgement comes before COMMANDED.";
    AckMatches = "ack-matches", "4.1.4.1 item 1", "The acknowledgement has the parameters of the command.";
    ExecutionStatus = "execution-status", "4.1.4.1 item 4", "Where an execution status is defined, it is published during execution.";
    UpdateNewer = "update-newer", "4.1.4.2", "An updated command has a newer timestamp.";
    UpdateInTime = "update-in-time", "4.1.4.2", "A command in a terminal state is not updated.";
    UpdateAnswered = "update-answered", "4.1.4.2 item 1", "An update of a command that is not over is answered.";
    UpdatedOnly = "updated-only", "4.1.4.2 item 1", "Back to ISSUED goes a command only when it has been updated.";
    CancelAsked = "cancel-asked", "4.1.4.5", "CANCELED is a command only when its consumer has disposed it.";
    CancelAnswered = "cancel-answered", "4.1.4.5", "A command that is cancelled comes to an end.";
    ConsumerCleanUp = "consumer-clean-up", "4.1.5", "The consumer disposes a command that is completed or failed.";
    CleanUpOrder = "clean-up-order", "4.1.5", "The provider disposes what it said of a command after the command has been disposed.";
    ProviderCleanUp = "provider-clean-up", "4.1.5", "The provider disposes what it said of a command that is over and disposed.";
    ProviderShutdown = "provider-shutdown", "4.1.6.1", "A provider fails what is incomplete before it unregisters.";
    ConsumerShutdown = "consumer-shutdown", "4.1.6.2", "A consumer disposes its commands before it unregisters.";
    ReportShutdown = "report-shutdown", "4.2.1.3", "A provider disposes its reports before it unregisters.";
    Members = "members", "5.1, tables 9 to 32", "A sample has the members of its type, the optional ones excepted.";
    Key = "key", "5.1, tables 9 to 32", "The instance of a sample is that of its key members.";
    OneHolder = "one-holder", "5.1.3", "A resource is controlled by one consumer at a time.";
    ResourceOnce = "resource-once", "5.1.3, tables 13, 16 and 17", "A report names a resource once.";
    Listed = "listed", "5.1.3", "A resource is allocated only to a consumer on its priority list.";
    TakeOver = "take-over", "5.1.3", "Control is taken from a consumer only for one of higher priority.";
    ReportFirst = "report-first", "5.1.3", "The report names the new holder before its command is EXECUTING.";
    ReportCleared = "report-cleared", "5.1.3, table 29", "The report no longer names a consumer whose control has ended.";
    Expiry = "expiry", "5.1.3, table 20", "Control ends when its duration has run.";
    Guard = "guard", "5.1.3", "A provider executes commands of the consumer in control or of its own resource alone.";
    PriorityReport = "priority-report", "5.1.3", "The report has the priorities that were set.";
    Enumeration = "enumeration", "5.3", "An enumeration has one of its values.";
    Range = "range", "5.4, table 38", "A value is within the range of its type.";
    SequenceBound = "sequence-bound", "tables 13, 16, 17, 21, 31 and 32", "A sequence has at most as many elements as its type allows.";
}
