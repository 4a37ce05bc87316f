//! Envelopes, addresses, key expressions, message types and codecs of Aldis.
//!
//! Pure: no input or output, no clock, no randomness. Every type can hold valid values only, through serde too.

pub mod address;
pub mod aldis;
pub mod call;
pub mod change;
pub mod codec;
pub mod description;
pub mod guid;
pub mod id;
pub mod idl;
pub mod key;
pub mod lmcp;
pub mod message;
pub mod name;
pub mod prefix;
pub mod stamp;
pub mod time;
pub mod umaa;

pub use address::{Address, Dialect};
pub use call::{Call, CallId, Refusal, Role};
pub use change::{Change, Instance, KeyHash, KeyWidth};
pub use guid::{Guid, GuidForm, Guids};
pub use id::{BootId, EntityId, ServiceId, Source};
pub use key::{Fleet, Keys, Space};
pub use message::{Attributes, Envelope, Label, Message};
pub use name::{ContentType, Descriptor, Group, Name, NameError};
pub use prefix::Prefix;
pub use stamp::{Priority, Stamp, Via};
pub use time::{DateTime, Monotonic, Now, Wall};
