//! A request by numbers instead of ids, in canonical order: requests that say the same become the same problem.

use super::request::{Objective, Precedence, Request, RequestError, TIME_MS_MAX};
use crate::plan::algebra::{Expression, Operator, compose};
use std::collections::{BTreeMap, BTreeSet};

/// No way: far beyond any sum of times, and two of it still are a number.
pub(super) const NEVER: i64 = i64::MAX / 4;

/// The most ways: 1 GB of them.
const WAYS_MAX: usize = 1 << 27;

/// Which groups must be done: the selection that an expression leaves, its order left out.
#[derive(Debug, Clone)]
pub(super) enum Part {
    /// One option of a group.
    Group(usize),
    /// All parts.
    All(Vec<Self>),
    /// One of the parts, at least one of which is more than an option.
    Choice(Vec<Self>),
}

/// An indexed request. Atoms are options; a group is a set of atoms of which one is done.
#[derive(Debug, Clone)]
pub(super) struct Problem {
    /// The vehicles' ids, ascending.
    pub vehicles: Vec<i64>,
    /// Task and option of each atom, ascending.
    pub atoms: Vec<(i64, i64)>,
    /// The process over atoms.
    pub expression: Expression<usize>,
    /// How long each atom takes.
    pub service: Vec<i64>,
    /// The atoms of each group.
    pub groups: Vec<Vec<usize>>,
    /// The group of each atom.
    pub group_of: Vec<usize>,
    /// What must be done.
    pub parts: Part,
    /// The groups that come before each group, where they are done at all.
    pub before: Vec<Vec<usize>>,
    /// What must be small.
    pub objective: Objective,
    /// Whether vehicles wait for each other.
    pub temporal: bool,
    travel: Vec<i64>,
}

impl Problem {
    /// # Errors
    /// What is wrong with the request.
    pub(super) fn new(request: &Request) -> Result<Self, RequestError> {
        let compositions = request.tasks.iter().map(|(&id, task)| (id, task.composition.as_str())).collect();
        let known = |task: i64, option: i64| request.tasks[&task].options.contains_key(&option);
        let vehicles = vehicles(request)?;
        let expression = compose(&request.relationships, &compositions, &known, request.unnamed)?.canonical();
        let atoms: BTreeSet<_> = expression.atoms().into_iter().copied().collect();
        let atoms: Vec<_> = atoms.into_iter().collect();
        let index: BTreeMap<_, _> = atoms.iter().enumerate().map(|(place, &atom)| (atom, place)).collect();
        let expression = expression.map(&mut |atom| Ok::<_, RequestError>(index[atom]))?;
        let mut problem = Self {
            service: atoms.iter().map(|(task, option)| request.tasks[task].options[option].cost_ms).collect(),
            groups: Vec::new(),
            group_of: vec![0; atoms.len()],
            parts: Part::All(Vec::new()),
            before: Vec::new(),
            objective: request.objective,
            temporal: request.precedence == Precedence::Temporal,
            travel: travel(request, &vehicles, &atoms, &index)?,
            vehicles,
            atoms,
            expression,
        };
        let expression = problem.expression.clone();
        problem.parts = problem.part(&expression, &[]);
        Ok(problem)
    }

    /// The place of "where the vehicle is at first" among the places to come from.
    pub(super) fn start(&self) -> usize {
        self.atoms.len()
    }

    /// How long a vehicle travels; [`NEVER`] where it cannot or may not.
    pub(super) fn travel(&self, vehicle: usize, from: usize, to: usize) -> i64 {
        let atoms = self.atoms.len();
        self.travel[(vehicle * (atoms + 1) + from) * atoms + to]
    }

    /// How long a vehicle travels and then works; [`NEVER`] where it cannot or may not.
    pub(super) fn step(&self, vehicle: usize, from: usize, to: usize) -> i64 {
        (self.travel(vehicle, from, to) + self.service[to]).min(NEVER)
    }

    /// All ways of a vehicle.
    pub(super) fn ways(&self, vehicle: usize) -> &[i64] {
        let block = (self.atoms.len() + 1) * self.atoms.len();
        &self.travel[vehicle * block..(vehicle + 1) * block]
    }

    /// Whether all groups are done, in any order.
    pub(super) fn is_parallel(&self) -> bool {
        let plain = match &self.parts {
            Part::Group(_) => true,
            Part::All(parts) => parts.iter().all(|part| matches!(part, Part::Group(_))),
            Part::Choice(_) => false,
        };
        plain && !self.has_order()
    }

