//! Words that must not stand in the code, each with its cure.

use crate::sources::{Source, all, below, has_word, none};
use aldis_tests::root;

/// What the pure packages must not touch.
const IMPURE: [(&str, &str); 10] = [
    ("Instant::now", "take `now: Now` as an argument"),
    ("SystemTime::now", "take `now: Now` as an argument"),
    ("std::thread", "emit a job effect; the gateway runs it on a thread"),
    ("std::fs", "take bytes as an argument, or ask the journal by an effect"),
    ("std::net", "emit an effect; sockets belong into the gateway"),
    ("tokio", "emit an effect; the runtime belongs into the gateway"),
    ("zenoh", "emit an effect; the bus belongs into gateway/src/bus"),
    ("HashMap", "its order is random: use BTreeMap"),
    ("HashSet", "its order is random: use BTreeSet"),
    ("rand::", "take a seed as an argument: fastrand::Rng::with_seed"),
];

/// What stands in no text. Spelled in two parts, so that this file does not match itself.
const UNFINISHED: [(&str, &str); 3] = [
    (concat!("TO", "DO"), "do it, or file an issue"),
    (concat!("FIX", "ME"), "fix it, or file an issue"),
    (concat!("X", "XX"), "say what is meant, or file an issue"),
];

/// What stands in no code.
const UNSURE: [(&str, &str); 2] = [
    (concat!("#[", "ignore"), "make the test fast and sure enough to run always, or delete it"),
    (concat!("thread::", "sleep"), "wait for the event itself: a channel, a condition, `aldis_tests::until`"),
];

fn complaints<'a>(
    lines: impl Iterator<Item = (usize, &'a str)>,
    path: &str,
    bans: &[(&str, &str)],
) -> Vec<String> {
    let found = |(number, line): (usize, &str)| {
        let banned = bans.iter().filter(|(word, _)| has_word(line, word));
        banned.map(|(word, cure)| format!("{path}:{number}: `{word}`: {cure}")).collect::<Vec<_>>()
    };
    lines.flat_map(found).collect()
}

#[test]
fn envelope_and_services_are_pure() {
    let sources = below("envelope/src").into_iter().chain(below("services/src"));
    let pure = |source: Source| complaints(source.code(), &source.path, &IMPURE);
    none(&sources.filter(|source| !source.is_test()).flat_map(pure).collect::<Vec<_>>());
}

#[test]
fn nothing_is_left_open() {
    let texts = [".rs", ".toml", ".md", ".py", ".sh"];
    let sources = all().into_iter().filter(|source| texts.iter().any(|end| source.path.ends_with(end)));
    let open = |source: Source| {
        let lines = source.text.lines().enumerate().map(|(number, line)| (number + 1, line));
        let bans = if source.is_rust() { [&UNFINISHED[..], &UNSURE].concat() } else { UNFINISHED.to_vec() };
        complaints(lines, &source.path, &bans)
    };
    none(&sources.flat_map(open).collect::<Vec<_>>());
}

#[test]
fn no_file_holds_a_path_of_this_machine() {
    let here = format!("{}/", root().display());
    let home = std::env::var("HOME").ok().filter(|home| home.len() > 1).map(|home| format!("{home}/"));
    let paths: Vec<_> =
        [Some(here), home, Some(concat!("/wo", "rk/").to_owned())].into_iter().flatten().collect();
    let held = |source: Source| {
        let lines = source.text.lines().enumerate();
        let found = lines.filter(|(_, line)| paths.iter().any(|path| line.contains(path)));
        let complaint = |(number, line): (usize, &str)| {
            format!(
                "{}:{}: a path of one machine; write it relative to the project: {line}",
                source.path,
                number + 1
            )
        };
        found.map(complaint).collect::<Vec<_>>()
    };
    none(&all().into_iter().flat_map(held).collect::<Vec<_>>());
}
