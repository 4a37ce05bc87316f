//! UMAA's patterns of flow control as pure state machines (ICD 3.8 and 4).

pub mod collection;
pub mod request;
