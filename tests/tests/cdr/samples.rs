//! Samples that are made up from a description: each member set, in JSON.

use aldis_envelope::Guid;
use aldis_envelope::description::{Definition, Library, Resolved, Type};
use fastrand::Rng;
use serde_json::{Map, Value, json};

/// Members of a structure. The first sample has no optional member and empty lists, the second has all.
pub(crate) fn made_up(random: &mut Rng, library: &Library, type_name: &str, number: usize) -> Value {
    let structure = library.structure(type_name).expect("a structure");
    let mut members = Map::new();
    for member in library.members(structure) {
        let absent = member.optional && (number == 0 || number > 1 && random.bool());
        let value = if absent {
            Value::Null
        } else if member.name == "nanoseconds" {
            json!(random.i32(0..1_000_000_000))
        } else if member.name == "size" {
            json!(random.i32(0..))
        } else {
            value(random, library, &member.r#type, number)
        };
        members.insert(member.name.clone(), value);
    }
    Value::Object(members)
}

fn value(random: &mut Rng, library: &Library, held: &Type, number: usize) -> Value {
    match library.resolved(held) {
        Resolved::Plain(Type::Int64) => json!(random.i64(..)),
        Resolved::Plain(Type::Int32) => json!(random.i32(..)),
        Resolved::Plain(Type::Float64) => json!(f64::from(random.u32(0..37_817_280)) / 8.0),
        Resolved::Plain(Type::String { .. }) => {
            let length = random.usize(0..10);
            json!((0..length).map(|_| random.char('a'..='é')).collect::<String>())
        }
        Resolved::Plain(Type::Array { .. }) => {
            json!(Guid(random.u128(..).to_be_bytes()).to_string())
        }
        Resolved::Plain(Type::Sequence { element, bound }) => {
            let most = bound.map_or(5, |bound| bound.min(5)) as usize;
            let length = if number == 0 { 0 } else { random.usize(0..=most) };
            (0..length).map(|_| value(random, library, element, number)).collect()
        }
        Resolved::Defined(_, Definition::Enumeration(enumeration)) => {
            json!(enumeration.literals[random.usize(..enumeration.literals.len())].0)
        }
        Resolved::Defined(name, Definition::Structure(_)) => made_up(random, library, name, number),
        other => panic!("no sample of {other:?}"),
    }
}
