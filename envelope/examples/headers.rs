//! One envelope on the wire: its key expression, its header byte by byte, and the way back. `WIRE.md` explains it.
//!
//! ```text
//! cargo run -p aldis-envelope --example headers
//! ```

use aldis_envelope::codec::native::{Decoder, encode};
use aldis_envelope::{
    Address, BootId, Call, CallId, ContentType, Descriptor, EntityId, Envelope, Fleet, Keys, Label, Message,
    Priority, Role, ServiceId, Source, Space, Stamp, Wall, aldis,
};
use bytes::Bytes;
use std::error::Error;
use std::io::Write;
use std::sync::Arc;

/// A ping of service 37 on vehicle 400, asked by service 100 of entity 1, which waits two seconds for the answer.
fn ping() -> Result<Envelope, Box<dyn Error>> {
    let source = Source::new(EntityId::new(1)?, ServiceId::new(100)?);
    let to = Address::new("eid400sid37")?;
    let label = Label::limitedcast(to, ContentType::Aldis, Descriptor::new(aldis::PING)?, source);
    let call = Call { id: CallId(7), role: Role::Request { time_left_ms: 2000 } };
    let message =
        Message { call: Some(Box::new(call)), ..Message::new(Arc::new(label), Bytes::from_static(b"hello")) };
    let stamp = Stamp {
        node: EntityId::new(1)?,
        boot: BootId(12),
        sequence: 300,
        source_time: Wall(1_795_309_868_120_000_000),
        lifespan_left_ms: None,
        priority: Priority::Data,
        skipped: 0,
        via: Default::default(),
    };
    Ok(Envelope { message, stamp })
}

fn main() -> Result<(), Box<dyn Error>> {
    let keys = Keys::new(&Fleet::new("blue")?);
    let envelope = ping()?;
    let label = &envelope.message.label;
    let key = keys.envelope(Space::Data, label, envelope.message.instance.as_deref());
    let mut header = Vec::new();
    encode(&envelope, &mut header);
    let hex: Vec<_> = header.iter().map(|byte| format!("{byte:02x}")).collect();

    let mut out = std::io::stdout().lock();
    writeln!(out, "key     {key}")?;
    writeln!(out, "header  {}", hex.join(" "))?;

    let content = envelope.message.content.clone();
    let read = Decoder::new(keys).decode(&key, false, &header, content)?;
    assert_eq!(read, envelope);
    writeln!(
        out,
        "read    {} from {}, sequence {}",
        label.descriptor(),
        label.source(),
        read.stamp.sequence
    )?;
    Ok(())
}
