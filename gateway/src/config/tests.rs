//! Every kind of mistake, as it is told and drawn; and what a good configuration becomes.

use super::*;
use miette::{GraphicalReportHandler, GraphicalTheme};

/// A configuration without a mistake, to which tests add one.
const TOP: &str = "name = \"vehicle-400\"\nentities = [400, 100]\n";
/// A bridge that lacks only its address; the next line is number 7.
const BRIDGE: &str = "[[bridge]]\nkind = \"uxas-tcp\"\nname = \"uxas\"\nservice = 20\n";
const LISTEN: &str = "listen = \"127.0.0.1:5556\"\n";
const TRACK: &str = "[[service]]\nkind = \"track\"\nlatitude_deg = 59\nlongitude_deg = 18.5\n";

fn mistakes(text: &str) -> ConfigError {
    Config::parse("node.toml", text).unwrap_err()
}

/// A mistake as the command line draws it.
fn drawn(error: &ConfigError) -> String {
    let mut out = String::new();
    let handler = GraphicalReportHandler::new_themed(GraphicalTheme::unicode_nocolor()).with_width(120);
    handler.render_report(&mut out, error).unwrap();
    out.lines().map(str::trim_end).collect::<Vec<_>>().join("\n")
}

/// Asserts where a mistake is, and parts of what is told and of the cure.
#[track_caller]
fn assert_mistake(text: &str, at: (usize, usize), message: &str, cure: &str) {
    let error = mistakes(text);
    let drawn = drawn(&error);
    assert_eq!(error.position(), Some(at), "\n{drawn}");
    assert!(error.message().contains(message) && error.cure().contains(cure), "\n{drawn}");
    assert!(drawn.contains(&format!("[node.toml:{}:{}]", at.0, at.1)), "\n{drawn}");
}

#[test]
fn a_mistake_shows_file_line_column_snippet_and_cure() {
    let error = mistakes(&format!("{TOP}{BRIDGE}{LISTEN}dialekt = \"slides\"\n"));
    let expected = "  × unknown field `dialekt`, expected one of `name`, `service`, `listen`, `connect`, `dialect`, `import`, `export`,
  │ `message_bytes_max`, `queue_messages_max`, `stall_timeout_ms`, `peer`, `self_generated`
   ╭─[node.toml:8:1]
 7 │ listen = \"127.0.0.1:5556\"
 8 │ dialekt = \"slides\"
   · ───────
   ╰────
  help: did you mean `dialect`?";
    assert_eq!(drawn(&error), expected);
}

#[test]
fn syntax() {
    assert_mistake(
        "name = \"a\nentities = [1]",
        (1, 10),
        "invalid basic string",
        "close the text with a quote",
    );
    assert_mistake("name = a\nentities = [1]", (1, 8), "must be quoted", "put the text in quotes");
    assert_mistake("name = \"a\"\nentities = [1\n[bus]\n", (3, 1), "missing comma", "close the list");
    assert_mistake("name = \"a\"\nname = \"b\"\n", (2, 1), "duplicate key", "keep one");
}

#[test]
fn keys_that_are_unknown_or_missing() {
    assert_mistake(
        "name = \"a\"\nentitys = [1]",
        (2, 1),
        "unknown field `entitys`",
        "did you mean `entities`?",
    );
    assert_mistake(&format!("{TOP}[bus]\nconect = []"), (4, 1), "`conect`", "did you mean `connect`?");
    assert_mistake("entities = [1]", (1, 1), "missing field `name`", "add `name = …` here");
    assert_mistake(
        &format!("{TOP}[[bridge]]\nkind = \"uxas-tcp\"\n"),
        (3, 1),
        "missing field `name`",
        "add `name",
    );
    assert_mistake(&format!("{TOP}[[bridge]]\nname = \"a\""), (3, 1), "has no `kind`", "kind = \"uxas-tcp\"");
    assert_mistake(&format!("{TOP}[[service]]\nservice = 100"), (3, 1), "has no `kind`", "kind = \"track\"");
}

