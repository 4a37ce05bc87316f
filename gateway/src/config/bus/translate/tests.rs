use super::*;
use crate::config::Config;

fn bus(lines: &str) -> Bus {
    Config::parse("", &format!("name = \"a\"\nentities = [1]\n[bus]\n{lines}")).unwrap().bus
}

fn get(config: &zenoh::Config, key: &str) -> Value {
    serde_json::from_str(&config.get_json(key).unwrap()).unwrap()
}

/// A directory of this test's own, removed at its end.
struct Directory(PathBuf);

impl Directory {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("aldis-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn file(&self, name: &str, text: &str) -> PathBuf {
        std::fs::write(self.0.join(name), text).unwrap();
        self.0.join(name)
    }
}

impl Drop for Directory {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn by_default_no_port_and_no_door_is_open() {
    let config = zenoh_config(&Bus::default()).unwrap();
    assert_eq!(get(&config, "mode"), "peer");
    assert_eq!(get(&config, "listen/endpoints"), json!([]));
    for key in [
        "scouting/multicast/enabled",
        "scouting/gossip/enabled",
        "adminspace/enabled",
        "timestamping/enabled",
        "access_control/enabled",
    ] {
        assert_eq!(get(&config, key), false, "{key}");
    }
}

#[test]
fn an_absent_peer_never_fails_a_start_and_a_port_in_use_always_does() {
    for (mode, timeout_ms, exit) in [("peer", -1, false), ("router", -1, false), ("client", 0, true)] {
        let bus = bus(&format!("mode = \"{mode}\"\nconnect = [\"tcp/127.0.0.1:7447\", \"tls/shore:7448\"]"));
        let config = zenoh_config(&bus).unwrap();
        assert_eq!(get(&config, "connect/endpoints"), json!(["tcp/127.0.0.1:7447", "tls/shore:7448"]));
        assert_eq!(get(&config, "connect/timeout_ms"), timeout_ms, "{mode}");
        assert_eq!(get(&config, "connect/exit_on_failure"), exit, "{mode}");
        assert_eq!(get(&config, "listen/exit_on_failure"), true, "{mode}");
    }
}

#[test]
fn scouting_is_what_was_asked_for() {
    for (word, multicast, gossip) in
        [("none", false, false), ("gossip", false, true), ("multicast", true, true)]
    {
        let config = zenoh_config(&bus(&format!("scouting = \"{word}\""))).unwrap();
        assert_eq!(get(&config, "scouting/multicast/enabled"), multicast, "{word}");
        assert_eq!(get(&config, "scouting/gossip/enabled"), gossip, "{word}");
    }
}

#[test]
fn the_password_comes_from_its_file_without_the_line_break() {
    let directory = Directory::new("password");
    let mut bus = bus("user = \"v400\"\npassword_file = \"pw\"");
    bus.resolve(&directory.0);
    assert!(matches!(zenoh_config(&bus), Err(BusError::Unreadable { key: "password_file", .. })));
    directory.file("pw", "\n");
    assert!(matches!(zenoh_config(&bus), Err(BusError::Unusable { key: "password_file", .. })));
    directory.file("pw", "secret\n");
    assert_eq!(password(&bus).unwrap().as_deref(), Some("secret"));
    assert_eq!(get(&zenoh_config(&bus).unwrap(), "transport/auth/usrpwd")["user"], "v400");
}

#[test]
fn an_empty_list_of_users_is_refused_because_zenoh_takes_it_for_none() {
    let directory = Directory::new("users");
    let mut bus = bus("listen = [\"tcp/127.0.0.1:0\"]\ndictionary_file = \"users\"");
    bus.resolve(&directory.0);
    for text in ["", "\n\n", "v400\n", "v400:\n", ":secret\n"] {
        directory.file("users", text);
        assert!(matches!(zenoh_config(&bus), Err(BusError::Unusable { .. })), "{text:?}");
    }
    let users = directory.file("users", "v400:secret\nshore:other\n");
    let config = zenoh_config(&bus).unwrap();
    assert_eq!(get(&config, "transport/auth/usrpwd")["dictionary_file"], json!(users));
}

#[test]
fn certificates_are_passed_on() {
    let config =
        zenoh_config(&bus("[bus.tls]\nenable_mtls = true\nconnect_certificate = \"c.pem\"")).unwrap();
    let tls = get(&config, "transport/link/tls");
    assert_eq!(tls["enable_mtls"], true);
    assert_eq!(tls["verify_name_on_connect"], true);
    assert_eq!(tls["connect_certificate"], "c.pem");
}

#[test]
fn of_a_zenoh_file_only_the_access_control_is_used() {
    let directory = Directory::new("access");
    let mut bus = bus("zenoh_config = \"router.json5\"");
    bus.resolve(&directory.0);
    directory.file("router.json5", "{ mode: 'client' }");
    assert!(zenoh_config(&bus).unwrap_err().to_string().contains("aldis acl"));
    directory.file("router.json5", "{ mode: ");
    assert!(zenoh_config(&bus).unwrap_err().to_string().contains("not a Zenoh configuration"));
    let text = "{ mode: 'client', access_control: { enabled: true, rules: [], subjects: [], policies: [] } }";
    directory.file("router.json5", text);
    let config = zenoh_config(&bus).unwrap();
    assert_eq!(get(&config, "mode"), "peer");
    assert_eq!(get(&config, "access_control/enabled"), true);
    assert_eq!(get(&config, "access_control/default_permission"), "deny");
}
