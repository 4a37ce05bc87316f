//! Notes to people, at a bounded rate: a peer that sends garbage must not fill the log.

use crate::service::{Level, Note};
use aldis_envelope::Monotonic;
use std::collections::BTreeMap;
use std::time::Duration;

/// How long a kind of note stays silent after it was said. Shorter fills logs, longer hides that it goes on.
const QUIET: Duration = Duration::from_secs(10);

/// How many kinds are remembered. Kinds hold names of peers, which come from outside.
const KINDS_MAX: usize = 1_024;

/// Says each kind of note at once, then at most every ten seconds with the number of those left out.
#[derive(Debug, Default)]
pub struct Notes {
    kinds: BTreeMap<String, (Monotonic, u64)>,
}

impl Notes {
    /// The note to say now, if any. `kind` tells repeated notes apart; the text may differ.
    pub fn say(&mut self, now: Monotonic, level: Level, kind: &str, text: String) -> Option<Note> {
        if self.kinds.len() >= KINDS_MAX {
            self.kinds.retain(|_, (said, _)| now - *said < QUIET);
        }
        match self.kinds.get_mut(kind) {
            Some((said, held)) if now - *said < QUIET => {
                *held += 1;
                None
            }
            Some((said, held)) => {
                let more = std::mem::take(held);
                *said = now;
                let text = if more > 0 { format!("{text} (and {more} more like it)") } else { text };
                Some(Note { level, text })
            }
            None => {
                if self.kinds.len() < KINDS_MAX {
                    self.kinds.insert(kind.to_owned(), (now, 0));
                }
                Some(Note { level, text })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_is_said_at_once_then_rarely_with_the_number_held_back() {
        let mut notes = Notes::default();
        let at = |s: u64| Monotonic::since_start(Duration::from_secs(s));
        let mut say = |s, kind| notes.say(at(s), Level::Warning, kind, "bad".into()).map(|note| note.text);
        assert_eq!(say(0, "a").as_deref(), Some("bad"));
        assert_eq!(say(1, "a"), None);
        assert_eq!(say(2, "b").as_deref(), Some("bad"));
        assert_eq!(say(9, "a"), None);
        assert_eq!(say(10, "a").as_deref(), Some("bad (and 2 more like it)"));
    }
}
