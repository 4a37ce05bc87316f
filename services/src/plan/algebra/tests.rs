//! Against what the reference computes, and what it crashes at.

use super::*;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The most states that a transcript of the reference shows.
const SHOWN_MAX: usize = 40;

/// What one walk over all orders has found.
#[derive(Default)]
struct Walk {
    text: String,
    shown: usize,
    nodes: usize,
    leaves: Vec<Vec<i64>>,
}

fn walk(algebra: &Algebra<u128>, ids: &[i64], order: &mut Vec<usize>, done: &mut Walk) {
    let executed = order.iter().fold(0, |set: u128, atom| set | 1 << atom);
    let mut next = Vec::new();
    algebra.next(&executed, &mut |atom| next.push(atom));
    let spell = |atoms: &[usize]| atoms.iter().map(|&atom| format!("{} ", ids[atom])).collect::<String>();
    done.nodes += 1;
    if done.shown < SHOWN_MAX {
        done.shown += 1;
        writeln!(done.text, "EX[{}] NEXT[{}]", spell(order), spell(&next)).unwrap();
    }
    if next.is_empty() {
        done.leaves.push(order.iter().map(|&atom| ids[atom]).collect());
    }
    for atom in next {
        order.push(atom);
        walk(algebra, ids, order, done);
        order.pop();
    }
}

/// What the reference prints of an expression, as we compute it.
fn transcript(text: &str, ids: &[i64]) -> String {
    let expression = match parse(text, Reading::Compat, "a test") {
        Ok(expression) => expression,
        Err(error) => return error.to_string(),
    };
    let place = |atom: &Named| ids.iter().position(|id| *id == atom.id).ok_or(atom.id);
    let mut told = format!("AlgebraString:: {text}\n");
    match expression.map(&mut |atom| place(atom)) {
        Err(unknown) => writeln!(told, "Algebra ERROR: Objective [{unknown}] ID NOT FOUND").unwrap(),
        Ok(expression) => {
            let mut done = Walk::default();
            walk(&Algebra::new(&expression, ids.len()), ids, &mut Vec::new(), &mut done);
            let leaves = done.leaves.len();
            done.leaves.sort();
            done.leaves.dedup();
            let (text, nodes, distinct) = (done.text, done.nodes, done.leaves.len());
            write!(told, "OK 1\n{text}NODES {nodes} LEAVES {leaves} DISTINCT {distinct}\n").unwrap();
        }
    }
    told
}

#[test]
fn the_transcripts_of_the_reference_are_the_same() {
    let Some(golden) = crate::plan::tests::golden("algebra_golden.txt") else { return };
    let mut same = 0;
    for case in golden.split("=== ").filter(|case| !case.trim().is_empty()) {
        let (head, rest) = case.split_once('\n').unwrap();
        // A text, then the ids of its objectives.
        let words: Vec<_> = head.split(' ').collect();
        let ids = words.iter().rev().take_while(|word| word.parse::<i64>().is_ok()).count();
        let text = words[..words.len() - ids].join(" ");
        let ids: Vec<i64> = words[words.len() - ids..].iter().map(|id| id.parse().unwrap()).collect();
        // The reference reads part of a malformed text, or dies of it; ours is a mistake with a place.
        if text.is_empty() || text == "|(p1(p2))" {
            assert!(parse(&text, Reading::Compat, "a test").is_err(), "{text:?}");
            continue;
        }
        let (expected, _) = rest.split_once("rc=").unwrap();
        assert_eq!(transcript(&text, &ids), expected, "{text:?}");
        same += 1;
    }
    assert!(same >= 16, "only {same} transcripts");
}

