//! Which topics are bridged: patterns that allow and deny.

use std::fmt;
use std::str::FromStr;

/// A pattern of topic names: `*` stands for any text, all else for itself.
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
    #[error("{0} bytes in a pattern, 512 are allowed")]
    TooLong(usize),
}

impl FromStr for Glob {
    type Err = GlobError;
    fn from_str(text: &str) -> Result<Self, GlobError> {
        match text.len() {
            0 => Err(GlobError::Empty),
            513.. => Err(GlobError::TooLong(text.len())),
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
        let mut parts = self.text.split('*');
        // What stands before the first `*` must be the beginning.
        let Some(mut rest) = parts.next().and_then(|first| name.strip_prefix(first)) else { return false };
        let mut parts = parts.peekable();
        if parts.peek().is_none() {
            return rest.is_empty();
        }
        while let Some(part) = parts.next() {
            if parts.peek().is_none() {
                return rest.ends_with(part);
            }
            // The earliest place leaves the most for what follows.
            let Some(at) = rest.find(part) else { return false };
            rest = &rest[at + part.len()..];
        }
        true
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

#[cfg(test)]
mod tests {
    use super::*;

    fn glob(text: &str) -> Glob {
        text.parse().unwrap()
    }

    #[test]
    fn a_star_stands_for_any_text() {
        let name = "UMAA::SO::HealthReport::HealthReport";
        for good in ["*", name, "UMAA::*", "*HealthReport", "UMAA::*::Health*", "*SO*Report*", "U*A*t", "**"]
        {
            assert!(glob(good).matches(name), "{good}");
        }
        for bad in ["UMAA", "UMAA::SO::*Command", "*SA*", "HealthReport*", "*Report::*Report*Report"] {
            assert!(!glob(bad).matches(name), "{bad}");
        }
        assert!(!glob("aba*aba").matches("ababa"), "no part counts twice");
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
