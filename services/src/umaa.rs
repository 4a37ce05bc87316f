//! UMAA Support Operations as pure state machines (ICD 3.8, 4 and 5.1.3): flow control of commands, reports on request, large
//! collections, ResourceAllocation.

pub mod allocation;
pub mod collection;
pub mod command;
pub mod request;

#[cfg(test)]
mod tests;