#[test]
fn values_of_the_wrong_type() {
    assert_mistake("name = 5\nentities = [1]", (1, 8), "expected a string", "in quotes");
    assert_mistake("name = \"a\"\nentities = 1", (2, 12), "expected a sequence", "in `[ ]`");
    let period = format!("{TOP}[health]\nreport_period_ms = \"5 s\"");
    assert_mistake(&period, (4, 20), "expected a whole number", "without quotes");
    let stall = format!("{TOP}{BRIDGE}{LISTEN}stall_timeout_ms = 1.5");
    assert_mistake(&stall, (8, 20), "expected a whole number", "without a point");
    assert_mistake(
        &format!("{TOP}[bus.tls]\nenable_mtls = \"yes\""),
        (4, 15),
        "expected a boolean",
        "`true` or `false`",
    );
    assert_mistake(&format!("{TOP}[bridge]\nname = \"a\""), (3, 1), "map, expected a sequence", "[[bridge]]");
    assert_mistake(&format!("{TOP}bridge = [5]"), (3, 11), "not a table", "kind = \"uxas-tcp\"");
    assert_mistake(
        &format!("{TOP}[[bridge]]\nkind = 5"),
        (4, 8),
        "`kind` is not a text",
        "kind = \"uxas-tcp\"",
    );
}

#[test]
fn values_that_are_invalid() {
    assert_mistake("name = \"a b\"\nentities = [1]", (1, 8), "`a b` is not a name", "1 to 64 letters");
    assert_mistake(
        &format!("fleet = \"b/c\"\n{TOP}"),
        (1, 9),
        "not a fleet name",
        "such as `fleet = \"blue\"`",
    );
    assert_mistake("name = \"a\"\nentities = []", (2, 12), "`entities` is empty", "entities = [400]");
    assert_mistake("name = \"a\"\nentities = [0]", (2, 12), "entity id 0", "1 to 281474976710655");
    assert_mistake("name = \"a\"\nentities = [-1]", (2, 13), "integer `-1`", "negative or too large");
    let import = format!("{TOP}[routing]\nimport = [\"afrl.\", \"eid4x\"]");
    assert_mistake(&import, (4, 20), "`eid4x` begins like an entity id", "write `eid4`");
    let export = format!("{TOP}{BRIDGE}{LISTEN}export = [\n  \"a|b\",\n]");
    assert_mistake(&export, (9, 3), "holds `|`", "leave `$` and `|` out");
    assert_mistake(
        &format!("{TOP}{BRIDGE}listen = \"localhost:5\""),
        (7, 10),
        "socket address",
        "IP address",
    );
    assert_mistake(&format!("{TOP}{BRIDGE}connect = \"127.0.0.1:0\""), (7, 11), "port 0", "give the port");
    let dialect = format!("{TOP}{BRIDGE}{LISTEN}dialect = \"slide\"");
    assert_mistake(&dialect, (8, 11), "unknown variant `slide`", "did you mean `slides`?");
    assert_mistake(
        &format!("{TOP}[[bridge]]\nkind = \"uxas-tpc\""),
        (4, 8),
        "kind `uxas-tpc`",
        "mean \"uxas-tcp\"?",
    );
    assert_mistake(&format!("{TOP}[[service]]\nkind = \"x\""), (4, 8), "unknown kind `x`", "there is: track");
}

