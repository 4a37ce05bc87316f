//! Objects of any type with any values go through every form and come back.

use proptest::prelude::*;

use crate::lmcp::schema::Kind;
use crate::lmcp::value::Slot;
use crate::lmcp::{
    Object, TypeInfo, decode, descendants, encode, from_json, read_xml, to_json, to_xml, types,
};

/// Draws values from a seed (splitmix64), so that a failure is a number.
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    fn below(&mut self, count: usize) -> usize {
        (self.roll() % count as u64) as usize
    }

    /// A number that is no NaN, whose bits the text forms do not keep.
    fn real(&mut self) -> f64 {
        let real = f64::from_bits(self.roll());
        if real.is_nan() { 0.1 } else { real }
    }

    fn text(&mut self) -> String {
        const PIECES: [&str; 8] = [" ", "a", "é", "<&\"'>", "\n\t", "]]>", "\u{1f6e9}", "\r\n"];
        (0..self.below(5)).map(|_| PIECES[self.below(PIECES.len())]).collect()
    }

    /// An object of the type or of one that descends from it.
    fn object(&mut self, declared: &'static TypeInfo, depth: usize) -> Box<dyn Object> {
        let held: Vec<_> = descendants(declared).collect();
        let info = held[self.below(held.len())];
        let mut object = (info.default)();
        for field in info.fields() {
            self.fill(object.slot(field.name).unwrap(), &field.kind, depth);
        }
        object
    }

    fn fill(&mut self, slot: Slot<'_>, kind: &Kind, depth: usize) {
        match slot {
            Slot::Bool(value) => *value = self.below(2) == 1,
            Slot::Byte(value) => *value = self.roll() as u8,
            Slot::Int32(value) => *value = self.roll() as i32,
            Slot::UInt32(value) => *value = self.roll() as u32,
            Slot::Int64(value) => *value = self.roll() as i64,
            Slot::Real32(value) => *value = self.real() as f32,
            Slot::Real64(value) => *value = self.real(),
            Slot::Enum(value, _) => *value = self.roll() as i32 >> self.below(32),
            Slot::Text(value) => *value = self.text().into(),
            Slot::Object(reference) => match kind {
                Kind::Object(declared) if depth > 0 && self.below(4) > 0 => {
                    assert!(reference.put(self.object(declared, depth - 1)).is_ok());
                }
                _ => reference.clear(),
            },
            Slot::List(list) => {
                let Kind::List(element, _) = kind else { panic!("a list") };
                list.truncate(0);
                for index in 0..self.below(4).max(list.length()) {
                    self.fill(list.place(index).unwrap(), element, depth);
                }
            }
        }
    }
}

proptest! {
    #[test]
    fn any_object_comes_back(pick in 0..164_usize, seed: u64) {
        let info = types().nth(pick).unwrap();
        let object = Dice(seed).object(info, 3);
        let message = encode(object.as_ref()).unwrap();
        prop_assert_eq!(&*decode(&message).unwrap(), &*object);

        let json = to_json(object.as_ref()).to_string();
        let from_json = from_json(json.as_bytes()).unwrap();
        prop_assert_eq!(encode(from_json.as_ref()).unwrap(), message.clone());

        let from_xml = read_xml(to_xml(object.as_ref()).unwrap().as_bytes()).unwrap();
        prop_assert_eq!(from_xml.warnings, []);
        prop_assert_eq!(encode(from_xml.objects[0].object.as_ref()).unwrap(), message);
    }

    #[test]
    fn xml_from_random_pieces_does_no_harm(pieces in prop::collection::vec(0..XML.len(), 0..40)) {
        let document: String = pieces.into_iter().map(|piece| XML[piece]).collect();
        let _ = read_xml(document.as_bytes());
    }
}

/// What XML documents are made of.
const XML: [&str; 16] = [
    "<KeyValuePair Series=\"CMASI\">",
    "</KeyValuePair>",
    "<Key>",
    "</Key>",
    "<Task Series='CMASI'/>",
    "<EntityPerception Series='PERCEIVE'><Velocity><real32>1</real32><real32/><x/><y/></Velocity>",
    "</EntityPerception>",
    "&amp;",
    "&#0;",
    "&",
    "<!--",
    "-->",
    "<![CDATA[",
    "]]>",
    "<?xml version='1.0'?>",
    "a\n",
];
