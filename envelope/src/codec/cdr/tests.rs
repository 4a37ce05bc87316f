//! Bytes as the standards give them, what comes back, and what is refused.

mod keys;
mod random;

use super::*;
use crate::description::{
    Bitmask, Case, Definition, Draft, Enumeration, Library, Member, Structure, Type, Union,
};
use serde_json::json;

pub(super) const XCDR1: Representation = Representation::XCDR1;
const BIG: Representation = Representation { form: Form::Xcdr1, order: ByteOrder::Big };
const PLAIN: Representation = Representation { form: Form::PlainXcdr2, order: ByteOrder::Little };
const DELIMITED: Representation = Representation { form: Form::DelimitedXcdr2, order: ByteOrder::Little };

pub(super) fn structure(extensibility: Extensibility, members: Vec<Member>) -> Definition {
    Definition::Structure(Structure { extensibility, base: None, members })
}

pub(super) fn library<const N: usize>(definitions: [(&str, Definition); N]) -> Library {
    let mut draft = Draft::default();
    definitions.into_iter().for_each(|(name, definition)| draft.add(name, definition).unwrap());
    draft.finish().unwrap()
}

/// An octet, an optional double, a text, and a sequence of structures with an optional octet each.
fn mixed(extensibility: Extensibility) -> Schema {
    let inner = vec![Member::new(0, "x", Type::Octet).optional(), Member::new(1, "y", Type::Int16)];
    let members = vec![
        Member::new(0, "a", Type::Octet),
        Member::new(1, "d", Type::Float64).optional(),
        Member::new(2, "t", Type::String { bound: Some(3) }),
        Member::new(3, "s", Type::sequence(Type::named("Inner"), Some(2))),
    ];
    let definitions =
        [("Inner", structure(extensibility, inner)), ("Mixed", structure(extensibility, members))];
    Schema::new(&library(definitions), "Mixed").unwrap()
}

fn sample(d: Option<f64>) -> Value {
    let inner = |x: Option<u64>, y| Value::Structure(vec![x.map(Value::Unsigned), Some(Value::Signed(y))]);
    Value::Structure(vec![
        Some(Value::Unsigned(7)),
        d.map(Value::Float64),
        Some(Value::Text("hi".to_owned())),
        Some(Value::List(vec![inner(Some(9), -2), inner(None, 3)])),
    ])
}

fn bytes(text: &str) -> Vec<u8> {
    let digits: Vec<u8> = text.bytes().filter(u8::is_ascii_hexdigit).collect();
    digits.chunks(2).map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap()).collect()
}

#[test]
fn each_form_is_what_the_standard_says() {
    let (closed, open) = (mixed(Extensibility::Final), mixed(Extensibility::Appendable));
    let full = sample(Some(1.0));
    let xcdr1 = bytes(
        "00010002 07000000 017f0800 01000000 08000000 000000000000f03f \
         03000000 68690000 02000000 017f0800 00000000 01000000 0900feff 017f0800 00000000 00000000 0300 0000",
    );
    assert_eq!(closed.write(&full, XCDR1).unwrap(), xcdr1);
    assert_eq!(open.write(&full, XCDR1).unwrap(), xcdr1, "XCDR1 does not tell final from appendable");
    let before = "0701 0000 000000000000f03f 03000000 68690000";
    let plain = bytes(&format!("00070000 {before} 0c000000 02000000 0109feff 00000300"));
    assert_eq!(closed.write(&full, PLAIN).unwrap(), plain);
    // The length of all goes first, and each structure of the sequence has its own.
    let inner = "14000000 02000000 04000000 0109feff 04000000 00000300";
    let delimited = bytes(&format!("00090000 2c000000 {before} {inner}"));
    assert_eq!(open.write(&full, DELIMITED).unwrap(), delimited);
    for (schema, representation) in [(&closed, XCDR1), (&closed, BIG), (&closed, PLAIN), (&open, DELIMITED)] {
        for value in [&full, &sample(None)] {
            let read = schema.read(&schema.write(value, representation).unwrap()).unwrap();
            assert_eq!((&read.value, read.differs, read.representation), (value, false, representation));
        }
    }
    assert_eq!(
        open.json(&full),
        json!({ "a": 7, "d": 1.0, "t": "hi", "s": [{ "x": 9, "y": -2 }, { "x": null, "y": 3 }] })
    );
}