#[test]
fn values_that_are_out_of_range() {
    let bridge = BRIDGE.replace("20", "19");
    assert_mistake(&format!("{TOP}{bridge}{LISTEN}"), (6, 11), "service 19 is not a bridge's", "20 to 99");
    assert_mistake(
        &format!("{TOP}{}{LISTEN}", BRIDGE.replace("20", "100")),
        (6, 11),
        "service 100",
        "20 to 99",
    );
    for (limit, cure) in [
        ("message_bytes_max = 0", "give 1024 to 1073741824 bytes"),
        ("queue_messages_max = 0", "give 1 to 1000000 messages"),
        ("stall_timeout_ms = 1", "give 10 to 600000 milliseconds"),
    ] {
        let column = limit.find('=').unwrap() + 3;
        assert_mistake(&format!("{TOP}{BRIDGE}{LISTEN}{limit}"), (8, column), "out of range", cure);
    }
    let health = format!("{TOP}[health]\nreport_period_ms = 1");
    assert_mistake(&health, (4, 20), "out of range", "give 100 to 3600000 milliseconds");
    assert_mistake(&format!("{TOP}{TRACK}service = 99"), (7, 11), "service 99", "give 100 or more");
    let track = format!("{TOP}{}service = 100", TRACK.replace("59", "91"));
    assert_mistake(&track, (5, 16), "`latitude_deg` = 91", "-90 to 90 degrees");
    assert_mistake(&format!("{TOP}{TRACK}service = 100\nrate_hz = nan"), (8, 11), "NaN", "reports a second");
}

#[test]
fn duplicates() {
    assert_mistake("name = \"a\"\nentities = [1, 1]", (2, 12), "names entity 1 twice", "leave one");
    assert_mistake(
        &format!("{TOP}operators = [1, 9, 9]"),
        (3, 13),
        "`operators` names entity 9 twice",
        "leave one",
    );
    let second = |name: &str, service: u32, port: u32| {
        let other = BRIDGE.replace("uxas\"", &format!("{name}\"")).replace("20", &service.to_string());
        format!("{TOP}{BRIDGE}{LISTEN}{other}listen = \"127.0.0.1:{port}\"")
    };
    assert!(Config::parse("", &second("b", 21, 1)).is_ok());
    assert_mistake(
        &second("uxas", 21, 1),
        (10, 8),
        "two bridges have the name `uxas`",
        "bridge 1 has it too",
    );
    assert_mistake(&second("b", 20, 1), (11, 11), "two bridges have service 20", "`uxas` has it too");
    assert_mistake(&second("b", 21, 5556), (12, 10), "two bridges listen", "another port");
    let track = format!("{TRACK}service = 100\n");
    assert_mistake(
        &format!("{TOP}{track}{track}"),
        (12, 11),
        "entity 400 has service 100 twice",
        "another id",
    );
    assert!(Config::parse("", &format!("{TOP}{track}{track}entity = 100")).is_ok());
}

#[test]
fn values_that_contradict_each_other() {
    assert_mistake(&format!("{TOP}{BRIDGE}"), (3, 1), "neither `listen` nor `connect`", "add `listen");
    let both = format!("{TOP}{BRIDGE}{LISTEN}connect = \"127.0.0.1:1\"");
    assert_mistake(&both, (8, 11), "both `listen` and `connect`", "keep one");
    let track = format!("{TOP}{TRACK}service = 100\nentity = 7");
    assert_mistake(&track, (8, 10), "does not speak for entity 7", "add 7 to `entities`");
    let bus = |lines: &str| format!("{TOP}[bus]\n{lines}");
    assert_mistake(&bus("mode = \"client\""), (4, 8), "nothing to connect to", "add connect");
    assert_mistake(&bus("user = \"a\""), (4, 8), "has no password", "add password_file");
    assert_mistake(&bus("password_file = \"a\""), (4, 17), "without a user", "add user");
    assert_mistake(&bus("dictionary_file = \"a\""), (4, 19), "nobody can join", "add listen");
    assert_mistake(
        &bus("listen = [\"tls/a:1\"]\ntls.listen_private_key = \"k\""),
        (4, 10),
        "without `listen_cert",
        "add",
    );
    let client = bus("mode = \"client\"\nconnect = [\"tcp/a:1\"]\nlisten = [\"tcp/a:1\"]");
    assert_mistake(&client, (6, 10), "a client does not listen", "leave `listen` out");
}

