//! The tidy test: rules of the house that a compiler does not know. Each failure says what is wrong and what to do.

mod bans;
mod dependencies;
mod layers;
mod presence;
mod sizes;
mod sources;
