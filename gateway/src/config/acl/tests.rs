use super::*;

fn node(text: &str) -> Config {
    Config::parse("", text).unwrap()
}

fn shore() -> Config {
    node("fleet = \"blue\"\nname = \"shore\"\nentities = [1]\noperators = [1, 9000]")
}

fn vehicle() -> Config {
    let bus = "[bus]\nuser = \"v400\"\npassword_file = \"pw\"";
    node(&format!(
        "fleet = \"blue\"\nname = \"vehicle-400\"\nentities = [400, 100]\noperators = [1, 9000]\n{bus}"
    ))
}

fn rule_of<'a>(acl: &'a Value, id: &str) -> &'a Value {
    let rules = acl["access_control"]["rules"].as_array().unwrap();
    rules.iter().find(|rule| rule["id"] == id).unwrap()
}

#[test]
fn a_node_speaks_below_its_own_entities_in_every_plane() {
    let acl = acl(&[shore(), vehicle()]).unwrap();
    let data = rule_of(&acl, "vehicle-400 speaks in data");
    assert_eq!(data["key_exprs"], json!(["aldis/blue/400/**", "aldis/blue/100/**"]));
    assert_eq!(data["messages"], json!(["put", "delete", "reply", "declare_queryable"]));
    assert_eq!(data["flows"], json!(["ingress"]));
    for space in ["@writer", "@state", "@ack", "@link"] {
        let rule = rule_of(&acl, &format!("vehicle-400 speaks in {space}"));
        assert_eq!(rule["key_exprs"][1], format!("aldis/blue/{space}/100/**"));
    }
    let alive = rule_of(&acl, "vehicle-400 speaks in @alive");
    assert_eq!(alive["messages"], json!(["liveliness_token"]));
    assert_eq!(alive["key_exprs"][0], "aldis/blue/@alive/400/**");
}

#[test]
fn every_member_hears_the_whole_fleet() {
    let acl = acl(&[shore()]).unwrap();
    let reads = rule_of(&acl, "blue reads");
    let spaces = ["", "@writer/", "@state/", "@ack/", "@link/", "@alive/"];
    assert_eq!(reads["key_exprs"], json!(spaces.map(|space| format!("aldis/blue/{space}**"))));
    assert_eq!(rule_of(&acl, "blue is told")["messages"].as_array().unwrap().len(), 9);
}

#[test]
fn subjects_are_users_and_certificates() {
    let certificate =
        "[bus.tls]\nenable_mtls = true\nconnect_certificate = \"c\"\nconnect_private_key = \"k\"";
    let third = node(&format!("name = \"vehicle-500\"\nentities = [500]\n{certificate}"));
    let acl = acl(&[shore(), vehicle(), third]).unwrap();
    assert_eq!(
        acl["access_control"]["subjects"],
        json!([
            { "id": "shore", "usernames": ["shore"] },
            { "id": "vehicle-400", "usernames": ["v400"] },
            { "id": "vehicle-500", "cert_common_names": ["vehicle-500"] },
            { "id": "operator 9000", "usernames": ["9000"] },
        ])
    );
    assert_eq!(acl["access_control"]["policies"][3]["rules"][2], "operator 9000 speaks in data");
}

#[test]
fn an_operator_with_a_configuration_of_its_own_is_known_by_that() {
    let console = node("fleet = \"blue\"\nname = \"console\"\nentities = [9000]");
    let acl = acl(&[shore(), console]).unwrap();
    let subjects = acl["access_control"]["subjects"].as_array().unwrap();
    assert_eq!(subjects.len(), 2);
    assert_eq!(subjects[1]["usernames"], json!(["console"]));
}

#[test]
fn nodes_that_cannot_be_told_apart_are_refused() {
    assert_eq!(acl(&[]), Err(AclError::Nobody));
    let twice = |what, text: &str| Err(AclError::Twice { what, text: text.to_owned() });
    assert_eq!(acl(&[shore(), shore()]), twice("name", "shore"));
    assert_eq!(acl(&[vehicle(), node("name = \"v400\"\nentities = [5]")]), twice("user", "v400"));
}

#[test]
fn zenoh_reads_what_is_printed() {
    let printed = acl(&[shore(), vehicle()]).unwrap().to_string();
    let config = zenoh::Config::from_json5(&printed).unwrap();
    let read: Value = serde_json::from_str(&config.get_json("access_control").unwrap()).unwrap();
    assert_eq!(read["default_permission"], "deny");
    assert_eq!(read["rules"].as_array().unwrap().len(), 2 + 3 * 6);
}
