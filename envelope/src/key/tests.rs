use super::*;
use crate::id::ServiceId;
use crate::name::{ContentType, Descriptor, Name};
use proptest::prelude::*;

fn keys() -> Keys {
    Keys::new(&Fleet::new("blue").unwrap())
}

fn source(entity: u64, service: u64) -> Source {
    Source::new(EntityId::new(entity).unwrap(), ServiceId::new(service).unwrap())
}

fn key_of(address: &str, instance: Option<&Instance>) -> String {
    let descriptor = Descriptor::new("x").unwrap();
    let label =
        Label::limitedcast(Address::new(address).unwrap(), ContentType::Lmcp, descriptor, source(400, 37));
    keys().envelope(Space::Data, &label, instance)
}

#[test]
fn keys_as_the_wire_format_shows_them() {
    for (address, chunks) in [
        ("afrl.cmasi.AirVehicleState", "afrl/cmasi/AirVehicleState"),
        ("UMAA::SO::HealthReport::HealthReport", "UMAA/SO/HealthReport/HealthReport"),
        ("eid400.sid37", "eid400/sid37"),
        ("eid400sidall", "eid400/sidall"),
        ("eid400", "eid400"),
        ("AircraftPathPlanner", "AircraftPathPlanner"),
        (".a..b.", "%2Ea/%2Eb%2E"),
        ("a:b", "a%3Ab"),
        ("a:::b", "a/%3Ab"),
        ("::a::", "%3A%3Aa%3A%3A"),
        ("@a/*b é", "%40a%2F%2Ab%20%C3%A9"),
        ("a%41", "a%2541"),
    ] {
        assert_eq!(key_of(address, None), format!("aldis/blue/400/37/-/{chunks}"), "{address}");
    }
}

#[test]
fn subscriptions_are_one_key_expression() {
    for (prefix, expression) in [
        ("afrl.cmasi", "afrl/cmasi$*/**"),
        ("afrl.cmasi.", "afrl/cmasi$*/**"),
        ("UMAA::SO:", "UMAA/SO$*/**"),
        ("eid200", "eid200/**"),
        ("eid200.sid5", "eid200/sid5"),
        ("", "**"),
        ("::", "**"),
    ] {
        let expression = format!("aldis/blue/*/*/*/{expression}");
        assert_eq!(keys().subscription(Space::Data, &Prefix::new(prefix).unwrap()), expression);
    }
}

