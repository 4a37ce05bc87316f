//! From the texts of the TOML reader to a cure. Serde hands errors on as text alone, so types of this module that
//! know their own cure write it on a second line; for all others the cure is found by the text.

/// The text of an error that brings its own cure.
pub(crate) fn cured(message: impl std::fmt::Display, cure: &str) -> String {
    format!("{message}\n{cure}")
}

/// Splits an error's text into what is wrong and what to do about it.
pub(crate) fn split(text: &str) -> (String, String) {
    match text.split_once('\n') {
        Some((message, cure)) => (message.to_owned(), cure.to_owned()),
        None => (in_words(text), cure(text)),
    }
}

/// The reader names types as Rust does; who writes a configuration need not know them.
fn in_words(text: &str) -> String {
    for (rust, words) in [("expected u", "expected a whole number"), ("expected f", "expected a number")] {
        if let Some((before, bits)) = text.rsplit_once(rust)
            && ["8", "16", "32", "64"].contains(&bits)
        {
            return format!("{before}{words}");
        }
    }
    text.to_owned()
}

fn cure(text: &str) -> String {
    if text.starts_with("unknown field") || text.starts_with("unknown variant") {
        return instead(text);
    }
    if let Some(key) = text.strip_prefix("missing field ").map(|key| key.trim_matches('`')) {
        return format!("add `{key} = …` here: it has no default");
    }
    let known = CURES.iter().find(|(part, _)| text.contains(part));
    known
        .map_or("see the JSON Schema of the configuration for what may stand here", |(_, cure)| cure)
        .to_owned()
}

/// Parts of texts of serde, toml and the envelope's types, with the cure for each. The first that is found holds.
const CURES: &[(&str, &str)] = &[
    ("begins like an entity id", "write `eid4`, `eid4sid7` or `eid4sidall`, or a name that begins otherwise"),
    ("which delimits fields", "leave `$` and `|` out: they separate the fields of a message"),
    ("entity id", "entity ids are whole numbers from 1 to 281474976710655"),
    ("service id", "service ids are whole numbers from 1 to 4294967295"),
    ("is not a fleet name", "name the fleet with letters, digits, `-` and `_`, such as `fleet = \"blue\"`"),
    ("socket address", "write an IP address and a port in quotes, such as \"127.0.0.1:5556\""),
    ("map, expected a sequence", "a table that may come several times stands in double brackets: [[bridge]]"),
    ("expected a sequence", "put the values in `[ ]`, even a single one"),
    ("invalid type: integer", "put the value in quotes if a text is meant, in `[ ]` if a list is"),
    ("invalid type: sequence", "give one value here, without `[ ]`"),
    ("invalid type: map", "give a plain value here, not a table"),
    ("invalid type: floating point", "give a whole number, without a point"),
    ("expected a boolean", "write `true` or `false`, without quotes"),
    ("invalid type: string", "write the number without quotes"),
    ("invalid value: integer", "the number is negative or too large for this key"),
    ("duplicate key", "keep one of the two"),
    ("string values must be quoted", "put the text in quotes: key = \"value\""),
    ("invalid basic string", "close the text with a quote on the same line"),
    ("missing comma", "put a comma between the values, and close the list with `]`"),
    ("unclosed array", "close the list with `]`"),
    ("unclosed table", "close the name of the table with `]`"),
];

/// What could stand instead of an unknown word: the nearest, or all.
fn instead(text: &str) -> String {
    let mut words = text.split('`').skip(1).step_by(2);
    let found = words.next().unwrap_or_default();
    let known: Vec<&str> = words.collect();
    match nearest(found, known.iter().copied()) {
        Some(word) => format!("did you mean `{word}`?"),
        None => format!("known here: {}", known.join(", ")),
    }
}

/// The nearest of some words, if one is near: at most a third of its letters, and at least two, are wrong.
pub(crate) fn nearest<'a>(found: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    known
        .map(|word| (distance(found, word), word))
        .filter(|(wrong, word)| *wrong <= (word.len() / 3).max(2) && *wrong < word.len())
        .min()
        .map(|(_, word)| word)
}

/// How many letters must be added, left out or changed to come from one word to the other.
fn distance(from: &str, to: &str) -> usize {
    let to: Vec<char> = to.chars().collect();
    let mut row: Vec<usize> = (0..=to.len()).collect();
    for (i, a) in from.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, b) in to.iter().enumerate() {
            let change = diagonal + usize::from(a != *b);
            diagonal = row[j + 1];
            row[j + 1] = change.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[to.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_word_is_near() {
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(nearest("entitys", ["entities", "operators"].into_iter()), Some("entities"));
        assert_eq!(nearest("dialekt", ["dialect", "listen"].into_iter()), Some("dialect"));
        assert_eq!(nearest("colour", ["dialect", "listen"].into_iter()), None);
    }

    #[test]
    fn an_unknown_word_far_from_all_lists_what_is_known() {
        let (_, cure) = split("unknown field `zzzzzz`, expected `listen` or `connect`");
        assert_eq!(cure, "known here: listen, connect");
    }
}