#[test]
fn a_short_parameter_header_is_read_too() {
    let schema = mixed(Extensibility::Final);
    let short = bytes("00010000 07000000 01000800 000000000000f03f 03000000 68690000 00000000");
    let Value::Structure(members) = schema.read(&short).unwrap().value else { panic!() };
    assert_eq!(members[1], Some(Value::Float64(1.0)));
    let absent = bytes("00010000 07000000 01000000 03000000 68690000 00000000");
    let Value::Structure(members) = schema.read(&absent).unwrap().value else { panic!() };
    assert_eq!(members[1], None);
    let other = bytes("00010000 07000000 02000000 03000000 68690000 00000000");
    let error = schema.read(&other).unwrap_err();
    assert_eq!(error.fault, CdrFault::OtherMember { found: 2, expected: 1 });
    assert_eq!(error.to_string(), "the header of member 2 where that of member 1 is due, at byte 12 in `d`");
}

#[test]
fn a_sample_of_another_version_is_read_as_far_as_it_goes_and_says_so() {
    let old = vec![Member::new(0, "a", Type::Int32), Member::new(1, "b", Type::Int32)];
    let new =
        [old.clone(), vec![Member::new(2, "c", Type::Octet).optional(), Member::new(3, "d", Type::Int64)]];
    let library = library([
        ("Old", structure(Extensibility::Appendable, old.clone())),
        ("New", structure(Extensibility::Appendable, new.concat())),
        ("Closed", structure(Extensibility::Final, old)),
    ]);
    let schema = |name| Schema::new(&library, name).unwrap();
    let numbers = |held: &[i64]| held.iter().map(|number| Some(Value::Signed(*number))).collect::<Vec<_>>();
    let newer = Value::Structure([numbers(&[1, 2]), vec![None], numbers(&[3])].concat());
    for representation in [DELIMITED, XCDR1] {
        let read = schema("Old").read(&schema("New").write(&newer, representation).unwrap()).unwrap();
        assert_eq!((read.value, read.differs), (Value::Structure(numbers(&[1, 2])), true));
        assert_eq!(
            schema("Old").to_postcard(&schema("New").write(&newer, representation).unwrap()),
            Ok(None)
        );
        let older = schema("Old").write(&Value::Structure(numbers(&[1, 2])), representation).unwrap();
        let read = schema("New").read(&older).unwrap();
        assert_eq!(read.value, Value::Structure([numbers(&[1, 2]), vec![None, None]].concat()));
        assert!(read.differs);
        assert_eq!(schema("New").to_postcard(&older), Ok(None));
        assert_eq!(schema("Old").to_postcard(&older), Ok(Some(vec![2, 4])));
    }
    let longer = schema("New").write(&newer, XCDR1).unwrap();
    assert!(matches!(schema("Closed").read(&longer).unwrap_err().fault, CdrFault::Trailing(_)));
    let fault =
        schema("Closed").read(&schema("Old").write(&Value::Structure(numbers(&[1, 2])), DELIMITED).unwrap());
    let expected = CdrFault::OtherExtensibility { is: "final", found: 9 };
    assert_eq!(fault.unwrap_err().fault, expected);
}

