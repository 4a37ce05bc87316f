//! What a prefix receives over real Zenoh is exactly what the rules of spec uxas-wire say: the key expression that it
//! declares lets enough through, and the exact text takes the rest away.

mod network;
mod rules;
mod texts;

use aldis_envelope::{
    Address, ContentType, Descriptor, EntityId, Fleet, Keys, Label, Prefix, ServiceId, Source, Space,
};
use fastrand::Rng;
use network::Network;
use rules::receives;
use std::collections::BTreeSet;
use texts::Texts;
use zenoh::key_expr::KeyExpr;

/// How a subscription is made: what it declares, and what it keeps of that. Ours, or one broken on purpose.
struct Subscriptions {
    declares: fn(&Keys, &Prefix) -> String,
    keeps: fn(&Prefix, &Address) -> bool,
}

const OURS: Subscriptions = Subscriptions {
    declares: |keys, prefix| keys.subscription(Space::Data, prefix),
    keeps: |prefix, address| prefix.matches(address),
};

/// Ways to be wrong, of which each must be found.
const BROKEN: [(&str, Subscriptions); 5] = [
    (
        "ids match as text: eid200 gets eid2000",
        Subscriptions {
            keeps: |prefix, address| dotted(address).starts_with(&dotted_prefix(prefix)),
            declares: |keys, _| keys.subscription(Space::Data, &Prefix::all()),
        },
    ),
    ("the key expression alone decides", Subscriptions { keeps: |_, _| true, ..OURS }),
    (
        "a chunk must be whole: afrl.cmasi does not get afrl.cmasix",
        Subscriptions {
            declares: |keys, prefix| (OURS.declares)(keys, prefix).replace("$*/**", "/**"),
            ..OURS
        },
    ),
    (
        "what may follow is one chunk",
        Subscriptions {
            declares: |keys, prefix| (OURS.declares)(keys, prefix).replace("$*/**", "$*"),
            ..OURS
        },
    ),
    (
        "a separator at the end must be one in the key: a: does not get a:b",
        Subscriptions {
            declares: |keys, prefix| match prefix {
                Prefix::Text(text) if text.ends_with(['.', ':']) => {
                    (OURS.declares)(keys, prefix).replace("$*/**", "/**")
                }
                _ => (OURS.declares)(keys, prefix),
            },
            ..OURS
        },
    ),
];

fn dotted(address: &Address) -> String {
    let mut text = String::new();
    address.write(aldis_envelope::Dialect::OpenUxas, &mut text).expect("a text can be written to");
    text
}

fn dotted_prefix(prefix: &Prefix) -> String {
    match prefix {
        Prefix::Text(text) => text.to_string(),
        Prefix::Id(id) => dotted(id),
    }
}

fn keys() -> Keys {
    Keys::new(&Fleet::new("subscriptions").expect("a fleet"))
}

/// The key on which somebody puts a message to an address.
fn key(keys: &Keys, address: &Address) -> String {
    let source = Source::new(EntityId::new(7).expect("an entity"), ServiceId::new(9).expect("a service"));
    let descriptor = Descriptor::new("d").expect("a descriptor");
    let label = Label::limitedcast(address.clone(), ContentType::Lmcp, descriptor, source);
    keys.envelope(Space::Data, &label, None)
}

/// Where subscriptions differ from the rules when all of these addresses are put on a network where all of these
/// prefixes are declared; and how many pairs of the two there were.
fn differences(how: &Subscriptions, prefixes: &[String], addresses: &[String]) -> (Vec<String>, usize) {
    let keys = keys();
    let prefixes: Vec<_> = prefixes.iter().map(|text| (text, Prefix::new(text).expect(text))).collect();
    let addresses: Vec<_> = addresses.iter().map(|text| (text, Address::new(text).expect(text))).collect();
    let expressions: BTreeSet<_> = prefixes.iter().map(|(_, prefix)| (how.declares)(&keys, prefix)).collect();
    let put: Vec<_> = addresses.iter().map(|(_, address)| key(&keys, address)).collect();
    let arrived = Network::open().arrivals(&expressions, &put);
    let mut different = Vec::new();
    let mut received = 0;
    for (prefix_text, prefix) in &prefixes {
        let arrived = &arrived[&(how.declares)(&keys, prefix)];
        for (place, (text, address)) in addresses.iter().enumerate() {
            let gets = arrived.contains(&place) && (how.keeps)(prefix, address);
            received += usize::from(gets);
            if gets != receives(prefix_text, text) {
                different.push(format!("{prefix_text:?} gets {text:?}: {gets}"));
            }
        }
    }
    assert!(received > addresses.len(), "prefixes that receive nothing test nothing");
    (different, prefixes.len() * addresses.len())
}

