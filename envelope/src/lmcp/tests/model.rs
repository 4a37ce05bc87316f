//! The declarations against the model.

use super::{read, shared};
use crate::lmcp::{Count, Kind, TypeInfo, View, descendants, type_in, type_of, types};

#[test]
fn a_hundred_and_sixty_four_types_are_declared() {
    assert_eq!(types().count(), 164);
}

#[test]
fn no_type_hides_a_field_of_its_parents() {
    for info in types() {
        let mut names: Vec<_> = info.fields().map(|field| field.name).collect();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count, "{info}");
    }
}

#[test]
fn a_subscription_to_a_base_type_means_its_descendants() {
    let state = type_of("afrl.cmasi.EntityState").unwrap();
    let names: Vec<_> = descendants(state).map(|info| info.name).collect();
    let expected = [
        "EntityState",
        "AirVehicleState",
        "RadioTowerState",
        "GroundVehicleState",
        "SurfaceVehicleState",
        "StationarySensorState",
    ];
    assert_eq!(names, expected);
}

#[test]
fn an_undeclared_number_of_an_enumeration_is_kept() {
    use crate::lmcp::cmasi::{AltitudeType, Location3D};
    use crate::lmcp::{decode_as, encode};
    let place = Location3D { altitude_type: AltitudeType(77), ..Location3D::default() };
    let again: Location3D = decode_as(&encode(&place).unwrap()).unwrap();
    assert_eq!(again.altitude_type, AltitudeType(77));
    assert_eq!(format!("{:?}", again.altitude_type), "AltitudeType(77)");
}

/// A field as the model's listing writes it: `Name:kind`, with `[]` or `[n]` for arrays.
fn listed(name: &str, kind: &Kind) -> String {
    let (element, suffix) = match kind {
        Kind::List(element, Count::Fixed(count)) => (*element, format!("[{count}]")),
        Kind::List(element, _) => (*element, "[]".to_owned()),
        _ => (kind, String::new()),
    };
    let element = match element {
        Kind::Object(info) => info.name,
        other => other.name().unwrap(),
    };
    format!("{name}:{element}{suffix}")
}

/// The default of a field as the model's listing writes it after `=`, if it does.
fn listed_default(annotations: &str) -> Option<&str> {
    let start =
        annotations.strip_prefix('=').or_else(|| annotations.split_once(" =").map(|(_, rest)| rest))?;
    start.split([' ', '}']).next()
}

fn assert_default(info: &'static TypeInfo, field: &str, default: &str) {
    let object = (info.default)();
    let matches = match object.view(field).unwrap() {
        View::Bool(value) => value.to_string() == default,
        View::Byte(value) => Ok(value) == default.parse(),
        View::Int64(value) => Ok(value) == default.parse(),
        View::Real32(value) => Ok(value) == default.parse(),
        View::Enum(value, names) => names.name_of(value) == Some(default),
        View::Text(value) => value == default,
        View::Object(value) => value.is_none() && default == "null",
        View::List(list) => list.length() == 0,
        other => panic!("{info}.{field}: {other:?}"),
    };
    assert!(matches, "{info}.{field} = {default}");
}

fn check_type(series: &str, line: &str) {
    let (head, fields) = line.split_once(" — ").unwrap();
    let (name, head) = head.split_once("** id=").unwrap();
    let (id, parent) = head.split_once(" : ").map_or((head, None), |(id, parent)| (id, Some(parent)));
    let info = type_in(series, name).unwrap_or_else(|| panic!("{series} {name}"));
    assert_eq!(info.id.to_string(), id, "{info}");
    assert_eq!(info.parent.map(|it| it.name), parent.map(|it| it.rsplit('/').next().unwrap()), "{info}");
    let declared: Vec<_> = info.own_fields.iter().map(|field| listed(field.name, &field.kind)).collect();
    let mut expected = Vec::new();
    for field in fields.split("; ").filter(|field| !field.starts_with('(')) {
        let (plain, annotations) = field.trim().split_once('{').unwrap_or((field.trim(), ""));
        let (name, kind) = plain.split_once(':').unwrap();
        expected.push(format!("{name}:{}", kind.rsplit('/').next().unwrap()));
        if let Some(default) = listed_default(annotations) {
            assert_default(info, name, default);
        }
        let large = matches!(info.field(name).unwrap().kind, Kind::List(_, Count::U32));
        assert_eq!(large, annotations.contains("LargeArray"), "{info}.{name}");
    }
    assert_eq!(declared, expected, "{info}");
}

#[test]
fn declarations_equal_the_listing_of_the_model() {
    let Some(path) = shared("messages.txt") else { return };
    let listing = String::from_utf8(read(&path)).unwrap();
    let mut series = "";
    let mut checked = 0;
    for line in listing.lines() {
        if line.starts_with("### ") {
            series = line.split('`').nth(1).unwrap();
            let namespace = line.split('`').nth(3).unwrap().replace('/', ".");
            let version = line.rsplit(' ').next().unwrap();
            let declared = types().find(|info| info.series.text == series).unwrap().series;
            assert_eq!(
                (declared.namespace, declared.version.to_string().as_str()),
                (namespace.as_str(), version)
            );
        } else if let Some(line) = line.strip_prefix("- **") {
            check_type(series, line);
            checked += 1;
        }
    }
    assert_eq!(checked, 164);
}
