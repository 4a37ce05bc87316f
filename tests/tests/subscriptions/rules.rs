//! The rules of spec uxas-wire, written a second time and in another way: on texts, with nothing of the product.

/// The prefixes that every matcher must get right, with what each must and must not receive.
pub(crate) const TABLE: [(&str, &[&str], &[&str]); 9] = [
    (
        "afrl.cmasi",
        &["afrl.cmasi", "afrl.cmasi.Circle", "afrl.cmasix.Y"],
        &["afrl.cmas", "afrl::cmasi::Circle"],
    ),
    ("afrl.cmasi.", &["afrl.cmasi.Circle", "afrl.cmasi."], &["afrl.cmasi:", "afrl.cmasiCircle"]),
    (
        "afrl.cmasi.AirVehicle",
        &["afrl.cmasi.AirVehicleState", "afrl.cmasi.AirVehicleConfiguration", "afrl.cmasi.AirVehicle"],
        &["afrl.cmasi.AirVehicl", "afrl.cmasi.airvehicleState", "afrl.cmasi::AirVehicleState"],
    ),
    ("UMAA::", &["UMAA::SO::LogReport::LogReport", "UMAA::"], &["UMAA", "UMAA:", "UMAA.SO", "UMAA.::SO"]),
    ("UMAA::SO::Health", &["UMAA::SO::HealthReport::HealthReport"], &["UMAA::SO.HealthReport", "UMAA::SO"]),
    (
        "eid200",
        &["eid200", "eid200.sid5", "eid200sid50", "eid200.sidall"],
        &["eid2", "eid20", "eid2000", "eid2000.sid5", "eid2000sidall"],
    ),
    (
        "eid200.sid5",
        &["eid200.sid5", "eid200sid5"],
        &["eid200.sid50", "eid200sidall", "eid200", "eid2000sid5"],
    ),
    ("Aircraft", &["AircraftPathPlanner", "Aircraft"], &["aircraft", "GroundPathPlanner", "Aircraf"]),
    ("", &["x", ".", "::", "eid1", "eid200.sid5", "@a/b"], &[]),
];

/// Whether a text begins as only ids may.
pub(crate) fn is_id(text: &str) -> bool {
    text.strip_prefix("eid").is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
}

/// Whether what is sent to an address comes to who subscribed to a prefix; both are valid.
pub(crate) fn receives(prefix: &str, address: &str) -> bool {
    let plain = |text: &str| text.replace(".sid", "sid");
    match (is_id(prefix), is_id(address)) {
        // An id is matched whole, and an entity's with all that it has.
        (true, true) => {
            let (prefix, address) = (plain(prefix), plain(address));
            let rest = address.strip_prefix(&prefix);
            rest.is_some_and(|rest| rest.is_empty() || (!prefix.contains("sid") && rest.starts_with("sid")))
        }
        (true, false) => false,
        // Everything else as text, an id in the spelling with a dot.
        (false, true) => plain(address).replace("sid", ".sid").starts_with(prefix),
        (false, false) => address.starts_with(prefix),
    }
}
