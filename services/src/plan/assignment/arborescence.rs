//! The cheapest arcs that reach every node from a root: Chu and Liu's, and Edmonds', by contracting cycles.

/// A square table of costs; infinite where there is no arc.
#[derive(Debug, Clone)]
pub(super) struct Costs {
    /// How many nodes there are. The last is the root.
    pub nodes: usize,
    /// By origin, then by destination.
    pub costs: Vec<f64>,
}

impl Costs {
    fn get(&self, from: usize, to: usize) -> f64 {
        self.costs[from * self.nodes + to]
    }
}

/// The origin of the arc into each node but the root, or none where a node is out of reach.
pub(super) fn arborescence(costs: &Costs) -> Option<Vec<usize>> {
    let nodes = costs.nodes;
    let origin = (0..nodes * nodes).map(|arc| (arc / nodes, arc % nodes)).collect::<Vec<_>>();
    let level: Vec<_> = (0..nodes).collect();
    let arcs = solve(costs, &origin, &level)?;
    let mut origins = vec![usize::MAX; nodes - 1];
    for (from, to) in arcs {
        origins[to] = from;
    }
    Some(origins)
}

/// The chosen arcs, as `named` names them; `level` gives the node here of each named node.
fn solve(costs: &Costs, named: &[(usize, usize)], level: &[usize]) -> Option<Vec<(usize, usize)>> {
    let root = costs.nodes - 1;
    let cheapest = |to: usize| {
        let from = (0..costs.nodes).filter(|&from| from != to);
        from.min_by(|&a, &b| costs.get(a, to).total_cmp(&costs.get(b, to)))
    };
    let into: Vec<usize> = (0..root).map(cheapest).collect::<Option<_>>()?;
    if into.iter().enumerate().any(|(to, &from)| costs.get(from, to) == f64::INFINITY) {
        return None;
    }
    let cycle = cycles(&into, root);
    let name = |to: usize| named[into[to] * costs.nodes + to];
    if cycle.iter().all(Option::is_none) {
        return Some((0..root).map(name).collect());
    }
    let (place, count) = places(&cycle, root);
    let (inner, inner_named) = contract(costs, named, &cycle, &into, &place, count);
    let inner_level: Vec<_> = level.iter().map(|&node| place[node]).collect();
    let mut arcs = solve(&inner, &inner_named, &inner_level)?;
    // The arc that enters a cycle takes the place of the cycle's own arc into the same node.
    let mut keep = vec![true; root];
    for &(_, to) in &arcs {
        keep[level[to]] = false;
    }
    arcs.extend((0..root).filter(|&to| cycle[to].is_some() && keep[to]).map(name));
    Some(arcs)
}

/// The number of the cycle that each node is on, if any.
fn cycles(into: &[usize], root: usize) -> Vec<Option<usize>> {
    let mut visited = vec![usize::MAX; root];
    let mut cycle = vec![None; root];
    let mut count = 0;
    for start in 0..root {
        let mut at = start;
        while at != root && visited[at] == usize::MAX {
            visited[at] = start;
            at = into[at];
        }
        if at != root && visited[at] == start && cycle[at].is_none() {
            let mut around = at;
            loop {
                cycle[around] = Some(count);
                around = into[around];
                if around == at {
                    break;
                }
            }
            count += 1;
        }
    }
    cycle
}

/// The node that each node becomes when cycles are contracted, the root last, and how many there are.
fn places(cycle: &[Option<usize>], root: usize) -> (Vec<usize>, usize) {
    let cycles = cycle.iter().flatten().max().map_or(0, |most| most + 1);
    let mut count = cycles;
    let mut place: Vec<_> = cycle
        .iter()
        .map(|cycle| {
            cycle.unwrap_or_else(|| {
                count += 1;
                count - 1
            })
        })
        .collect();
    debug_assert_eq!(place.len(), root);
    place.push(count);
    (place, count + 1)
}

fn contract(
    costs: &Costs,
    named: &[(usize, usize)],
    cycle: &[Option<usize>],
    into: &[usize],
    place: &[usize],
    count: usize,
) -> (Costs, Vec<(usize, usize)>) {
    let mut inner = Costs { nodes: count, costs: vec![f64::INFINITY; count * count] };
    let mut inner_named = vec![(usize::MAX, usize::MAX); count * count];
    for from in 0..costs.nodes {
        for to in 0..costs.nodes - 1 {
            let (a, b) = (place[from], place[to]);
            if a == b {
                continue;
            }
            let spared = if cycle[to].is_some() { costs.get(into[to], to) } else { 0.0 };
            let cost = costs.get(from, to) - spared;
            if cost < inner.costs[a * count + b] {
                inner.costs[a * count + b] = cost;
                inner_named[a * count + b] = named[from * costs.nodes + to];
            }
        }
    }
    (inner, inner_named)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The least sum over all choices of an arc into each node, by trying them all.
    fn least(costs: &Costs) -> f64 {
        let (nodes, root) = (costs.nodes, costs.nodes - 1);
        let mut best = f64::INFINITY;
        for mut number in 0..nodes.pow(root as u32) {
            let mut into = Vec::new();
            for _ in 0..root {
                into.push(number % nodes);
                number /= nodes;
            }
            let reaches =
                |start: usize| (0..nodes).fold(start, |at, _| if at == root { at } else { into[at] }) == root;
            if (0..root).all(reaches) {
                best = best.min(into.iter().enumerate().map(|(to, &from)| costs.get(from, to)).sum());
            }
        }
        best
    }

    #[test]
    fn it_is_the_cheapest_of_all() {
        let mut random = fastrand::Rng::with_seed(7);
        for _ in 0..300 {
            let nodes = random.usize(2..7);
            let mut costs = Costs { nodes, costs: Vec::new() };
            costs.costs = (0..nodes * nodes).map(|_| f64::from(random.u32(1..20))).collect();
            (0..nodes).for_each(|node| costs.costs[node * nodes + node] = f64::INFINITY);
            let origins = arborescence(&costs).unwrap();
            let sum: f64 = origins.iter().enumerate().map(|(to, &from)| costs.get(from, to)).sum();
            assert_eq!(sum, least(&costs), "{costs:?}");
        }
    }
}
