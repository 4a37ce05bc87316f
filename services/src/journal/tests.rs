//! The journal over a simulated disk.

mod crashes;
mod damage;
mod limits;
mod rig;
