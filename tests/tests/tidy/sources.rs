//! The files of the project, as the rules read them.

use aldis_tests::root;
use std::path::Path;
use std::process::Command;

/// A text file of the project.
pub(crate) struct Source {
    /// Its path from the root, with `/`.
    pub(crate) path: String,
    /// What is in it.
    pub(crate) text: String,
}

impl Source {
    /// Whether it is Rust.
    pub(crate) fn is_rust(&self) -> bool {
        self.path.ends_with(".rs")
    }

    /// Whether it holds tests and nothing else.
    pub(crate) fn is_test(&self) -> bool {
        self.path.split('/').any(|part| part == "tests" || part == "tests.rs")
    }

    /// Its lines without comments, with their numbers, up to the tests at its end.
    pub(crate) fn code(&self) -> impl Iterator<Item = (usize, &str)> {
        let end = self.text.find("#[cfg(test)]\nmod ").unwrap_or(self.text.len());
        let lines = self.text[..end].lines().map(|line| line.split("//").next().unwrap_or_default());
        lines.enumerate().map(|(number, line)| (number + 1, line))
    }
}

/// Every text file of the project: what git knows or would add.
pub(crate) fn all() -> Vec<Source> {
    let git = ["ls-files", "-z", "--cached", "--others", "--exclude-standard"];
    let listed = Command::new("git").args(git).current_dir(root()).output().expect("git runs");
    assert!(listed.status.success(), "git cannot list the files: {listed:?}");
    let paths = String::from_utf8(listed.stdout).expect("paths are UTF-8");
    let read = |path: &str| {
        // A path may be gone from the disk but not yet from git, and some files are no text.
        let text = std::fs::read_to_string(root().join(path)).ok()?;
        Some(Source { path: path.to_owned(), text })
    };
    let sources: Vec<_> = paths.split('\0').filter(|path| !path.is_empty()).filter_map(read).collect();
    assert!(sources.len() > 50, "only {} files were found in {}", sources.len(), root().display());
    sources
}

/// The sources in a directory.
pub(crate) fn below(directory: &str) -> Vec<Source> {
    let mut sources = all();
    sources.retain(|source| source.is_rust() && Path::new(&source.path).starts_with(directory));
    sources
}

/// Whether a line has a word that does not continue one before it; where the word ends in a letter, none may follow.
pub(crate) fn has_word(line: &str, word: &str) -> bool {
    let part = |c: char| c.is_alphanumeric() || c == '_';
    line.match_indices(word).any(|(at, _)| {
        let before = line[..at].chars().next_back().is_some_and(part);
        let after = line[at + word.len()..].chars().next().is_some_and(part);
        !(before || after && word.ends_with(part))
    })
}

/// Fails with all complaints at once.
#[track_caller]
pub(crate) fn none(complaints: &[String]) {
    assert!(complaints.is_empty(), "\n{}\n", complaints.join("\n"));
}

#[test]
fn words_are_whole() {
    assert!(has_word("use rand::Rng", "rand::") && !has_word("use fastrand::Rng", "rand::"));
    assert!(has_word("zenoh::open()", "zenoh") && !has_word("zenoh_config()", "zenoh"));
}
