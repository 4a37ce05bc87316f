//! AssignmentCoordinator: several planners agree on where everybody is, and then each makes the same plan.
//!
//! | what comes | what it does |
//! | --- | --- |
//! | `CoordinatedAutomationRequest` | tells the state of its own vehicle, and waits for those of all vehicles of the request |
//! | `AssignmentCoordination` | keeps the state, also one that comes before its request |
//! | all states are there | asks for the plan with exactly these states |
//! | `MaximumResponseTime` is over (at once where it is negative) | asks for the plan of those that have told their states |
//! | `TaskAutomationResponse` of its request | tells it as `AutomationResponse` |

use super::machine::Post;
use aldis_envelope::Monotonic;
use aldis_envelope::lmcp::cmasi::{AutomationResponse, EntityState};
use aldis_envelope::lmcp::uxtask::{
    AssignmentCoordination, CoordinatedAutomationRequest, PlanningState, TaskAutomationRequest,
    TaskAutomationResponse, TaskInitialized,
};
use aldis_envelope::lmcp::{Object, Ref};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// How many requests may be coordinated at a time.
const REQUESTS_MAX: usize = 16;

/// A request that waits for states.
struct Coordinated {
    request: CoordinatedAutomationRequest,
    until: Monotonic,
}

/// The coordination of one planner.
#[derive(Default)]
pub struct Coordinator {
    tasks: BTreeSet<i64>,
    own: BTreeMap<i64, EntityState>,
    open: BTreeMap<i64, Coordinated>,
    /// What others have told, by request and vehicle.
    told: BTreeMap<i64, BTreeMap<i64, PlanningState>>,
    asked: BTreeSet<i64>,
}

impl Coordinator {
    /// A coordinator task has come.
    pub fn begin(&mut self, task_id: i64, post: &mut Post<'_>) {
        self.tasks.insert(task_id);
        post.broadcast(&TaskInitialized { task_id });
    }

    /// Tasks are gone.
    pub fn remove(&mut self, tasks: &[i64]) {
        self.tasks.retain(|task| !tasks.contains(task));
    }

    /// A vehicle, of whatever kind, tells its state.
    pub fn state_of(&mut self, state: &EntityState) {
        self.own.insert(state.id, state.clone());
    }

    /// Takes what is for it; whether it was.
    pub fn take(&mut self, object: &dyn Object, post: &mut Post<'_>) -> bool {
        if let Some(request) = object.get::<CoordinatedAutomationRequest>() {
            self.request(request, post);
        } else if let Some(told) = object.get::<AssignmentCoordination>() {
            if let Some(state) = told.planning_state.get() {
                let request = told.coordinated_automation_request_id;
                self.told.entry(request).or_default().insert(state.entity_id, state.clone());
                while self.told.len() > REQUESTS_MAX {
                    self.told.pop_first();
                }
                self.settle(post);
            }
        } else if let Some(response) = object.get::<TaskAutomationResponse>() {
            if self.asked.remove(&response.response_id)
                && let Some(plan) = response.original_response.get()
            {
                post.broadcast(plan);
            }
        } else {
            return false;
        }
        true
    }

    fn request(&mut self, request: &CoordinatedAutomationRequest, post: &mut Post<'_>) {
        if self.tasks.is_empty() || self.asked.contains(&request.request_id) {
            return;
        }
        let number = request.request_id;
        // Without a state of its own, the planner's vehicle is one that the request does not name.
        let own = i64::try_from(post.source().entity.get()).unwrap_or(0);
        let told = self.told.entry(number).or_default();
        for state in request.planning_states.iter().filter_map(|state| state.get()) {
            told.insert(state.entity_id, state.clone());
        }
        if let Some(state) = self.own.get(&own) {
            let state = PlanningState {
                entity_id: own,
                planning_position: state.location.clone(),
                planning_heading: state.heading,
            };
            told.insert(own, state.clone());
            let planning_state = Ref::new(state);
            post.broadcast(&AssignmentCoordination {
                coordinated_automation_request_id: number,
                planning_state,
            });
        }
        let wait = Duration::from_millis(u64::try_from(request.maximum_response_time).unwrap_or(0));
        let until = post.now().monotonic + wait;
        self.open.insert(number, Coordinated { request: request.clone(), until });
        while self.open.len() > REQUESTS_MAX {
            self.open.pop_first();
        }
        self.settle(post);
    }

    /// Asks for the plans whose states are complete, or whose time is over.
    fn settle(&mut self, post: &mut Post<'_>) {
        let now = post.now().monotonic;
        let nobody = BTreeMap::new();
        let mut ready = Vec::new();
        for (&number, one) in &self.open {
            let told = self.told.get(&number).unwrap_or(&nobody);
            let wanted = one.request.original_request.get().map_or(&[][..], |asked| &asked.entity_list);
            let is_complete = !wanted.is_empty() && wanted.iter().all(|id| told.contains_key(id));
            if is_complete || one.until <= now {
                ready.push(number);
            }
        }
        for number in ready {
            let (Some(one), told) =
                (self.open.remove(&number), self.told.remove(&number).unwrap_or_default())
            else {
                continue;
            };
            let mut original = one.request.original_request.get().cloned().unwrap_or_default();
            if original.entity_list.is_empty() {
                original.entity_list = told.keys().copied().collect();
            } else {
                original.entity_list.retain(|id| told.contains_key(id));
            }
            if original.entity_list.is_empty() {
                // An empty list would mean all vehicles.
                let why = format!(
                    "CoordinatedAutomationRequest {number}: no vehicle of it has told its state in time"
                );
                let info = vec![super::machine::pair("AssignmentCoordinator", &why)];
                post.broadcast(&AutomationResponse { info, ..AutomationResponse::default() });
                continue;
            }
            // Everybody plans with the same vehicles in the same order, and so makes the same plan.
            original.entity_list.sort_unstable();
            self.asked.insert(number);
            while self.asked.len() > REQUESTS_MAX {
                self.asked.pop_first();
            }
            let states = told.into_values().filter(|state| original.entity_list.contains(&state.entity_id));
            post.broadcast(&TaskAutomationRequest {
                request_id: number,
                planning_states: states.map(Ref::new).collect(),
                original_request: Ref::new(original),
                sand_box_request: false,
            });
        }
    }

    /// The time of a request may be over.
    pub fn wake(&mut self, post: &mut Post<'_>) {
        self.settle(post);
    }

    /// When the time of the next request is over.
    pub fn deadline(&self) -> Option<Monotonic> {
        self.open.values().map(|one| one.until).min()
    }
}