#[test]
fn a_cover_holds_no_expression_inside_another() {
    let cover = |prefixes: &[&str]| {
        let prefixes: Vec<_> = prefixes.iter().map(|p| Prefix::new(p).unwrap()).collect();
        let root = "aldis/blue/*/*/*/";
        keys().cover(Space::Data, &prefixes).iter().map(|e| e[root.len()..].to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(cover(&["afrl.cmasi.Air", "afrl.cm", "afrl.cmasi", "UMAA::"]), ["UMAA$*/**", "afrl/cm$*/**"]);
    assert_eq!(cover(&["eid20", "eid200", "eid20.sid1", "eid20.sidall"]), ["eid20/**", "eid200/**"]);
    assert_eq!(cover(&["eid20.sid1", "eid20.sid11"]), ["eid20/sid1", "eid20/sid11"]);
    assert_eq!(cover(&["e", "eid20"]), ["e$*/**"]);
    assert_eq!(cover(&["a.", "a:", "a"]), ["a$*/**"]);
    assert_eq!(cover(&["", "a", "eid1"]), ["**"]);
}

#[test]
fn two_topics_to_one_service_do_not_share_an_instance() {
    let instance = Instance::of_number(7);
    let label = |descriptor: &str| {
        let descriptor = Descriptor::new(descriptor).unwrap();
        Label::limitedcast(Address::new("eid1sid2").unwrap(), ContentType::Lmcp, descriptor, source(1, 1))
    };
    let key = |d: &str| keys().envelope(Space::Data, &label(d), Some(&instance));
    assert_ne!(key("a"), key("b"));
    let broadcast = Label::broadcast(ContentType::Lmcp, Name::new("a").unwrap(), source(1, 1));
    assert!(keys().envelope(Space::Data, &broadcast, Some(&instance)).contains(&instance.hash.to_string()));
}

#[test]
fn foreign_keys_are_told_apart() {
    let keys = keys();
    for key in
        ["aldis/red/1/2/-/a", "aldis/blue", "aldis/blue/@link/1/2/-/a", "x/blue/1/2/-/a", "aldis/blue/1/2/-"]
    {
        assert!(matches!(keys.parse(key), Err(KeyError::Foreign(_))), "{key}");
    }
    for key in ["aldis/blue/0/2/-/a", "aldis/blue/1/x/-/a", "aldis/blue/1/2/zz/a", "aldis/blue/01/2/-/a"] {
        assert!(matches!(keys.parse(key), Err(KeyError::Chunk { .. })), "{key}");
    }
    assert_eq!(keys.parse("aldis/blue/@alive/400/2").unwrap().source, source(400, 2));
}

#[test]
fn frames_of_a_link_stand_below_their_sender_and_are_no_envelopes() {
    let id = |number| EntityId::new(number).unwrap();
    let key = keys().link_frames(id(400), id(1), 2);
    assert_eq!(key, "aldis/blue/@link/400/1/2");
    assert_eq!(keys().of_entity("@link", id(400)), "aldis/blue/@link/400/**");
    assert!(matches!(keys().parse(&key), Err(KeyError::Foreign(_))));
}

#[test]
fn an_id_stands_in_chunks_of_one_form() {
    for chunks in
        ["eid400sid37", "eid400.sid37", "eid400sidall", "eid400/sid37/x", "eid400/.sid37", "eid0400"]
    {
        assert!(address_from_chunks(chunks, &Spelling::Dots).is_err(), "{chunks}");
    }
    for chunks in ["eid400/sid37", "eid400/sidall", "eid400"] {
        assert!(address_from_chunks(chunks, &Spelling::Dots).is_ok(), "{chunks}");
    }
}

/// Texts that are hard on the escaping: many separators, halves of separators, wildcards and ids.
fn hard_text() -> impl Strategy<Value = String> {
    let piece = prop_oneof![
        Just(".".to_owned()),
        Just("::".to_owned()),
        Just(":".to_owned()),
        Just("eid".to_owned()),
        Just("sid".to_owned()),
        "[a-zA-Z0-9_@*/%é#? -]{1,3}",
    ];
    proptest::collection::vec(piece, 1..8).prop_map(|pieces| pieces.concat())
}

/// Whether a key expression with `**` at its end and `$*` in a chunk meets a key: Zenoh's rule for the forms used here.
fn intersects(expression: &str, key: &str) -> bool {
    let expression: Vec<_> = expression.split('/').collect();
    let key: Vec<_> = key.split('/').collect();
    for (i, chunk) in expression.iter().enumerate() {
        let Some(got) = key.get(i) else { return *chunk == "**" };
        let meets = match *chunk {
            "**" => return true,
            "*" => true,
            chunk => match chunk.strip_suffix("$*") {
                Some(head) => got.starts_with(head),
                None => chunk == *got,
            },
        };
        if !meets {
            return false;
        }
    }
    key.len() == expression.len()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4096))]

    #[test]
    fn a_key_gives_its_address_back(text in hard_text()) {
        prop_assume!(Address::new(&text).is_ok());
        let address = Address::new(&text).unwrap();
        let key = key_of(&text, Some(&Instance { hash: KeyHash([7; 16]), key: None }));
        prop_assert!(!key.contains("//") && !key.ends_with('/') && !key.contains(['*', '?', '#', '$']));
        let parsed = keys().parse(&key).unwrap();
        prop_assert_eq!(parsed.instance, Some(KeyHash([7; 16])));
        let spelled = escape::spelling(&text);
        prop_assert_eq!(address_from_chunks(parsed.address, &spelled).unwrap(), address);
    }

    #[test]
    fn an_expression_never_misses_what_its_prefix_receives(text in hard_text(), cut in 0usize..24, id in 1u64..30) {
        let at = (0..=text.len()).filter(|&i| text.is_char_boundary(i)).nth(cut).unwrap_or(text.len());
        for (address, prefix) in [
            (text.clone(), text[..at].to_owned()),
            (format!("eid{id}.sid{id}"), format!("eid{}", id / 10 + 1)),
            (format!("eid{id}.sid{id}"), "e".to_owned()),
        ] {
            let (Ok(address), Ok(prefix)) = (Address::new(&address), Prefix::new(&prefix)) else { continue };
            let expression = keys().subscription(Space::Data, &prefix);
            let key = key_of(&address.to_string(), None);
            prop_assert!(!prefix.matches(&address) || intersects(&expression, &key), "{} {}", expression, key);
        }
    }

    #[test]
    fn any_text_as_key_is_read_or_refused(key in "(aldis/blue/)?[0-9@a-f/%.-]{0,60}", spelled in hard_text()) {
        if let Ok(parsed) = keys().parse(&key) {
            let _ = address_from_chunks(parsed.address, &Spelling::Dots);
            let _ = address_from_chunks(parsed.address, &Spelling::Exact(spelled));
        }
    }
}
