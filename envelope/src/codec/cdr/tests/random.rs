//! Types and values that are made up: what is written comes back, and no bytes do harm.

use super::*;
use proptest::collection::vec;
use proptest::prelude::*;

/// A plain type with a value of it, or a list of such.
fn plain() -> impl Strategy<Value = (Type, Value)> {
    prop_oneof![
        any::<bool>().prop_map(|value| (Type::Boolean, Value::Boolean(value))),
        any::<u8>().prop_map(|value| (Type::Octet, Value::Unsigned(value.into()))),
        any::<i16>().prop_map(|value| (Type::Int16, Value::Signed(value.into()))),
        any::<u32>().prop_map(|value| (Type::UInt32, Value::Unsigned(value.into()))),
        any::<i64>().prop_map(|value| (Type::Int64, Value::Signed(value))),
        any::<i32>().prop_map(|value| (Type::Float32, Value::Float32(value as f32))),
        any::<i32>().prop_map(|value| (Type::Float64, Value::Float64(value.into()))),
        "[a-zé]{0,5}".prop_map(|text| (Type::String { bound: None }, Value::Text(text))),
        "[a-z😀]{0,5}".prop_map(|text| (Type::WideString { bound: None }, Value::Text(text))),
        vec(any::<u8>(), 0..9)
            .prop_map(|octets| (Type::sequence(Type::Octet, Some(8)), Value::Octets(octets))),
        vec(any::<i64>(), 1..4).prop_map(|numbers| {
            let held = Type::array(Type::Int64, numbers.len() as u32);
            (held, Value::List(numbers.into_iter().map(Value::Signed).collect()))
        }),
        vec("[a-z]{0,3}", 0..4).prop_map(|texts| {
            let held = Type::sequence(Type::String { bound: Some(9) }, None);
            (held, Value::List(texts.into_iter().map(Value::Text).collect()))
        }),
    ]
}

/// Members with their values, some optional, some of them absent.
fn members() -> impl Strategy<Value = (Vec<Member>, Vec<Option<Value>>)> {
    vec((plain(), 0..4_u8), 1..7).prop_map(|held| {
        let numbered = (0..).zip(held).map(|(id, ((held, value), kind))| {
            let member = Member::new(id, format!("m{id}"), held);
            match kind {
                0 => (member.optional(), None),
                1 => (member.optional(), Some(value)),
                _ => (member, Some(value)),
            }
        });
        numbered.unzip()
    })
}

/// A structure that holds plain members and a list of structures, in all forms that it has.
fn made_up() -> impl Strategy<Value = (Schema, Value, Representation)> {
    (members(), members(), any::<bool>(), 0..3_u8, 0..4_usize).prop_map(
        |(outer, inner, open, form, length)| {
            let extensibility = if open { Extensibility::Appendable } else { Extensibility::Final };
            let list = Value::List(vec![Value::Structure(inner.1); length]);
            let (mut held, mut values) = outer;
            held.push(Member::new(100, "list", Type::sequence(Type::named("Inner"), None)));
            values.push(Some(list));
            let library = library([
                ("Inner", structure(extensibility, inner.0)),
                ("Outer", structure(extensibility, held)),
            ]);
            let xcdr2 = Representation::xcdr2(extensibility);
            let representation =
                [BIG, xcdr2, Representation { order: ByteOrder::Big, ..xcdr2 }][form as usize];
            (Schema::new(&library, "Outer").unwrap(), Value::Structure(values), representation)
        },
    )
}

proptest! {
    #[test]
    fn what_is_written_comes_back((schema, value, representation) in made_up()) {
        let sample = schema.write(&value, representation).unwrap();
        let read = schema.read(&sample).unwrap();
        prop_assert!(!read.differs);
        prop_assert_eq!(&read.value, &value);
        let content = schema.to_postcard(&sample).unwrap().unwrap();
        prop_assert_eq!(schema.of_postcard(&content, representation).unwrap(), sample);
    }

    #[test]
    fn every_cut_is_refused_or_told((schema, value, representation) in made_up()) {
        let sample = schema.write(&value, representation).unwrap();
        let filler = usize::from(sample[3]);
        let mut sample = sample[..sample.len() - filler].to_vec();
        sample[3] = 0;
        for cut in 0..sample.len() {
            let Ok(read) = schema.read(&sample[..cut]) else { continue };
            prop_assert!(read.differs, "cut at {} of {}", cut, sample.len());
        }
    }

    #[test]
    fn no_bytes_do_harm(
        (schema, value, representation) in made_up(),
        mistakes in vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        random in vec(any::<u8>(), 0..80),
    ) {
        let mut sample = schema.write(&value, representation).unwrap();
        for (place, byte) in mistakes {
            let place = place.index(sample.len());
            sample[place] = byte;
        }
        for input in [sample, random] {
            let keys = KeySchema::new(&schema);
            prop_assert!(keys.is_none());
            let _ = schema.to_postcard(&input);
            let Ok(read) = schema.read(&input) else { continue };
            let _ = schema.json(&read.value);
        }
    }
}