#[test]
fn a_subscription_receives_what_the_rules_say_over_zenoh() {
    let mut texts = Texts::with_seed(1);
    let addresses = texts.addresses(500);
    let prefixes = texts.prefixes(&addresses, 400);
    let (different, pairs) = differences(&OURS, &prefixes, &addresses);
    assert_eq!(different, Vec::<String>::new());
    assert!(pairs >= 100_000, "{pairs} pairs");
}

#[test]
fn the_table_of_the_specification_holds_over_zenoh() {
    let prefixes = rules::TABLE.iter().map(|(prefix, ..)| (*prefix).to_owned()).collect::<Vec<_>>();
    let listed = rules::TABLE.iter().flat_map(|(_, gets, gets_not)| gets.iter().chain(*gets_not));
    let addresses: Vec<_> = listed.map(|text| (*text).to_owned()).collect();
    for (prefix, gets, gets_not) in rules::TABLE {
        assert!(gets.iter().all(|address| receives(prefix, address)), "{prefix}");
        assert!(!gets_not.iter().any(|address| receives(prefix, address)), "{prefix}");
    }
    assert_eq!(differences(&OURS, &prefixes, &addresses).0, Vec::<String>::new());
}

#[test]
fn broken_rules_are_found_over_zenoh() {
    let mut texts = Texts::with_seed(2);
    let addresses = texts.addresses(150);
    let prefixes = texts.prefixes(&addresses, 150);
    for (what, how) in &BROKEN {
        let (different, pairs) = differences(how, &prefixes, &addresses);
        assert!(!different.is_empty(), "not found in {pairs} pairs: {what}");
    }
}

/// Pairs that no network has seen together: each prefix with an address of its own, by Zenoh's own arithmetic.
#[test]
fn zenoh_lets_through_what_the_rules_say() {
    let (keys, mut texts, mut draw) = (keys(), Texts::with_seed(3), Rng::with_seed(4));
    let mut received = 0;
    for _ in 0..100_000 {
        let text = texts.address();
        let of = if draw.u8(..4) == 0 { texts.address() } else { text.clone() };
        let prefix_text = texts.prefix_of(&of);
        let (prefix, address) =
            (Prefix::new(&prefix_text).expect("a prefix"), Address::new(&text).expect("ours"));
        let expression = keys.subscription(Space::Data, &prefix);
        let canonical = KeyExpr::autocanonize(expression.clone()).expect("a key expression");
        assert_eq!(canonical.as_str(), expression, "Zenoh writes it in the same way");
        let key = KeyExpr::try_from(key(&keys, &address)).expect("a key");
        assert!(!key.is_wild());
        let arrives = canonical.intersects(&key);
        assert_eq!(
            arrives && prefix.matches(&address),
            receives(&prefix_text, &text),
            "{prefix_text:?} {text:?}"
        );
        received += usize::from(arrives);
    }
    assert!(received > 50_000, "only {received} pairs meet");
}

/// A session that declares a cover gets what all of its prefixes receive, each message once.
#[test]
fn a_cover_receives_once_what_its_prefixes_receive() {
    let (keys, mut texts, mut draw) = (keys(), Texts::with_seed(5), Rng::with_seed(6));
    let addresses = texts.addresses(300);
    for _ in 0..60 {
        let prefixes = texts.prefixes(&addresses, draw.usize(1..12));
        let prefixes: Vec<_> = prefixes.iter().map(|text| Prefix::new(text).expect("a prefix")).collect();
        let cover = keys.cover(Space::Data, &prefixes);
        let cover: Vec<_> = cover.into_iter().map(|e| KeyExpr::try_from(e).expect("an expression")).collect();
        for address in &addresses {
            let address = Address::new(address).expect("an address");
            let key = KeyExpr::try_from(key(&keys, &address)).expect("a key");
            let times = cover.iter().filter(|expression| expression.intersects(&key)).count();
            assert!(times <= 1, "{address} comes {times} times by {cover:?}");
            assert!(
                times == 1 || !prefixes.iter().any(|prefix| prefix.matches(&address)),
                "{address} {cover:?}"
            );
        }
    }
}
