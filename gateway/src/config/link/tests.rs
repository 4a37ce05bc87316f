use crate::config::Config;
use aldis_services::link::{CarrierId, Class};

const TOP: &str = "name = \"a\"\nentities = [1]\n[[link]]\nname = \"boat\"\npeer = 400\n";
const CARRIER: &str =
    "[[link.carrier]]\nkind = \"udp\"\nlisten = \"0.0.0.0:7500\"\nrate_bytes_per_s = 1200\n";

#[test]
fn a_link_says_what_crosses_and_by_what() {
    let rule = "[[link.rule]]\ndescriptor = \"UMAA\"\nclass = \"state\"\nrate_hz = 2\nlifespan_s = 5\n";
    let config = Config::parse("", &format!("{TOP}{CARRIER}{rule}")).unwrap();
    let spec = config.links[0].spec(config.entities.own());
    assert_eq!((spec.link.peer.get(), spec.export.behind.len()), (400, 1));
    assert_eq!((spec.link.carriers[0].id, spec.link.carriers[0].rate), (CarrierId(0), 1_200));
    let rule = &spec.export.rules[0];
    assert_eq!((rule.class, rule.interval.as_millis()), (Class::State, 500));
}

#[test]
fn what_contradicts_itself_is_told_with_a_cure() {
    let mistake = |text: &str| {
        let error = Config::parse("", text).unwrap_err();
        format!("{} / {}", error.message(), error.cure())
    };
    for (text, said) in [
        (TOP.to_owned(), "missing field `carrier`"),
        (format!("{TOP}carrier = []\n"), "no carrier"),
        (format!("{}{CARRIER}", TOP.replace("400", "1")), "this side of the link"),
        (format!("{TOP}{CARRIER}mtu = 64\n"), "128 to 65000"),
        (format!("{TOP}{CARRIER}device = \"/dev/null\"\n"), "fields of another kind"),
        (format!("{TOP}{}", CARRIER.replace("listen", "peer")), "add listen"),
        (format!("{TOP}{CARRIER}[[link.rule]]\nclass = \"states\"\n"), "did you mean"),
        (format!("{TOP}{CARRIER}[[link.rule]]\nclass = \"state\"\nrate_hz = 0\n"), "samples a second"),
        (
            format!(
                "{TOP}{CARRIER}{}",
                TOP.split_once("[[").map(|(_, rest)| format!("[[{rest}{CARRIER}")).unwrap()
            ),
            "two links",
        ),
    ] {
        let told = mistake(&text);
        assert!(told.contains(said), "{said}: {told}");
    }
}
