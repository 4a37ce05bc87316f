//! What is fed: each decoder of this crate, with what holds when it accepts an input.

use crate::corpus::{Corpus, schemas};
use crate::samples::Described;
use aldis_envelope::codec::cdr::KeySchema;
use aldis_envelope::codec::{delimited, multipart, native, stream, zmtp};
use aldis_envelope::description::Extensibility;
use aldis_envelope::idl;
use aldis_envelope::lmcp::{self, Header, natural_key, position};
use aldis_envelope::{Fleet, Keys};
use bytes::Bytes;
use fastrand::Rng;

/// What became of an input.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// It was read, and writing it again gives what was read.
    Accepted,
    /// It was refused.
    Refused,
    /// It was read as something else than it is.
    Misread,
}

/// Runs a piece of work while memory is watched.
type Watch<'a> = dyn FnMut(&mut dyn FnMut()) + 'a;

/// A decoder.
pub(crate) struct Decoder {
    pub(crate) name: &'static str,
    pub(crate) samples: fn(&Corpus) -> &[Vec<u8>],
    /// Makes right what would hide all other mistakes.
    pub(crate) mend: Option<fn(&mut Rng, &mut [u8])>,
    /// Reads an input; what reads is watched, what checks is not.
    pub(crate) read: fn(&[u8], &mut Watch<'_>) -> Outcome,
}

pub(crate) const DECODERS: [Decoder; 10] = [
    Decoder { name: "lmcp", samples: |it| &it.lmcp, mend: Some(mend_lmcp), read: read_lmcp },
    Decoder { name: "native", samples: |it| &it.headers, mend: None, read: read_native },
    Decoder { name: "delimited", samples: |it| &it.delimited, mend: None, read: read_delimited },
    Decoder { name: "multipart", samples: |it| &it.delimited, mend: None, read: read_multipart },
    Decoder { name: "stream", samples: |it| &it.frames, mend: None, read: read_stream },
    Decoder { name: "zmtp", samples: |it| &it.zmtp, mend: Some(mend_zmtp), read: read_zmtp },
    Decoder { name: "json", samples: |it| &it.json, mend: None, read: read_json },
    Decoder { name: "xml", samples: |it| &it.xml, mend: None, read: read_xml },
    Decoder { name: "cdr", samples: |it| &it.cdr, mend: None, read: read_cdr },
    Decoder { name: "idl", samples: |it| &it.idl, mend: None, read: read_idl },
];

/// Size and checksum of the container, of seven inputs in eight.
fn mend_lmcp(random: &mut Rng, input: &mut [u8]) {
    let length = input.len();
    if length >= lmcp::CONTAINER && random.u8(..8) > 0 {
        input[..4].copy_from_slice(&lmcp::MAGIC);
        input[4..8].copy_from_slice(&((length - lmcp::CONTAINER) as u32).to_be_bytes());
        input[length - 4..].fill(0);
    }
}

fn read_lmcp(input: &[u8], watch: &mut Watch<'_>) -> Outcome {
    let mut read = None;
    watch(&mut || read = Some(lmcp::decode(input)));
    let header = Header::peek(input);
    let descriptor = header.ok().and_then(|header| header.type_info().ok()).map_or("", |info| info.full_name);
    let _ = (position(input), natural_key(descriptor, input));
    let Some(Ok(object)) = read else { return Outcome::Refused };
    match lmcp::encode(object.as_ref()) {
        Ok(again) if again[..again.len() - 4] == input[..input.len() - 4] => Outcome::Accepted,
        _ => Outcome::Misread,
    }
}

/// A header on one of three keys, put or deleted.
fn read_native(input: &[u8], watch: &mut Watch<'_>) -> Outcome {
    let Ok(fleet) = Fleet::new("blue") else { return Outcome::Misread };
    let keys = Keys::new(&fleet);
    let mut decoder = native::Decoder::new(keys);
    let key = ["aldis/blue/400/37/-/a/B", "aldis/blue/1/20/-/eid400/sid37", "aldis/blue/@writer/4/2/-/a"];
    let key = key[input.len() % key.len()];
    let mut read = None;
    watch(&mut || read = Some(decoder.decode(key, input.len().is_multiple_of(16), input, Bytes::new())));
    match read {
        Some(Ok(envelope)) => {
            let mut again = Vec::new();
            native::encode(&envelope, &mut again);
            let second = decoder.decode(key, input.len().is_multiple_of(16), &again, Bytes::new());
            if second == Ok(envelope) { Outcome::Accepted } else { Outcome::Misread }
        }
        _ => Outcome::Refused,
    }
}

fn read_delimited(input: &[u8], watch: &mut Watch<'_>) -> Outcome {
    let mut accepted = false;
    watch(&mut || {
        accepted = delimited::payload_offset(input)
            .is_ok_and(|payload| delimited::read_head(&input[..payload]).is_ok());
    });
    if accepted { Outcome::Accepted } else { Outcome::Refused }
}

/// The parts are what stands between the delimiters.
fn read_multipart(input: &[u8], watch: &mut Watch<'_>) -> Outcome {
    let parts: Vec<_> =
        input.splitn(7, |byte| matches!(byte, b'$' | b'|')).map(Bytes::copy_from_slice).collect();
    let mut accepted = false;
    watch(&mut || accepted = multipart::read(&parts).is_ok());
    if accepted { Outcome::Accepted } else { Outcome::Refused }
}

/// Two pieces, and an end without the rest.
fn read_stream(input: &[u8], watch: &mut Watch<'_>) -> Outcome {
    let mut messages = 0;
    watch(&mut || {
        let mut reader = stream::Reader::new(32 * 1024);
        let (first, second) = input.split_at(input.len() / 2);
        for piece in [first, second] {
            reader.buffer().extend_from_slice(piece);
            while let Some(item) = reader.next_item() {
                messages += u32::from(matches!(item, stream::Item::Message(_)));
            }
        }
        while reader.abandon_unfinished().is_some() {
            while reader.next_item().is_some() {}
        }
    });
    if messages > 0 { Outcome::Accepted } else { Outcome::Refused }
}

/// The greeting and the handshake of seven inputs in eight: what is wrong there hides all that follows.
fn mend_zmtp(random: &mut Rng, input: &mut [u8]) {
    let socket = if random.bool() { zmtp::SocketType::Push } else { zmtp::SocketType::Sub };
    let begin = [&zmtp::GREETING[..], &zmtp::ready(socket)].concat();
    if input.len() > begin.len() && random.u8(..8) > 0 {
        input[..begin.len()].copy_from_slice(&begin);
    }
}

/// Two pieces, to the end that fits what the peer calls itself.
fn read_zmtp(input: &[u8], watch: &mut Watch<'_>) -> Outcome {
    let subscribes = input.windows(3).take(120).any(|part| part == b"SUB");
    let own = if subscribes { zmtp::SocketType::Pub } else { zmtp::SocketType::Pull };
    let mut items = 0;
    watch(&mut || {
        let mut reader = zmtp::Reader::new(own, 32 * 1024);
        let (first, second) = input.split_at(input.len() / 2);
        for piece in [first, second] {
            reader.buffer().extend_from_slice(piece);
            while let Ok(Some(_)) = reader.next_item() {
                items += 1;
            }
        }
    });
    if items > 1 { Outcome::Accepted } else { Outcome::Refused }
}

fn read_json(input: &[u8], watch: &mut Watch<'_>) -> Outcome {
    let mut read = None;
    watch(&mut || {
        read = lmcp::from_json(input).ok();
    });
    match read {
        Some(object) => {
            let json = lmcp::to_json(object.as_ref()).to_string();
            comes_back(object.as_ref(), lmcp::from_json(&as_long_as(json, input)).ok())
        }
        None => Outcome::Refused,
    }
}

fn read_xml(input: &[u8], watch: &mut Watch<'_>) -> Outcome {
    let mut read = None;
    watch(&mut || read = lmcp::read_xml(input).ok());
    match read.and_then(|mut document| document.objects.pop()) {
        Some(placed) => {
            let Ok(xml) = lmcp::to_xml(placed.object.as_ref()) else { return Outcome::Refused };
            let again = lmcp::read_xml(&as_long_as(xml, input)).ok();
            let again = again.and_then(|mut document| document.objects.pop());
            comes_back(placed.object.as_ref(), again.map(|placed| placed.object))
        }
        None => Outcome::Refused,
    }
}

/// A text with spaces behind it, where it is shorter than what it was read from: it is allowed as much memory.
fn as_long_as(text: String, input: &[u8]) -> Vec<u8> {
    let mut bytes = text.into_bytes();
    bytes.resize(bytes.len().max(input.len()), b' ');
    bytes
}

/// Text forms keep all but the bits of a NaN.
fn comes_back(object: &dyn lmcp::Object, again: Option<Box<dyn lmcp::Object>>) -> Outcome {
    let same = again.is_some_and(|again| format!("{again:?}") == format!("{object:?}"));
    if same { Outcome::Accepted } else { Outcome::Misread }
}

thread_local! {
    static SCHEMAS: Vec<Described> = schemas().unwrap_or_default();
}

/// The first byte chooses the type, the rest is the sample. What was read is written and read again.
fn read_cdr(input: &[u8], watch: &mut Watch<'_>) -> Outcome {
    let Some((chosen, sample)) = input.split_first() else { return Outcome::Refused };
    SCHEMAS.with(|schemas| {
        let Some((_, schema)) = schemas.get(usize::from(*chosen) % schemas.len().max(1)) else {
            return Outcome::Misread;
        };
        let mut read = None;
        watch(&mut || read = schema.read(sample).ok());
        let _ = (
            schema.to_postcard(sample),
            KeySchema::new(schema).map(|keys| keys.of_key_sample(sample).is_ok()),
        );
        let Some(read) = read else { return Outcome::Refused };
        if read.differs {
            return Outcome::Accepted;
        }
        // Compared as bytes: a NaN is not equal to itself.
        let again = schema.write(&read.value, read.representation).ok();
        let second = again.as_deref().and_then(|again| schema.read(again).ok());
        let second = second.and_then(|second| schema.write(&second.value, second.representation).ok());
        if again.is_some() && again == second { Outcome::Accepted } else { Outcome::Misread }
    })
}

fn read_idl(input: &[u8], watch: &mut Watch<'_>) -> Outcome {
    let text = String::from_utf8_lossy(input).into_owned();
    let files = [("a.idl".to_owned(), text)].into();
    let mut read = false;
    watch(&mut || read = idl::parse(&files, Extensibility::Appendable).is_ok());
    if read { Outcome::Accepted } else { Outcome::Refused }
}