    /// Whether no option is named twice.
    pub(super) fn is_once(&self) -> bool {
        self.groups.iter().map(Vec::len).sum::<usize>() == self.atoms.len()
    }

    /// Whether something comes before something.
    pub(super) fn has_order(&self) -> bool {
        self.before.iter().any(|before| !before.is_empty())
    }

    /// First what the objective names, then the other.
    pub(super) fn value(&self, makespan: i64, total: i64) -> (i64, i64) {
        match self.objective {
            Objective::MinMax => (makespan, total),
            Objective::Cumulative => (total, makespan),
        }
    }

    fn add_group(&mut self, atoms: Vec<usize>, before: &[usize]) -> Part {
        let group = self.groups.len();
        for &atom in &atoms {
            self.group_of[atom] = group;
        }
        self.groups.push(atoms);
        self.before.push(before.to_vec());
        Part::Group(group)
    }

    /// What an expression leaves to be done, after the groups `before`.
    fn part(&mut self, expression: &Expression<usize>, before: &[usize]) -> Part {
        match expression {
            Expression::Atom(atom) => self.add_group(vec![*atom], before),
            Expression::Node(Operator::Parallel, parts) => {
                Part::All(parts.iter().map(|part| self.part(part, before)).collect())
            }
            Expression::Node(Operator::Sequential, parts) => {
                let mut before = before.to_vec();
                let mut done = Vec::with_capacity(parts.len());
                for part in parts {
                    let first = self.groups.len();
                    done.push(self.part(part, &before));
                    before.extend(first..self.groups.len());
                }
                Part::All(done)
            }
            Expression::Node(Operator::Alternative, parts) => {
                let atom = |part: &Expression<usize>| match part {
                    Expression::Atom(atom) => Some(*atom),
                    Expression::Node(..) => None,
                };
                match parts.iter().map(atom).collect::<Option<Vec<_>>>() {
                    Some(atoms) => self.add_group(atoms, before),
                    None => Part::Choice(parts.iter().map(|part| self.part(part, before)).collect()),
                }
            }
        }
    }
}

fn vehicles(request: &Request) -> Result<Vec<i64>, RequestError> {
    let mut vehicles = request.vehicles.clone();
    vehicles.sort_unstable();
    if let Some(twice) = vehicles.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(RequestError::VehicleTwice(twice[0]));
    }
    if vehicles.is_empty() {
        return Err(RequestError::NoVehicle);
    }
    if request.tasks.is_empty() {
        return Err(RequestError::NoTask);
    }
    for (&task, asked) in &request.tasks {
        let negative = asked.options.iter().find(|(_, option)| option.cost_ms < 0);
        if let Some((&option, &super::TaskOption { cost_ms, .. })) = negative {
            return Err(RequestError::NegativeCost { task, option, cost_ms });
        }
    }
    Ok(vehicles)
}

/// The table of ways, [`NEVER`] where there is none, where the vehicle may not do the option, or where it takes longer than
/// any time. Ways of others than the request's vehicles and options are for other requests.
fn travel(
    request: &Request,
    vehicles: &[i64],
    atoms: &[(i64, i64)],
    index: &BTreeMap<(i64, i64), usize>,
) -> Result<Vec<i64>, RequestError> {
    let count = atoms.len();
    if vehicles.len().saturating_mul(count + 1).saturating_mul(count) > WAYS_MAX {
        return Err(RequestError::TooLarge { vehicles: vehicles.len(), options: count });
    }
    let mut table = vec![NEVER; vehicles.len() * (count + 1) * count];
    let mut told = BTreeMap::new();
    for &way in &request.travel {
        let before = told.insert((way.vehicle, way.from, way.to), way.time_ms);
        if let Some(other_ms) = before.filter(|time| *time != way.time_ms) {
            return Err(RequestError::WayTwice { travel: way, other_ms });
        }
        let from = way.from.map_or(Some(count), |from| index.get(&from).copied());
        let (Some(from), Some(&to), Ok(vehicle)) =
            (from, index.get(&way.to), vehicles.binary_search(&way.vehicle))
        else {
            continue;
        };
        let option = &request.tasks[&way.to.0].options[&way.to.1];
        let eligible = option.eligible.is_empty() || option.eligible.contains(&way.vehicle);
        let real = |time_ms| (0..=TIME_MS_MAX).contains(&time_ms);
        if eligible && real(way.time_ms) && real(option.cost_ms) {
            table[(vehicle * (count + 1) + from) * count + to] = way.time_ms;
        }
    }
    Ok(table)
}
