//! `aldis lmcp decode`: LMCP to JSON.

use super::super::exit::Failure;
use super::super::print_line;
use super::input;
use aldis_envelope::codec::delimited::{payload_offset, read_head};
use aldis_envelope::codec::stream::{HEAD, Item, Reader};
use aldis_envelope::lmcp;
use serde_json::{Value, json};
use std::path::PathBuf;

/// LMCP to JSON.
///
/// The file holds messages one after the other, or UxAS frames (`+=+=+=+=…`), as a TCP bridge or a serial line carries
/// them: then each object is told with its address and source. A message that is wrong is said on standard error; the
/// others are shown.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  aldis lmcp decode state.lmcp
  aldis lmcp decode capture.bin --json | jq .object.fields
  nc 127.0.0.1 5555 | head -c 100000 | aldis lmcp decode - --json

Exit codes: 0 every message was read; 1 one was not; 2 the file cannot be read.")]
pub(super) struct Decode {
    /// The file; `-` is standard input.
    file: PathBuf,
    /// One JSON object a line.
    #[arg(long)]
    json: bool,
}

/// What becomes of the messages of a file.
struct Output<'a> {
    args: &'a Decode,
    messages: usize,
    wrong: usize,
}

impl Output<'_> {
    /// One message: its JSON form, or what is wrong with it.
    fn message(&mut self, read: Result<Value, String>) {
        self.messages += 1;
        match read {
            Ok(json) if self.args.json => print_line(json),
            Ok(json) => print_line(format_args!("{json:#}")),
            Err(why) => {
                self.wrong += 1;
                eprintln!("aldis: {}: message {}: {why}", self.args.file.display(), self.messages);
            }
        }
    }
}

impl Decode {
    pub(super) fn run(self) -> Result<(), Failure> {
        let bytes = input::read(&self.file)?;
        let mut output = Output { args: &self, messages: 0, wrong: 0 };
        if bytes.starts_with(HEAD) {
            frames(&bytes, &mut output);
        } else {
            messages(&bytes, &mut output);
        }
        let Output { messages, wrong, .. } = output;
        let name = self.file.display();
        match (messages, wrong) {
            (0, _) => Err(Failure::Failed(format!("{name}: no message in it"))),
            (_, 0) => Ok(()),
            _ => Err(Failure::Failed(format!("{name}: {wrong} of {messages} messages were not read"))),
        }
    }
}

fn messages(bytes: &[u8], output: &mut Output<'_>) {
    for message in lmcp::split(bytes) {
        let object = message.and_then(lmcp::decode);
        output.message(object.map(|it| lmcp::to_json(it.as_ref())).map_err(|why| why.to_string()));
    }
}

fn frames(bytes: &[u8], output: &mut Output<'_>) {
    let mut reader = Reader::new(bytes.len());
    reader.buffer().extend_from_slice(bytes);
    loop {
        match reader.next_item().or_else(|| reader.abandon_unfinished()) {
            Some(Item::Message(message)) => output.message(frame(&message)),
            Some(Item::Bad(why)) => output.message(Err(why.to_string())),
            None => break,
        }
    }
    if reader.is_inside_a_frame() {
        output.message(Err("the file ends inside a frame".into()));
    }
}

/// A frame's message, with what its head says.
fn frame(message: &[u8]) -> Result<Value, String> {
    let offset = payload_offset(message).map_err(|why| why.to_string())?;
    let (head, content) = message.split_at(offset);
    let label = read_head(head).map_err(|why| why.to_string())?;
    let object = lmcp::decode(content).map_err(|why| format!("{}: {why}", label.descriptor))?;
    Ok(json!({
        "address": label.address,
        "descriptor": label.descriptor,
        "source_group": label.source_group,
        "source_entity": label.source.map(|source| source.entity),
        "source_service": label.source.map(|source| source.service),
        "object": lmcp::to_json(object.as_ref()),
    }))
}
