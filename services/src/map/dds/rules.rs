//! What a configuration says of topics by patterns of their names: which are bridged, and with which quality of service.

use crate::service::domain::{Durable, Quality};
use std::fmt;
use std::str::FromStr;

/// The longest pattern, in bytes: that of a name in an envelope.
const BYTES_MAX: usize = 512;

/// A pattern of names: `*` stands for any text, `?` for any character, all else for itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Glob {
    text: String,
}

/// The text is no pattern.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GlobError {
    /// There is nothing in it.
    #[error("an empty pattern matches no topic: write `*` for all")]
    Empty,
    /// It would take long to match.
    #[error("{0} bytes in a pattern, {BYTES_MAX} are allowed")]
    TooLong(usize),
}

impl FromStr for Glob {
    type Err = GlobError;
    fn from_str(text: &str) -> Result<Self, GlobError> {
        match text.len() {
            0 => Err(GlobError::Empty),
            length if length > BYTES_MAX => Err(GlobError::TooLong(length)),
            _ => Ok(Self { text: text.to_owned() }),
        }
    }
}

impl fmt::Display for Glob {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Glob {
    /// Whether a name fits.
    pub fn matches(&self, name: &str) -> bool {
        let (mut pattern, mut text) = (self.text.as_str(), name);
        // What follows the last star, and what it has not reached yet.
        let mut star: Option<(&str, &str)> = None;
        loop {
            let mut wanted = pattern.chars();
            let mut found = text.chars();
            match (wanted.next(), found.next()) {
                (Some('*'), _) => {
                    pattern = wanted.as_str();
                    star = Some((pattern, text));
                }
                (None, None) => return true,
                (Some(w), Some(f)) if w == '?' || w == f => {
                    (pattern, text) = (wanted.as_str(), found.as_str())
                }
                _ => {
                    // The star reaches one character further.
                    let Some((after, reached)) = star else { return false };
                    let mut rest = reached.chars();
                    if rest.next().is_none() {
                        return false;
                    }
                    (pattern, text) = (after, rest.as_str());
                    star = Some((after, text));
                }
            }
        }
    }
}

/// What is bridged: what some pattern allows and none denies.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Rules {
    /// Empty: everything.
    pub allow: Vec<Glob>,
    /// Goes before what allows.
    pub deny: Vec<Glob>,
}

impl Rules {
    /// Whether a topic is bridged.
    pub fn admit(&self, topic: &str) -> bool {
        let any = |globs: &[Glob]| globs.iter().any(|glob| glob.matches(topic));
        (self.allow.is_empty() || any(&self.allow)) && !any(&self.deny)
    }
}

/// What a configuration says of the quality of service of topics.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct QualityRule {
    /// Of which.
    pub topics: Glob,
    /// RELIABLE, or BEST_EFFORT.
    pub reliable: Option<bool>,
    /// TRANSIENT_LOCAL, or VOLATILE.
    pub durable: Option<bool>,
    /// HISTORY of so many samples of an instance; 0 is all.
    pub keep_last: Option<u32>,
}

impl QualityRule {
    /// Changes what the patterns of UMAA say.
    pub(super) fn apply(&self, quality: &mut Quality) {
        quality.reliable = self.reliable.unwrap_or(quality.reliable);
        if let Some(durable) = self.durable {
            quality.durable = if durable { Durable::TransientLocal } else { Durable::Volatile };
        }
        if let Some(count) = self.keep_last {
            quality.keep_last = (count > 0).then_some(count);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glob(text: &str) -> Glob {
        text.parse().unwrap()
    }

    #[test]
    fn a_star_stands_for_any_text_and_a_question_mark_for_a_character() {
        let name = "UMAA::SO::HealthReport::HealthReport";
        for good in
            ["*", name, "UMAA::*", "*HealthReport", "UMAA::*::Health*", "*SO*Report*", "U*A*t", "**", "?MAA*"]
        {
            assert!(glob(good).matches(name), "{good}");
        }
        for bad in
            ["UMAA", "UMAA::SO::*Command", "*SA*", "HealthReport*", "*Report::*Report*Report", "?UMAA*"]
        {
            assert!(!glob(bad).matches(name), "{bad}");
        }
        assert!(!glob("aba*aba").matches("ababa"), "no part counts twice");
        assert!(
            glob("a*b*c").matches("aXbYbZc") && !glob("a*b*c").matches("acb") && glob("a?c").matches("aäc")
        );
        assert!(!glob("a?").matches("a") && glob("*").matches(""));
        assert_eq!("".parse::<Glob>(), Err(GlobError::Empty));
        assert_eq!("x".repeat(600).parse::<Glob>(), Err(GlobError::TooLong(600)));
    }

    #[test]
    fn what_is_denied_stays_out_whatever_allows_it() {
        let rules = Rules { allow: vec![glob("UMAA::*")], deny: vec![glob("*Log*")] };
        assert!(
            rules.admit("UMAA::SO::X") && !rules.admit("UMAA::SO::LogReport") && !rules.admit("rt/chatter")
        );
        assert!(Rules::default().admit("anything"));
    }
}
