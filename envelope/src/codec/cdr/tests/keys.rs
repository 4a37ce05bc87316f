use super::*;
use crate::{KeyHash, KeyWidth};

fn schema(extensibility: Extensibility) -> Schema {
    let id = vec![Member::new(0, "id", Type::named("Guid")), Member::new(1, "parentID", Type::named("Guid"))];
    let members = vec![
        Member::new(0, "text", Type::String { bound: None }),
        Member::new(9, "late", Type::Int64).key(),
        Member::new(2, "source", Type::named("Id")).key(),
        Member::new(3, "other", Type::named("Id")),
        Member::new(4, "short", Type::Octet).key(),
    ];
    let definitions = [
        ("Guid", Definition::Alias(Type::array(Type::Octet, 16))),
        ("Id", structure(extensibility, id)),
        ("Top", structure(extensibility, members)),
    ];
    Schema::new(&library(definitions), "Top").unwrap()
}

fn top(text: &str) -> Value {
    let id = |from: u8| {
        let guid = |octet| Some(Value::Octets(vec![octet; 16]));
        Some(Value::Structure(vec![guid(from), guid(from + 1)]))
    };
    let late = Some(Value::Signed(0x0102_0304_0506_0708));
    Value::Structure(vec![Some(Value::Text(text.to_owned())), late, id(1), id(8), Some(Value::Unsigned(5))])
}

#[test]
fn a_key_is_the_same_from_a_sample_and_from_its_key_alone() {
    let expected = [&[1; 16][..], &[2; 16], &[5, 0, 0, 0], &[1, 2, 3, 4, 5, 6, 7, 8]].concat();
    for (extensibility, representations) in
        [(Extensibility::Final, [XCDR1, BIG, PLAIN]), (Extensibility::Appendable, [XCDR1, BIG, DELIMITED])]
    {
        let schema = schema(extensibility);
        let keys = KeySchema::new(&schema).unwrap();
        for representation in representations {
            let sample = schema.write(&top("any"), representation).unwrap();
            let instance = keys.of_sample(&schema, &sample).unwrap();
            assert_eq!(instance.key.as_deref(), Some(&expected[..]));
            assert_eq!(instance.hash, KeyHash::md5(&[&expected]));
            let alone = keys.key_sample(&expected, representation).unwrap();
            assert!(alone.len() < sample.len());
            assert_eq!(keys.of_key_sample(&alone).unwrap(), instance);
            let partial = keys.partial(&schema, &expected).unwrap();
            assert_eq!(keys.of_value(&schema, &partial).unwrap(), instance);
            let Value::Structure(members) = partial else { panic!() };
            assert_eq!((&members[0], &members[3]), (&None, &None), "what is no key is absent");
        }
        let shown = keys.json(&expected).unwrap();
        assert_eq!((&shown["late"], &shown["short"]), (&json!(0x0102_0304_0506_0708_i64), &json!(5)));
        assert!(keys.json(&expected[1..]).is_err() && keys.json(&[&expected[..], &[0]].concat()).is_err());
    }
}

#[test]
fn a_short_key_is_its_own_hash() {
    let members = vec![Member::new(0, "n", Type::Int32), Member::new(1, "k", Type::UInt16).key()];
    let library = library([("T", structure(Extensibility::Final, members))]);
    let schema = Schema::new(&library, "T").unwrap();
    assert_eq!(schema.key_width(), KeyWidth::Fits16);
    let value = Value::Structure(vec![Some(Value::Signed(1)), Some(Value::Unsigned(0x1234))]);
    let keys = KeySchema::new(&schema).unwrap();
    let instance = keys.of_value(&schema, &value).unwrap();
    assert_eq!(keys.of_hash(instance.hash), Some(instance.clone()));
    assert_eq!(keys.of_hash(KeyHash([1; 16])), None, "what fills a hash up is zero");
    assert_eq!(instance.hash.to_string(), "12340000000000000000000000000000");
}

#[test]
fn a_type_without_a_key_has_none() {
    let library = library([("T", structure(Extensibility::Final, vec![Member::new(0, "n", Type::Int32)]))]);
    assert!(KeySchema::new(&Schema::new(&library, "T").unwrap()).is_none());
}

/// What Cyclone DDS 11.0.1 sent when it wrote and disposed a health report of each version: the sample, the key alone, and the key
/// hash beside both.
#[test]
fn keys_and_hashes_are_those_that_cyclone_sends() {
    let ones = "01".repeat(16);
    let body =
        "0c000000 0100000000000000 02000000 04000000 03000000 6f6b0000 0c000000 0300000000000000 04000000";
    let other = "02020202010101010101010101010101";
    let older = format!("00090000 50000000 08000000 {body} {ones} {other}");
    let identifier = format!("20000000 {ones} {ones}");
    let newer = format!(
        "00090000 7c000000 0c000000 0100000000000000 02000000 04000000 01000000 03000000 6f6b0000 \
         0c000000 0300000000000000 04000000 {identifier} 08000000 {identifier}"
    );
    let cases = [
        (
            crate::umaa::v5_2_1::library(),
            older,
            format!("00090000 20000000 {ones} {other}"),
            "2b7560ee5f0c2241e82008dc31c2bacf",
        ),
        (
            crate::umaa::v6_0::library(),
            newer,
            format!("00090000 4c000000 {identifier} 08000000 {identifier}"),
            "d4c325aafa70f675295cb3f0f87353b9",
        ),
    ];
    for (library, sample, alone, hash) in cases {
        let schema = Schema::new(&library.unwrap(), "UMAA::SO::HealthReport::HealthReportType").unwrap();
        let keys = KeySchema::new(&schema).unwrap();
        let instance = keys.of_sample(&schema, &bytes(&sample)).unwrap();
        assert_eq!(instance.hash.to_string(), hash);
        assert_eq!(keys.of_key_sample(&bytes(&alone)).unwrap(), instance);
        assert_eq!(keys.key_sample(&instance.key.unwrap(), DELIMITED).unwrap(), bytes(&alone));
    }
}
