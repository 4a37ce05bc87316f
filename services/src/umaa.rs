//! UMAA Support Operations as pure machines: flow control of commands (ICD 4.1) and ResourceAllocation (ICD 5.1.3).

pub mod allocation;
pub mod command;

#[cfg(test)]
mod tests;
