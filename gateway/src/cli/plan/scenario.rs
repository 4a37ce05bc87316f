//! The messages of a scenario, from the files of its folder.

use crate::cli::exit::Failure;
use aldis_envelope::EntityId;
use aldis_envelope::lmcp::cmasi::{
    AbstractZone, AutomationRequest, EntityConfiguration, EntityState, OperatingRegion, Task,
};
use aldis_envelope::lmcp::impact::ImpactAutomationRequest;
use aldis_envelope::lmcp::uxtask::{CoordinatedAutomationRequest, PlanningState, TaskAutomationRequest};
use aldis_envelope::lmcp::{Object, Ref, read_xml};
use std::path::{Path, PathBuf};

/// Where scenarios of UxAS keep their messages.
const MESSAGES: &str = "MessagesToSend";

/// The entity that plans where no coordinated request asks for a vehicle's own planner.
const PLANNER: u64 = 100;

/// A scenario.
pub(in crate::cli) struct Scenario {
    /// The entity whose node plans.
    pub(in crate::cli) entity: EntityId,
    objects: Vec<(String, Box<dyn Object>)>,
}

impl Scenario {
    /// Reads a folder. What is no LMCP message is passed over and said on standard error.
    pub(in crate::cli) fn read(directory: &Path) -> Result<Self, Failure> {
        let messages = directory.join(MESSAGES);
        let place = if messages.is_dir() { messages } else { directory.to_owned() };
        let mut files = Vec::new();
        list(&place, &mut files)?;
        files.sort();
        let mut objects = Vec::new();
        for file in files {
            let name = file.strip_prefix(&place).unwrap_or(&file).display().to_string();
            let text = std::fs::read_to_string(&file)
                .map_err(|why| Failure::Usage(format!("cannot read {}: {why}", file.display())))?;
            match document(&text) {
                Ok(found) => objects.extend(found.into_iter().map(|object| (name.clone(), object))),
                Err(why) => eprintln!("aldis: {}: {why}; passed over", file.display()),
            }
        }
        Self::of(&directory.display().to_string(), objects)
    }

    /// The scenario of one document.
    pub(in crate::cli) fn parse(name: &str, text: &str) -> Result<Self, Failure> {
        let found = document(text).map_err(|why| Failure::Usage(format!("{name}: {why}")))?;
        Self::of(name, found.into_iter().map(|object| (name.to_owned(), object)).collect())
    }

    fn of(from: &str, mut objects: Vec<(String, Box<dyn Object>)>) -> Result<Self, Failure> {
        // Who refers to something comes after it; files keep their order otherwise.
        objects.sort_by_key(|(_, object)| rank(object.as_ref()));
        let scenario = Self { entity: planner(&objects)?, objects };
        if scenario.requests().is_empty() {
            let why = "no AutomationRequest of any kind is in it";
            return Err(Failure::Usage(format!("{from}: {why}")));
        }
        Ok(scenario)
    }

    /// All messages but requests, in the order in which they are told.
    pub(in crate::cli) fn told(&self) -> Vec<Box<dyn Object>> {
        self.all().filter(|object| rank(*object) < REQUEST).map(Object::clone_box).collect()
    }

    /// All messages.
    pub(in crate::cli) fn all(&self) -> impl Iterator<Item = &dyn Object> {
        self.objects.iter().map(|(_, object)| object.as_ref())
    }

    /// The requests with the names of their files.
    pub(in crate::cli) fn requests(&self) -> Vec<(String, Box<dyn Object>)> {
        let requests = self.objects.iter().filter(|(_, object)| rank(object.as_ref()) == REQUEST);
        requests.map(|(name, object)| (name.clone(), self.with_states(object.clone()))).collect()
    }

    /// A coordinated request with the states of all vehicles, as their own planners would tell them.
    fn with_states(&self, mut object: Box<dyn Object>) -> Box<dyn Object> {
        if let Some(request) = object.get_mut::<CoordinatedAutomationRequest>()
            && request.planning_states.is_empty()
        {
            let states = self.all().filter_map(|object| object.get::<EntityState>());
            request.planning_states = states
                .map(|state| {
                    Ref::new(PlanningState {
                        entity_id: state.id,
                        planning_position: state.location.clone(),
                        planning_heading: state.heading,
                    })
                })
                .collect();
        }
        object
    }
}

/// The rank of requests.
const REQUEST: u8 = 6;

/// What comes first, by what refers to what.
fn rank(object: &dyn Object) -> u8 {
    let is_request = object.get::<AutomationRequest>().is_some()
        || object.get::<ImpactAutomationRequest>().is_some()
        || object.get::<TaskAutomationRequest>().is_some()
        || object.get::<CoordinatedAutomationRequest>().is_some();
    match object {
        _ if is_request => REQUEST,
        _ if object.get::<EntityConfiguration>().is_some() => 0,
        _ if object.get::<EntityState>().is_some() => 1,
        _ if object.get::<AbstractZone>().is_some() => 2,
        _ if object.get::<OperatingRegion>().is_some() => 3,
        _ if object.get::<Task>().is_some() => 5,
        _ => 4,
    }
}

/// Who plans: the first vehicle of a coordinated request, else nobody's vehicle.
fn planner(objects: &[(String, Box<dyn Object>)]) -> Result<EntityId, Failure> {
    let coordinated = objects.iter().find_map(|(_, object)| object.get::<CoordinatedAutomationRequest>());
    let first = coordinated.and_then(|request| request.original_request.get()?.entity_list.first().copied());
    let number = first.and_then(|id| u64::try_from(id).ok()).unwrap_or(PLANNER);
    EntityId::new(number).map_err(|why| Failure::Failed(why.to_string()))
}

/// The objects of a text; of one that has several roots too.
fn document(text: &str) -> Result<Vec<Box<dyn Object>>, String> {
    let document = read_xml(text.as_bytes()).or_else(|why| {
        let body = text.split_once("?>").map_or(text, |(_, body)| body);
        read_xml(format!("<all>{body}</all>").as_bytes()).map_err(|_| why)
    });
    let document = document.map_err(|why| why.to_string())?;
    match document.objects.is_empty() {
        true => Err("no LMCP message".to_owned()),
        false => Ok(document.objects.into_iter().map(|placed| placed.object).collect()),
    }
}

fn list(directory: &Path, files: &mut Vec<PathBuf>) -> Result<(), Failure> {
    let wrong = |why: std::io::Error| Failure::Usage(format!("cannot read {}: {why}", directory.display()));
    for entry in std::fs::read_dir(directory).map_err(wrong)? {
        let path = entry.map_err(wrong)?.path();
        if path.is_dir() {
            list(&path, files)?;
        } else if path.extension().is_some_and(|end| end == "xml") {
            files.push(path);
        }
    }
    Ok(())
}