#[test]
fn mistakes_point_into_the_text() {
    let told = |text: &str| parse(text, Reading::Strict, "the task relationships").unwrap_err().to_string();
    assert_eq!(
        told("|(p1 +(p2 p3 )"),
        "the task relationships, character 1: the parenthesis of `|` is not closed: add `)`\n  |(p1 +(p2 p3 )\n  ^"
    );
    assert!(told("|(p1 q2)").ends_with("|(p1 q2)\n       ^"));
    for (text, part) in [
        ("p1", "should be followed by a blank or `)`"),
        ("|(p1(p2))", "should be followed by a blank or `)`"),
        ("| (p1)", "must be followed directly by `(`"),
        ("|(p1 p)", "should be followed by an id"),
        ("|(p1 p1)", "named twice"),
        ("+(.() p1)", "`.()` has nothing in it"),
        ("|(p1) p2 ", "complete before this"),
        ("|(p99999999999999999999)", "too large"),
        ("", "no operator and no atom"),
    ] {
        assert!(told(text).contains(part), "{text}: {}", told(text));
    }
    assert!(told(&format!("{}p1 {}", "|(".repeat(100_000), ")".repeat(100_000))).contains("nested deeper"));
    assert_eq!(told("|(é p1)").lines().last().unwrap(), "    ^", "characters, not bytes");
}

#[test]
fn compositions_take_the_place_of_their_tasks() {
    let compositions = BTreeMap::from([(1, "+(p10 p11 )"), (2, "p10 "), (3, ".(p1 p2)")]);
    let composed = |text| compose(text, &compositions, &|_, option| option != 99, Unnamed::Refuse);
    let atoms = composed("").unwrap().atoms().into_iter().copied().collect::<Vec<_>>();
    assert_eq!(atoms, [(1, 10), (1, 11), (2, 10), (3, 1), (3, 2)]);
    for (text, part) in [
        ("|(p1 p2)", "task 3 is in the request"),
        ("|(p1 p2 p3 p9)", "character 12: task 9 is not among"),
        (".(p1 p2 p1 p3)", "p1 is named twice"),
    ] {
        let told = composed(text).unwrap_err().to_string();
        assert!(told.contains(part), "{text}: {told}");
    }
    assert_eq!(compose("|(p1 p2)", &compositions, &|_, _| true, Unnamed::LeaveOut).unwrap().atoms().len(), 3);
    for text in ["p10", "p99 "] {
        let wrong = compose("", &BTreeMap::from([(7, text)]), &|_, option| option != 99, Unnamed::Refuse);
        let told = wrong.unwrap_err().to_string();
        assert!(told.starts_with("the composition of task 7, character 1"), "{told}");
    }
}

#[test]
fn what_says_the_same_is_the_same() {
    let canonical = |text: &str| parse(text, Reading::Strict, "a test").unwrap().canonical();
    let canonical = |text: &str| canonical(text).map(&mut |atom| Ok::<_, ()>(atom.id)).unwrap().canonical();
    assert_eq!(canonical("|(p2 |(p1 p3))"), canonical("|(p3 +(p1 ) p2)"));
    assert_ne!(canonical(".(p1 p2)"), canonical(".(p2 p1)"));
}

#[test]
fn masks_and_walks_agree() {
    let text = "|(.(p1 +(p3 |(p5 p7))) .(p2 +(.(p4 p8) p6)))";
    let ids = [1, 2, 3, 4, 5, 6, 7, 8];
    let parsed = parse(text, Reading::Strict, "a test").unwrap();
    let expression = parsed.map(&mut |atom| ids.iter().position(|id| *id == atom.id).ok_or(())).unwrap();
    let (small, large) = (Algebra::<u128>::new(&expression, 8), Algebra::<AtomSet>::new(&expression, 8));
    for set in 0..256_u128 {
        let mut wide = AtomSet::empty(8);
        (0..8).filter(|&atom| set.contains(atom)).for_each(|atom| wide.insert(atom));
        let (mut from_small, mut from_large) = (Vec::new(), Vec::new());
        small.next(&set, &mut |atom| from_small.push(atom));
        large.next(&wide, &mut |atom| from_large.push(atom));
        assert_eq!(from_small, from_large);
    }
}