#[test]
fn rules_of_allow() {
    let rule = |from: &str, service: &str| format!("{TOP}[[allow]]\nfrom = {from}\nservice = {service}\n");
    assert_mistake(&rule("\"me\"", "1"), (4, 8), "`me` names no callers", "from = \"any\"");
    assert_mistake(&rule("5", "1"), (4, 8), "expected \"any\" or a list of entities", "from = [1, 9000]");
    assert_mistake(&rule("[1, \"x\"]", "1"), (4, 12), "expected a whole number", "without quotes");
    assert_mistake(&rule("\"any\"", "0"), (5, 11), "service id 0", "1 to 4294967295");
    assert_mistake(&rule("\"any\"", "-1"), (5, 11), "`-1` is no service id", "service = 37");
    let text = format!("{}requests = [\"aldis.\"]\n", rule("[1, 9000]", "37"));
    let config = Config::parse("", &text).unwrap();
    let rule = config.allow[0].rule();
    assert_eq!(rule.from.unwrap().iter().map(|e| e.get()).collect::<Vec<_>>(), [1, 9000]);
    assert_eq!((rule.service.unwrap().get(), rule.requests), (37, vec!["aldis.".to_owned()]));
    let any = Config::parse("", &format!("{TOP}[[allow]]\nfrom = \"any\"\nservice = \"any\"")).unwrap();
    let rule = any.allow[0].rule();
    assert_eq!((rule.from, rule.service, rule.requests), (None, None, vec![String::new()]));
}

#[test]
fn all_mistakes_of_one_kind_are_told_at_once() {
    let error = mistakes(&format!("{TOP}{BRIDGE}[bus]\nuser = \"a\"\n{TRACK}service = 5"));
    assert_eq!(error.more().len(), 2, "{}", drawn(&error));
    assert!(drawn(&error).contains("[node.toml:8:8]"));
}

#[test]
fn an_unreadable_file_is_named() {
    let error = Config::load(Path::new("no/such.toml")).unwrap_err();
    assert_eq!(error.position(), None);
    assert!(error.message().starts_with("cannot read the configuration `no/such.toml`: "));
    assert!(drawn(&error).contains("help: give the path of a readable configuration"));
}

#[test]
fn defaults() {
    let config = Config::parse("", &format!("{TOP}{BRIDGE}{LISTEN}{TRACK}service = 100")).unwrap();
    assert_eq!(config.fleet.as_str(), "fleet");
    assert_eq!(config.entities.own().get(), 400);
    assert_eq!(config.bus, Bus::default());
    assert_eq!(config.routing.import, [Prefix::all()]);
    assert_eq!(config.health.report_period(), Duration::from_secs(5));
    assert_eq!((config.log.level, config.log.format), (Level::Info, LogFormat::Text));
    let Bridge::UxasTcp(tcp) = &config.bridges[0] else { panic!("{:?}", config.bridges) };
    assert_eq!(tcp.endpoint, Endpoint::Listen("127.0.0.1:5556".parse().unwrap()));
    let bridge = &tcp.common;
    assert_eq!((bridge.message_bytes_max, bridge.queue_messages_max), (16 << 20, 8192));
    assert_eq!(bridge.stall_timeout(), Duration::from_secs(5));
    assert_eq!((&bridge.import, &bridge.export), (&vec![Prefix::all()], &vec![Prefix::all()]));
    let Service::Track(track) = &config.services[0] else { panic!("a track was written") };
    assert_eq!((track.heading_deg, track.speed_m_per_s, track.rate_hz), (0.0, 0.0, 1.0));
    assert_eq!(track.source(config.entities.own()).to_string(), "eid400sid100");
    assert_eq!(track.motion(config.entities.own()).latitude_deg, 59.0);
}

