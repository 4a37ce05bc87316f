//! Random addresses that are hard on escaping and matching, and prefixes cut from them.

use crate::rules::is_id;
use aldis_envelope::{Address, Prefix};
use fastrand::Rng;

/// Separators and halves of them, wildcards, escapes, what Zenoh keeps for itself, more bytes than characters.
const PIECES: [&str; 24] = [
    ".", ".", "::", "::", ":", "a", "a", "b", "ab", "B", "-", "_", "0", "%", "%2E", "*", "**", "@", "/", "?",
    "#", "é", "海", " ",
];
const BEGINNINGS: [&str; 8] = ["afrl.cmasi", "UMAA::SO::", "@", "eid", "sid", "eid.2", ".", "a"];
const ENTITIES: [&str; 6] = ["eid2", "eid20", "eid200", "eid2000", "eid21", "eid281474976710655"];
const SERVICES: [&str; 6] = ["sid5", "sid50", "sid500", "sid4294967295", "sidall", ""];

pub(crate) struct Texts(Rng);

impl Texts {
    pub(crate) fn with_seed(seed: u64) -> Self {
        Self(Rng::with_seed(seed))
    }

    fn one_of(&mut self, texts: &[&'static str]) -> &'static str {
        texts[self.0.usize(..texts.len())]
    }

    /// A valid address.
    pub(crate) fn address(&mut self) -> String {
        loop {
            let text = if self.0.u8(..4) == 0 { self.id() } else { self.name() };
            if Address::new(&text).is_ok() {
                return text;
            }
        }
    }

    fn id(&mut self) -> String {
        let (entity, service) = (self.one_of(&ENTITIES), self.one_of(&SERVICES));
        let dot = if self.0.bool() && !service.is_empty() { "." } else { "" };
        format!("{entity}{dot}{service}")
    }

    fn name(&mut self) -> String {
        let beginning = if self.0.bool() { self.one_of(&BEGINNINGS) } else { "" };
        let rest: String = (0..self.0.usize(1..7)).map(|_| self.one_of(&PIECES)).collect();
        format!("{beginning}{rest}")
    }

    pub(crate) fn addresses(&mut self, count: usize) -> Vec<String> {
        (0..count).map(|_| self.address()).collect()
    }

    /// A valid prefix: an address cut somewhere, sometimes with another end.
    pub(crate) fn prefix_of(&mut self, address: &str) -> String {
        loop {
            let length = self.0.usize(..=address.chars().count());
            let mut text: String = address.chars().take(length).collect();
            if self.0.u8(..4) == 0 {
                text.push_str(self.one_of(&PIECES));
            }
            if Prefix::new(&text).is_ok() {
                return text;
            }
        }
    }

    /// Prefixes of some of these addresses; a third of them ids.
    pub(crate) fn prefixes(&mut self, addresses: &[String], count: usize) -> Vec<String> {
        let (ids, names): (Vec<_>, Vec<_>) = addresses.iter().partition(|text| is_id(text));
        let pick = |draw: &mut Rng, from: &[&String]| from[draw.usize(..from.len())].clone();
        let prefixes = (0..count).map(|number| {
            let address = pick(&mut self.0, if number % 3 == 0 { &ids } else { &names });
            self.prefix_of(&address)
        });
        prefixes.collect()
    }
}
