//! The kinds of tasks.

mod area;
mod lanes;
mod line;
mod moving;
mod pattern;
mod point;
mod stay;
mod team;

use super::Kind;
use aldis_envelope::lmcp::cmasi::{
    AreaSearchTask, LineSearchTask, Location3D, LoiterTask, MustFlyTask, PointSearchTask,
};
use aldis_envelope::lmcp::impact::{
    AngledAreaSearchTask, BlockadeTask, CommRelayTask, CordonTask, EscortTask, ImpactLineSearchTask,
    ImpactPointSearchTask, MultiVehicleWatchTask, PatternSearchTask, WatchTask,
};
use aldis_envelope::lmcp::uxtask::RendezvousTask;
use aldis_envelope::lmcp::{Object, Ref, Struct};

/// Makes the kind of a task from its message.
type Make = fn(&dyn Object) -> Option<Box<dyn Kind>>;

/// The kind of a task whose type is its kind.
fn make<T: Struct + Kind>(task: &dyn Object) -> Option<Box<dyn Kind>> {
    Some(Box::new(task.get::<T>()?.clone()))
}

/// The kinds by the full names of their types.
const KINDS: [(&str, Make); 16] = [
    ("afrl.cmasi.PointSearchTask", make::<PointSearchTask>),
    ("afrl.impact.ImpactPointSearchTask", make::<ImpactPointSearchTask>),
    ("afrl.cmasi.LineSearchTask", make::<LineSearchTask>),
    ("afrl.impact.ImpactLineSearchTask", make::<ImpactLineSearchTask>),
    ("afrl.cmasi.AreaSearchTask", make::<AreaSearchTask>),
    ("afrl.impact.AngledAreaSearchTask", make::<AngledAreaSearchTask>),
    ("afrl.impact.PatternSearchTask", make::<PatternSearchTask>),
    ("afrl.cmasi.LoiterTask", make::<LoiterTask>),
    ("afrl.cmasi.MustFlyTask", make::<MustFlyTask>),
    ("afrl.impact.EscortTask", make::<EscortTask>),
    ("afrl.impact.WatchTask", make::<WatchTask>),
    ("afrl.impact.MultiVehicleWatchTask", make::<MultiVehicleWatchTask>),
    ("afrl.impact.CommRelayTask", make::<CommRelayTask>),
    ("afrl.impact.CordonTask", make::<CordonTask>),
    ("afrl.impact.BlockadeTask", make::<BlockadeTask>),
    ("uxas.messages.task.RendezvousTask", make::<RendezvousTask>),
];

/// The kind of a task; none where it is not known.
pub fn kind_of(task: &dyn Object) -> Option<Box<dyn Kind>> {
    let name = task.type_info().full_name;
    KINDS.iter().find(|(known, _)| *known == name).and_then(|(_, make)| make(task))
}

/// Whether tasks of this type can be planned.
pub fn is_known(full_name: &str) -> bool {
    KINDS.iter().any(|(known, _)| *known == full_name)
}

/// A place that a task names.
fn place(at: &Ref<Location3D>, what: &str) -> Result<Location3D, String> {
    let found = at.get().cloned().ok_or_else(|| format!("{what} is not given"))?;
    match found.latitude.abs() <= 90.0 && found.longitude.is_finite() {
        true => Ok(found),
        false => {
            Err(format!("{what} is no place: latitude {}, longitude {}", found.latitude, found.longitude))
        }
    }
}
