//! One request to service 1 of a node, and its answer.

use crate::cli::exit::Failure;
use crate::cli::member::{Desk, Join, Member};
use aldis_envelope::{
    Address, ContentType, Descriptor, EntityId, Now, Refusal, Role, ServiceId, Source, aldis,
};
use aldis_services::{Input, Outbox};
use bytes::Bytes;
use serde::de::DeserializeOwned;
use std::sync::mpsc;
use std::time::Duration;

/// How long the node may take: it is on this side of every link.
const ANSWER_WITHIN: Duration = Duration::from_secs(5);

struct Asking {
    to: Address,
    request: Descriptor,
    content: Bytes,
    asked: bool,
    answer: Option<Bytes>,
    tell: mpsc::Sender<Result<Bytes, Refusal>>,
}

impl Desk for Asking {
    fn take(&mut self, _: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            Input::Bus(true) if !self.asked => {
                self.asked = true;
                let (request, content) = (self.request.clone(), self.content.clone());
                out.call(self.to.clone(), ContentType::Aldis, request, content, ANSWER_WITHIN);
            }
            Input::Message(envelope) => {
                let is_reply = |role: &Role| matches!(role, Role::Reply { .. });
                if envelope.message.call.as_ref().is_some_and(|call| is_reply(&call.role)) {
                    self.answer = Some(envelope.message.content.clone());
                }
            }
            Input::CallEnded(_, outcome) => {
                let answer = self.answer.take().ok_or(Refusal::NoAnswer);
                // The command no longer listens where it has been cut off.
                let _ = self.tell.send(outcome.and(answer));
            }
            _ => {}
        }
    }
}

/// Asks service 1 of a node, and reads its answer.
pub(in crate::cli) fn ask<T: DeserializeOwned>(
    join: &Join,
    node: EntityId,
    request: &str,
    content: Vec<u8>,
) -> Result<T, Failure> {
    ask_service(join, Source::new(node, ServiceId::NODE), request, content)
}

/// Asks a service, and reads its answer.
pub(in crate::cli) fn ask_service<T: DeserializeOwned>(
    join: &Join,
    service: Source,
    request: &str,
    content: Vec<u8>,
) -> Result<T, Failure> {
    let (tell, told) = mpsc::channel();
    let asking = Asking {
        to: Address::Service(service),
        request: Descriptor::new(request).map_err(|why| Failure::Failed(why.to_string()))?,
        content: content.into(),
        asked: false,
        answer: None,
        tell,
    };
    let member = Member::join(join, Vec::new(), asking)?;
    let answer = told.recv_timeout(crate::cli::JOIN_WITHIN + ANSWER_WITHIN).map_err(|_| join.unreachable());
    member.leave()?;
    let answer = answer?.map_err(Failure::Refused)?;
    aldis::decode(&answer).ok_or_else(|| {
        Failure::Failed(format!("{service} answers `{request}` in a way that this program does not read"))
    })
}