#[test]
fn a_configuration_survives_being_written_and_read() {
    let text = format!(
        "{TOP}operators = [1]\n{BRIDGE}{LISTEN}{TRACK}service = 100\n[[allow]]\nfrom = \"any\"\nservice = 20"
    );
    let config = Config::parse("", &text).unwrap();
    let json = serde_json::to_string(&config).unwrap();
    assert_eq!(serde_json::from_str::<Config>(&json).unwrap(), config);
}

#[test]
fn every_example_loads() {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
    let mut names = Vec::new();
    for entry in std::fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "toml") {
            names.push(Config::load(&path).unwrap_or_else(|e| panic!("\n{}", drawn(&e))));
        }
    }
    assert!(names.len() >= 3);
    assert!(acl(&names).is_ok());
}

#[test]
fn the_example_of_a_link_loads_and_its_ends_belong_together() {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/link");
    let [shore, vehicle] = ["shore.toml", "vehicle-401.toml"]
        .map(|name| Config::load(&directory.join(name)).unwrap_or_else(|e| panic!("\n{}", drawn(&e))));
    for (one, other) in [(&shore, &vehicle), (&vehicle, &shore)] {
        let link = &one.links[0];
        assert_eq!(link.peer, other.entities.own());
        assert!(link.behind().contains(&other.entities.own()) && one.journal.is_some());
        assert_eq!(link.carriers[0].rate_bytes_per_s, other.links[0].carriers[0].rate_bytes_per_s);
    }
}

#[test]
fn files_are_looked_for_beside_the_configuration() {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs");
    let config = Config::load(&directory.join("router.toml")).unwrap();
    assert_eq!(config.bus.dictionary_file, Some(directory.join("router-users.txt")));
}

#[test]
fn core_services_are_named_with_their_keys_and_checked() {
    let core = "[[service]]\nkind = \"waypoint-plan-manager\"\nservice = 110\nnumber_waypoints_to_serve = 15\n\
                [[service]]\nkind = \"assignment-tree-branch-bound\"\nservice = 111\ncost_function = \"CUMULATIVE\"\n\
                [[service]]\nkind = \"task-manager\"\nservice = 112\noptions = [{ task_id = 7, name = \"a\", value = \"b\" }]\n\
                [[service]]\nkind = \"waypoint-plan-manager\"\nservice = 113\nresource = \"autopilot\"\ncontrol_s = 20\n\
                [[service]]\nkind = \"simulated-vehicle\"\nservice = 114\nresource = \"autopilot\"\n";
    let config = Config::parse("", &format!("{TOP}{core}")).unwrap();
    let cores: Vec<_> =
        config.services.iter().map(|one| one.core().unwrap().core(config.entities.own())).collect();
    assert_eq!(cores[0].name(), "WaypointPlanManager");
    assert!(
        format!("{:?}", cores[0]).contains("vehicle: 400, number_waypoints_to_serve: 15"),
        "{:?}",
        cores[0]
    );
    assert!(format!("{:?}", cores[1]).contains("Cumulative"));
    let under = format!("{:?}", cores[3]);
    assert!(
        under.contains("ControlledWaypoints") && under.contains("\"autopilot\", duration: 20s"),
        "{under}"
    );
    assert!(format!("{:?}", cores[4]).contains("GuardedKinematic"));
    assert_eq!(config.services[2].service().get(), 112);
    for (table, what) in [
        ("[[service]]\nkind = \"plan-builder\"\n", "has no `service`"),
        ("[[service]]\nkind = \"plan-builder\"\nservice = 7\n", "is not for a configuration"),
        ("[[service]]\nkind = \"plan-bilder\"\nservice = 107\n", "unknown kind"),
        ("[[service]]\nkind = \"plan-builder\"\nservice = 107\nturn = 1\n", "turn"),
    ] {
        let error = Config::parse("", &format!("{TOP}{table}")).unwrap_err();
        assert!(drawn(&error).contains(what), "{}", drawn(&error));
    }
}
