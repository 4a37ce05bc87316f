"""The service provider of section 4, for any kind of commands. An executor does what the commands ask for:

    validate(session)   None, or why the command is not valid
    start(session)      COMMANDED is published; it says `executing`, `complete` or `fail` of the provider when it comes to that
    stop(session)       the command is over for a reason of others: cancelled, updated, timed out, at the end of the service
    recover(session)    whether an execution of a former life goes on
"""

import time
import uuid
from dataclasses import dataclass
from typing import Callable, Dict, Optional, Tuple

from .node import Node
from .samples import TERMINAL, Family, Topic

START_WITHIN = 10.0
ORPHANS_WAIT = 10.0


@dataclass
class Session:
    """A command that this provider knows."""

    command: dict
    state: str
    life: int = 0
    """Grows with each update: a timer of an earlier life is not for this one."""


class Provider:
    """A part of the service `sid`, which hands everything to it. `fault` names a rule to break."""

    def __init__(
        self, node: Node, sid: int, guid: uuid.UUID, family: Family, executor, fault: str, tell: Callable
    ) -> None:
        self.node, self.sid, self.guid, self.family, self.executor = node, sid, guid, family, executor
        self.fault, self.tell = fault, tell
        self.sessions: Dict[uuid.UUID, Session] = {}
        self.waiting: Dict[uuid.UUID, dict] = {}
        self.former: Dict[uuid.UUID, str] = {}
        self.acknowledged: Dict[uuid.UUID, dict] = {}
        self.is_serving = False
        self.start_within = START_WITHIN

    def subscriptions(self):
        """The commands (4.1.2.1). The prefix is that of statuses and acknowledgements too, which are passed over."""
        return [self.family.command.name]

    # --- 4.1.2.1 start-up --------------------------------------------------------------------------------------------

    def recovered(self, topic: Topic, sample: dict) -> None:
        """What a former life published last of a command."""
        if topic == self.family.status:
            self.former[sample["sessionID"]] = sample["commandStatus"]
        elif topic == self.family.ack:
            self.acknowledged[sample["sessionID"]] = sample["command"]

    def begin(self) -> None:
        """Serves what waits. What has no command is disposed once a command that is on the bus would have come."""
        self.is_serving = True
        waiting, self.waiting = self.waiting, {}
        for session, command in waiting.items():
            self.take(session, command)
        self.node.after(ORPHANS_WAIT, self.give_up_orphans)

    def adopt(self, session: uuid.UUID, command: dict, state: str) -> None:
        """A command of a former life goes on from its last status, or fails."""
        held = self.sessions[session] = Session(command, state)
        if state in TERMINAL:
            return
        if command != self.acknowledged.get(session):
            held.command = self.acknowledged.get(session, command)
            self.updated(session, held, command)
        elif not self.executor.recover(session, held):
            self.fail(session, "SERVICE_FAILED", "it cannot go on after a restart")
        elif state != "EXECUTING":
            self.go_on(session, held)

    def give_up_orphans(self) -> None:
        for session in list(self.former):
            del self.former[session]
            self.clear(session)

    # --- commands ----------------------------------------------------------------------------------------------------

    def heard(self, topic: Topic, change: str, key: Optional[dict], sample: Optional[dict], _envelope) -> None:
        if topic != self.family.command or key is None or key["destination"] != self.guid:
            return
        session = key["sessionID"]
        if change == "put" and not self.is_serving:
            self.waiting[session] = sample
        elif change == "put":
            self.take(session, sample)
        elif change == "dispose":
            self.waiting.pop(session, None)
            if session in self.sessions:
                self.disposed(session, self.sessions[session])
            elif self.former.pop(session, None) is not None:
                self.clear(session)
        else:
            self.tell(event="consumer-unregistered", session=session)

    def take(self, session: uuid.UUID, command: dict) -> None:
        held = self.sessions.get(session)
        if held is None and session in self.former:
            self.adopt(session, command, self.former.pop(session))
        elif held is None:
            # 4.1.4 item 3.
            held = self.sessions[session] = Session(command, "")
            self.status(session, "ISSUED", "SUCCEEDED")
            self.execute(session, held)
        elif command["timeStamp"] > held.command["timeStamp"] and command["source"] == held.command["source"]:
            self.updated(session, held, command)

    def updated(self, session: uuid.UUID, held: Session, command: dict) -> None:
        """4.1.4.2: begins anew, unless it is over."""
        if held.state in TERMINAL:
            return
        held.command, held.life = command, held.life + 1
        self.executor.stop(session, held, "updated")
        self.status(session, "ISSUED", "UPDATED")
        self.execute(session, held)

    def execute(self, session: uuid.UUID, held: Session) -> None:
        """4.1.4.1: acknowledges, validates, and starts."""
        if self.fault != "late-ack":
            self.acknowledge(session, held)
        self.go_on(session, held)

    def go_on(self, session: uuid.UUID, held: Session) -> None:
        objection = self.executor.validate(session, held)
        if objection is not None:
            self.fail(session, "VALIDATION_FAILED", objection)
            return
        if held.state == "ISSUED" and self.fault != "skip-commanded":
            self.status(session, "COMMANDED", "SUCCEEDED")
        if self.fault == "late-ack":
            self.acknowledge(session, held)
        life = held.life
        self.node.after(self.start_within, lambda: self.late(session, life))
        self.executor.start(session, held)

    def late(self, session: uuid.UUID, life: int) -> None:
        """What executes the command has not begun in time."""
        held = self.sessions.get(session)
        if held is not None and held.life == life and held.state == "COMMANDED":
            self.executor.stop(session, held, "late")
            self.fail(session, "TIMEOUT", "it was not begun in time")

    def disposed(self, session: uuid.UUID, held: Session) -> None:
        """A cancel (4.1.4.5), or the sign that what was said of the command can go (4.1.5)."""
        if held.state not in TERMINAL:
            self.executor.stop(session, held, "canceled")
            self.status(session, "CANCELED", "CANCELED")
        del self.sessions[session]
        self.clear(session)

    # --- what an executor says ---------------------------------------------------------------------------------------

    def executing(self, session: uuid.UUID) -> None:
        self.status(session, "EXECUTING", "SUCCEEDED")

    def complete(self, session: uuid.UUID) -> None:
        self.status(session, "COMPLETED", "TIMEOUT" if self.fault == "wrong-reason" else "SUCCEEDED")

    def fail(self, session: uuid.UUID, reason: str, text: str) -> None:
        self.status(session, "FAILED", reason, text)

    # --- what is published -------------------------------------------------------------------------------------------

    def key(self, session: uuid.UUID) -> bytes:
        return self.guid.bytes + session.bytes

    def status(self, session: uuid.UUID, state: str, reason: str, text: str = "") -> None:
        if session in self.sessions:
            self.sessions[session].state = state
        topic = self.family.status
        sample = {
            "timeStamp": time.time_ns(), "source": self.guid, "sessionID": session, "commandStatus": state,
            "commandStatusReason": reason, "logMessage": text,
        }
        self.node.write(self.sid, topic, "put", self.key(session), topic.encode(sample))
        self.tell(event="published", session=session, state=state, reason=reason)

    def acknowledge(self, session: uuid.UUID, held: Session) -> None:
        topic = self.family.ack
        sample = {"command": held.command, "timeStamp": time.time_ns(), "source": self.guid, "sessionID": session}
        self.node.write(self.sid, topic, "put", self.key(session), topic.encode(sample))

    def clear(self, session: uuid.UUID) -> None:
        for topic in (self.family.status, self.family.ack):
            self.node.write(self.sid, topic, "dispose", self.key(session))
        self.tell(event="cleared", session=session)

    def lost(self, source: Tuple[int, int]) -> None:
        """Contact with a consumer is lost: no cancel."""

    # --- 4.1.6.1 shutdown --------------------------------------------------------------------------------------------

    def shut_down(self) -> None:
        """Fails what is incomplete, then unregisters as publisher; the session's end unsubscribes."""
        for session, held in self.sessions.items():
            if held.state not in TERMINAL and self.fault != "silent-shutdown":
                self.executor.stop(session, held, "shutdown")
                self.fail(session, "SERVICE_FAILED", "the service shuts down")
        for session in self.sessions:
            for topic in (self.family.status, self.family.ack):
                self.node.write(self.sid, topic, "unregister", self.key(session))
        self.sessions.clear()
