//! The chart of the demo: land, ways, tasks and boats as letters.

use super::board::{BOATS, Board};
use super::missions::Plan;
use aldis_envelope::lmcp::Object;
use aldis_envelope::lmcp::cmasi::{
    AbstractZone, AreaSearchTask, LineSearchTask, Location3D, MustFlyTask, PointSearchTask, Task,
};
use aldis_services::uxas::clearance::clearance_m;
use aldis_services::uxas::ground::{Ground, middle, outline};
use aldis_services::uxas::vehicle::Vehicle;
use aldis_services::uxas::world::World;

/// How many letters the chart is wide and high: a letter is about twice as high as wide.
const SIZE: (usize, usize) = (72, 20);

/// The chart of a scenario.
pub(super) struct Chart {
    /// The south-western and the north-eastern corner, latitude before longitude.
    corners: ((f64, f64), (f64, f64)),
    /// Land and water.
    cells: Vec<Vec<char>>,
    /// Where each task is.
    tasks: Vec<(i64, Location3D)>,
}

impl Chart {
    /// The chart of what a plan is about.
    pub(super) fn new(plan: &Plan) -> Self {
        let mut world = World::default();
        for object in plan.scenario.all() {
            world.take(object);
        }
        let zones = world.zones.values().filter_map(|zone| zone.get::<AbstractZone>());
        let places: Vec<Location3D> = zones.flat_map(|zone| places(&zone.boundary)).collect();
        let extreme = |of: fn(&Location3D) -> f64, pick: fn(f64, f64) -> f64| {
            places.iter().map(of).reduce(pick).unwrap_or(0.0)
        };
        let corners = (
            (extreme(|at| at.latitude, f64::min), extreme(|at| at.longitude, f64::min)),
            (extreme(|at| at.latitude, f64::max), extreme(|at| at.longitude, f64::max)),
        );
        let mut chart =
            Self { corners, cells: Vec::new(), tasks: plan.scenario.all().filter_map(task).collect() };
        let vehicle = world.configurations.values().find_map(|entity| Vehicle::of(entity.as_ref()));
        let is_land = |at: &Location3D| {
            let clearance = vehicle
                .as_ref()
                .and_then(|vehicle| clearance_m(&world, plan.request.operating_region, vehicle, at));
            clearance.is_some_and(|clearance| clearance < 0.0)
        };
        let cell = |(row, column)| if is_land(&chart.place(row, column)) { '#' } else { ' ' };
        let cells = (0..SIZE.1).map(|row| (0..SIZE.0).map(|column| cell((row, column))).collect()).collect();
        chart.cells = cells;
        chart
    }

    /// The place in the middle of a cell.
    fn place(&self, row: usize, column: usize) -> Location3D {
        let ((south, west), (north, east)) = self.corners;
        let share = |at: usize, of: usize| (at as f64 + 0.5) / of as f64;
        Location3D {
            latitude: north - (north - south) * share(row, SIZE.1),
            longitude: west + (east - west) * share(column, SIZE.0),
            ..Location3D::default()
        }
    }

    /// The cell of a place; none beyond the chart.
    fn cell(&self, latitude: f64, longitude: f64) -> Option<(usize, usize)> {
        let ((south, west), (north, east)) = self.corners;
        let row = (north - latitude) / (north - south) * SIZE.1 as f64;
        let column = (longitude - west) / (east - west) * SIZE.0 as f64;
        let is_on = (0.0..SIZE.1 as f64).contains(&row) && (0.0..SIZE.0 as f64).contains(&column);
        is_on.then_some((row as usize, column as usize))
    }

    /// The chart with what is known now.
    pub(super) fn draw(&self, board: &Board) -> String {
        let mut cells = self.cells.clone();
        let mut put = |latitude: f64, longitude: f64, letter: char| {
            if let Some((row, column)) = self.cell(latitude, longitude) {
                cells[row][column] = letter;
            }
        };
        let missions = &board.missions;
        for mission in missions.missions.values() {
            for at in mission.waypoint_list.iter().filter_map(|at| at.get()) {
                put(at.latitude, at.longitude, '.');
            }
        }
        for (task, at) in &self.tasks {
            let letter = match char::from_digit((*task % 10) as u32, 10) {
                _ if missions.complete.contains(task) => '*',
                Some(digit) => digit,
                None => '?',
            };
            put(at.latitude, at.longitude, letter);
        }
        for (entity, boat) in &board.boats {
            let place = BOATS.iter().position(|&other| other == entity.get()).unwrap_or(0) as u8;
            put(boat.latitude, boat.longitude, char::from(b'A' + place));
        }
        let mut text = String::new();
        for row in cells {
            text.extend(row);
            text.push('\n');
        }
        let (done, all) = (missions.complete.len(), self.tasks.len());
        text + &format!(
            "# land  . missions  1 to {all} tasks  * complete  A to C boats {} to {}; {done} of {all} tasks are complete\n",
            BOATS[0],
            BOATS[BOATS.len() - 1]
        )
    }
}

/// The corners of a geometry.
fn places(
    geometry: &aldis_envelope::lmcp::Ref<aldis_envelope::lmcp::cmasi::AbstractGeometry>,
) -> Vec<Location3D> {
    let Some(origin) = middle(geometry) else { return Vec::new() };
    let ground = Ground::new(&origin, false);
    let corners = outline(geometry, &ground).unwrap_or_default();
    corners.into_iter().map(|corner| ground.location(corner)).collect()
}

/// A task and where it is drawn.
fn task(object: &dyn Object) -> Option<(i64, Location3D)> {
    let id = object.get::<Task>()?.task_id;
    let at = if let Some(point) = object.get::<PointSearchTask>() {
        point.search_location.get().cloned()
    } else if let Some(line) = object.get::<LineSearchTask>() {
        line.point_list.get(line.point_list.len() / 2).and_then(|at| at.get().cloned())
    } else if let Some(area) = object.get::<AreaSearchTask>() {
        middle(&area.search_area)
    } else {
        object.get::<MustFlyTask>().and_then(|task| task.position.get().cloned())
    };
    Some((id, at?))
}
