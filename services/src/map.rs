//! Translations: what bridges carry in and out, and what one world says in words of the other.

pub mod dds;
pub mod health;
pub mod surface;
pub mod uxas;