#[test]
fn unions_bits_and_narrow_enumerations_pass() {
    let choice = Enumeration {
        bit_bound: 8,
        literals: vec![("LOW".to_owned(), -1), ("HIGH".to_owned(), 200)],
        ..Enumeration::counted([])
    };
    let case = |id: u32, labels: &[i64], default, held| Case {
        labels: labels.to_vec(),
        default,
        member: Member::new(id, format!("m{id}"), held),
    };
    let union = Union {
        extensibility: Extensibility::Appendable,
        discriminator: Type::named("Choice"),
        key: false,
        cases: vec![
            case(1, &[-1], false, Type::Float32),
            case(2, &[200], true, Type::WideString { bound: Some(2) }),
        ],
    };
    let bits =
        Bitmask { bit_bound: 12, extensibility: Extensibility::Final, flags: vec![("F".to_owned(), 11)] };
    let grid = Type::Array { element: Box::new(Type::Boolean), dimensions: vec![2, 2] };
    let members = vec![
        Member::new(0, "u", Type::named("Pick")),
        Member::new(1, "b", Type::named("Bits")),
        Member::new(2, "c", Type::Char8),
        Member::new(3, "g", Type::array(Type::named("Grid"), 2)),
    ];
    let library = library([
        ("Choice", Definition::Enumeration(choice)),
        ("Pick", Definition::Union(union)),
        ("Bits", Definition::Bitmask(bits)),
        ("Grid", Definition::Alias(grid)),
        ("Top", structure(Extensibility::Appendable, members)),
    ]);
    let schema = Schema::new(&library, "Top").unwrap();
    let top = |pick: Value| {
        let grid = [true, false, false, true].repeat(2).into_iter().map(Value::Boolean).collect();
        let rest = [Value::Bits(0x800), Value::Character(0x41), Value::List(grid)];
        Value::Structure(std::iter::once(pick).chain(rest).map(Some).collect())
    };
    let low = top(Value::Union(-1, Some(Box::new(Value::Float32(0.1)))));
    let high = top(Value::Union(200, Some(Box::new(Value::Text("é😀".to_owned())))));
    assert!(schema.write(&high, DELIMITED).is_err(), "three units where two are allowed");
    let high = top(Value::Union(200, Some(Box::new(Value::Text("😀".to_owned())))));
    for (value, pick) in [
        (&low, json!({ "discriminator": "LOW", "m1": 0.1 })),
        (&high, json!({ "discriminator": "HIGH", "m2": "😀" })),
    ] {
        for representation in [DELIMITED, XCDR1, BIG] {
            let read = schema.read(&schema.write(value, representation).unwrap()).unwrap();
            assert_eq!((&read.value, read.differs), (value, false));
        }
        let shown = schema.json(value);
        assert_eq!((&shown["u"], &shown["b"], &shown["c"]), (&pick, &json!(0x800), &json!("A")));
    }
    let written = schema.write(&low, DELIMITED).unwrap();
    assert_eq!(written, bytes("00090001 17000000 08000000 ff000000 cdcccc3d 0008 41 0100000101000001 00"));
    // What no case names chooses the default.
    let mut other = written.clone();
    other[12] = 5;
    assert!(schema.read(&other).is_err(), "a float is no text");
    assert_eq!(schema.to_postcard(&written), Ok(None));
}

#[test]
fn what_is_wrong_is_told_with_its_place() {
    let schema = mixed(Extensibility::Final);
    let fault = |hex: &str| schema.read(&bytes(hex)).map_err(|error| error.to_string()).unwrap_err();
    assert_eq!(fault("0007"), "4 bytes expected and 2 left, at byte 0");
    assert!(fault("00030000 07").starts_with("representation 0x0003 is not read"));
    assert!(fault("00070000 07 02").starts_with("a boolean of 2, at byte 5 in `d`"));
    assert_eq!(fault("00070000 0700 0000 05000000 6162636400"), "length 4, 3 allowed, at byte 12 in `t`");
    assert_eq!(
        fault("00070000 0700 0000 02000000 6162"),
        "a text without a zero byte at its end, at byte 14 in `t`"
    );
    assert_eq!(fault("00070000 0700 0000 02000000 ff00"), "a text that is not UTF-8, at byte 14 in `t`");
    let sequence = |rest: &str| fault(&format!("00070000 07000000 01000000 00000000 {rest}"));
    assert_eq!(sequence("ff000000 00000000"), "255 bytes expected and 4 left, at byte 20 in `s`");
    assert_eq!(sequence("04000000 ffffffff"), "length 4294967295, 2 allowed, at byte 24 in `s`");
    assert_eq!(sequence("06000000 01000000 0000"), "2 bytes expected and 0 left, at byte 26 in `s[0].y`");
    assert_eq!(
        sequence("09000000 01000000 0000 0000 00"),
        "1 bytes left inside a delimiter after all that it encloses, at byte 29 in `s`"
    );
    let bad = |value: Value| schema.write(&value, PLAIN).unwrap_err().to_string();
    assert_eq!(bad(Value::Text(String::new())), "a structure expected, at byte 4");
    let Value::Structure(mut members) = sample(None) else { panic!() };
    members[2] = Some(Value::Text("long".to_owned()));
    assert_eq!(bad(Value::Structure(members.clone())), "length 4, 3 allowed, at byte 6 in `t`");
    members[2] = None;
    assert_eq!(bad(Value::Structure(members)), "it must be there and is absent, at byte 6 in `t`");
}

#[test]
fn mutable_types_are_not_read() {
    let library = library([("M", structure(Extensibility::Mutable, Vec::new()))]);
    assert_eq!(Schema::new(&library, "M").unwrap_err(), SchemaError::Mutable("M".to_owned()));
    assert_eq!(Schema::new(&library, "N").unwrap_err(), SchemaError::Unknown("N".to_owned()));
}
