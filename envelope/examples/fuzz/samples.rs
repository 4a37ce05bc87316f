//! Sound samples in CDR, and a sound text in IDL.

use aldis_envelope::codec::cdr::{ByteOrder, Representation, Schema};
use fastrand::Rng;
use std::error::Error;

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

/// Bytes of zero are a sample of every type as long as they are enough: no list has an element, nothing optional is there. Random ones
/// that are read, and what they are in other forms, hold more.
pub(crate) fn samples(random: &mut Rng, schemas: &[Schema]) -> Result<Vec<Vec<u8>>, Box<dyn Error>> {
    let mut samples = Vec::new();
    for (place, schema) in (0_u8..).zip(schemas) {
        let second = Representation::xcdr2(schema.extensibility());
        let closed = schema.as_final();
        let first = grown(random, &closed).ok_or("a type without a sample")?;
        let value = closed.read(&first)?.value;
        for representation in
            [Representation::XCDR1, second, Representation { order: ByteOrder::Big, ..second }]
        {
            samples.push([vec![place], schema.write(&value, representation)?].concat());
        }
    }
    Ok(samples)
}

/// A sample in plain XCDR2 that is grown from zeros by small numbers which it can be read with.
fn grown(random: &mut Rng, schema: &Schema) -> Option<Vec<u8>> {
    let sound = |sample: &[u8]| schema.read(sample).is_ok_and(|read| !read.differs);
    let mut sample = vec![0, 7, 0, 0];
    while !sound(&sample) && sample.len() < 4_096 {
        sample.push(0);
    }
    for _ in 0..400 {
        let mut next = sample.clone();
        let place = random.usize(4..next.len());
        next[place] = random.u8(..4);
        next.extend(vec![0; random.usize(..80)]);
        if sound(&next) {
            sample = next;
        }
    }
    sound(&sample).then_some(sample)
}
