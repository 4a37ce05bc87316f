//! Sound samples in CDR, and a sound text in IDL.

use aldis_envelope::codec::cdr::{ByteOrder, Representation, Schema, Value};
use aldis_envelope::description::{Definition, Library, Member, Resolved, Type};
use fastrand::Rng;
use std::error::Error;

/// A type, and the library that it is of.
pub(crate) type Described = (Library, Schema);

/// Every construct of IDL that is read.
pub(crate) const IDL: &str = r#"
#ifndef A
#define A
module UMAA { module T { /* c */
  typedef octet Guid[16];
  const long N = (1 << 4) - 3;
  @bit_bound(8) enum E { A, B = 4, @default_literal C };
  bitmask F { ONE, @position(7) TWO };
  @final struct Base { @key Guid id; };
  union U switch (E) { case A: case E::B: long a[2][3]; default: wstring<5> b; };
  @extensibility(APPENDABLE) struct XType : Base {
    @optional @id(9) sequence<string<N>, 4> texts; @range(min=0, max=1.5) double d; U u; F f; //x
  };
  const string XTypeTopic = "UMAA::T::X";
}; };
#endif
"#;

/// Samples of each type in every form that it has, with anything in them.
pub(crate) fn samples(random: &mut Rng, types: &[Described]) -> Result<Vec<Vec<u8>>, Box<dyn Error>> {
    let mut samples = Vec::new();
    for (place, (library, schema)) in (0_u8..).zip(types) {
        let second = Representation::xcdr2(schema.extensibility());
        let big = Representation { order: ByteOrder::Big, ..second };
        for representation in [Representation::XCDR1, second, big] {
            let value = value(random, library, &Type::named(schema.type_name()));
            samples.push([vec![place], schema.write(&value, representation)?].concat());
        }
    }
    Ok(samples)
}

/// A value of a type of Support Operations.
fn value(random: &mut Rng, library: &Library, held: &Type) -> Value {
    match library.resolved(held) {
        Resolved::Plain(Type::Int32 | Type::Int64) => Value::Signed(random.i32(..).into()),
        Resolved::Plain(Type::Float64) => Value::Float64(random.f64()),
        Resolved::Plain(Type::String { .. }) => {
            Value::Text((0..random.usize(..20)).map(|_| random.char('a'..='é')).collect())
        }
        Resolved::Plain(Type::Sequence { element, .. }) => {
            Value::List((0..random.usize(..4)).map(|_| value(random, library, element)).collect())
        }
        Resolved::Defined(_, Definition::Enumeration(known)) => {
            Value::Enumeration(known.literals[random.usize(..known.literals.len())].1)
        }
        Resolved::Defined(_, Definition::Structure(structure)) => {
            let member = |member: &Member| {
                let absent = member.optional && random.bool();
                (!absent).then(|| value(random, library, &member.r#type))
            };
            Value::Structure(structure.members.iter().map(member).collect())
        }
        // The only array is that of a GUID.
        _ => Value::Octets(random.u128(..).to_be_bytes().to_vec()),
    }
}
