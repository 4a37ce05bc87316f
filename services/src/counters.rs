//! Everything that a node counts. Counting is never sampled and never reset.

/// Declares a struct of counters whose fields can be listed by name.
macro_rules! counters {
    ($(#[doc = $about:literal])+ $counters:ident { $($(#[doc = $doc:literal])+ $name:ident,)* }) => {
        $(#[doc = $about])+
        #[derive(Debug, Clone, PartialEq, Eq, Default)]
        pub struct $counters {
            $($(#[doc = $doc])+ pub $name: u64,)*
        }

        impl $counters {
            /// All counters with their names, in the order of their declaration.
            pub fn list(&self) -> Vec<(&'static str, u64)> {
                vec![$((stringify!($name), self.$name),)*]
            }
        }
    };
}
pub(crate) use counters;

counters! {
    /// The counters of a node, by name at service 1.
    Counters {
    /// Messages handed to a service of this node.
    delivered,
    /// Envelopes put on the bus.
    published,
    /// Envelopes that came from the bus.
    received,
    /// Samples that a gap in a stream's sequence shows to be missing, neither told nor filled.
    lost,
    /// Samples that a sender told it left out.
    skipped_told,
    /// Samples missed while this node's own session was down.
    missed_offline,
    /// Samples that had been seen already, or came after a newer one of their stream.
    duplicates,
    /// Messages for the bus that were left out while the session was down; the next sample of their stream tells.
    held_back_offline,
    /// Samples from the bus whose key or header could not be read, or did not agree.
    refused_headers,
    /// Samples from the bus that the shell had to drop because this node did not keep up.
    shed_from_bus,
    /// Messages that had passed this node before.
    loops_stopped,
    /// Messages that came by a link from entities behind it.
    imported_by_links,
    /// Messages refused at a link because their source is not behind it.
    refused_links,
    /// Requests refused by `[allow]`.
    calls_forbidden,
    /// Calls of own services that were answered.
    calls_answered,
    /// Calls of own services that ended without an answer.
    calls_failed,
    /// Answers that came when nobody waited for them any more.
    replies_late,
    /// Times that missing samples of retained topics were asked for.
    asked,
    /// Retained samples told to late joiners and to those that missed them.
    retold,
    /// Retained samples dropped because a topic's limit was reached.
    shed_retained,
    /// Samples of persistent topics that the journal has on disk.
    kept,
    /// Samples of persistent topics that the journal does not keep: refused, nobody has got them.
    not_kept,
    /// Retained samples of former lives, read back from the journal.
    recovered,
    /// Words of other nodes that could not be read, or came from a source that is not theirs.
    refused_among_nodes,
    /// Crashes of services.
    crashes,
    /// Messages of services that claimed another source than their own.
    refused_sources,
    /// Messages that wait in no queue because too many deliveries were pending inside the node.
    shed_inside,
    }
}
