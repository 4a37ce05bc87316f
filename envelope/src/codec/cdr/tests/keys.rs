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
