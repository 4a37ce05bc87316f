"""The service consumer of section 4, for any kind of commands: it starts, updates and cancels them, follows them to their
ends and clears up. What it hears is held against figure 5; a step that is not in it is told as a violation."""

import time
import uuid
from dataclasses import dataclass
from typing import Callable, Dict, Optional, Tuple

from .node import Node
from .samples import CONTROL_REPORT, FAMILIES, FOLLOWS, TERMINAL, Family, Topic


@dataclass
class Session:
    """A command of this consumer, from its publication until the bus is clear of it."""

    family: Family
    command: dict
    state: Optional[str] = None
    is_disposed: bool = False
    status_is_there: bool = False
    ack_is_there: bool = False
    starts_anywhere: bool = False
    """The statuses of a command of a former life, or of a provider that starts again, begin where they stand."""


class Consumer:
    """A service: `tell` gets what happens, `fault` names a rule to break."""

    def __init__(
        self, node: Node, sid: int, guid: uuid.UUID, provider_of: Callable, recovery: str, fault: str, tell: Callable
    ) -> None:
        self.node, self.sid, self.guid, self.provider_of, self.recovery = node, sid, guid, provider_of, recovery
        self.fault, self.tell = fault, tell
        self.sessions: Dict[uuid.UUID, Session] = {}
        self.former = []
        """The sessions of a former life."""

    def subscriptions(self):
        """Statuses and acknowledgements (4.1.2.2), and who is in control."""
        parts = [part.name for family in FAMILIES.values() for part in (family.status, family.ack)]
        return [*parts, CONTROL_REPORT.name]

    # --- 4.1.2.2 start-up --------------------------------------------------------------------------------------------

    def recovered(self, topic: Topic, sample: dict) -> None:
        """A command of a former life that is still on the bus."""
        for family in FAMILIES.values():
            if topic == family.command and sample["source"] == self.guid:
                self.sessions[sample["sessionID"]] = Session(family, sample, starts_anywhere=True)
                self.former.append(sample["sessionID"])

    def begin(self) -> None:
        """All that the fleet retains is known: each command of a former life goes on or is cancelled."""
        self.tell(event="ready", recovered=self.former)
        for session in self.former:
            if self.recovery == "cancel" and session in self.sessions:
                self.cancel(session)

    # --- 4.1.4 start, update, cancel ---------------------------------------------------------------------------------

    def start(self, kind: str, destination: uuid.UUID, parameters: dict) -> uuid.UUID:
        """4.1.4: publishes a command with a session id of its own."""
        session = uuid.uuid4()
        header = {"timeStamp": time.time_ns(), "source": self.guid, "sessionID": session, "destination": destination}
        self.sessions[session] = Session(FAMILIES[kind], {**parameters, **header})
        self.put(self.sessions[session])
        return session

    def update(self, session: uuid.UUID, parameters: dict) -> None:
        """4.1.4.2: the same session with a newer timestamp, while it has not ended."""
        held = self.sessions[session]
        newer = max(time.time_ns(), held.command["timeStamp"] + 1)
        if self.fault == "old-update":
            newer = held.command["timeStamp"] - 1
        held.command = {**held.command, **parameters, "timeStamp": newer}
        self.put(held)

    def cancel(self, session: uuid.UUID) -> None:
        """4.1.4.5: a cancel is the disposal of the command."""
        self.dispose(self.sessions[session])

    def put(self, held: Session) -> None:
        topic = held.family.command
        self.node.write(self.sid, topic, "put", topic.key(held.command), topic.encode(held.command))

    def dispose(self, held: Session) -> None:
        if not held.is_disposed:
            held.is_disposed = True
            topic = held.family.command
            self.node.write(self.sid, topic, "dispose", topic.key(held.command))

    # --- what is said of the commands --------------------------------------------------------------------------------

    def heard(self, topic: Topic, change: str, key: Optional[dict], sample: Optional[dict], _envelope) -> None:
        held = self.sessions.get(key["sessionID"]) if key is not None and "sessionID" in key else None
        if held is None or key["source"] != held.command["destination"]:
            return
        session = key["sessionID"]
        if topic == held.family.status and change == "put":
            self.status(session, held, sample)
        elif topic == held.family.status and change == "dispose":
            held.status_is_there = False
        elif topic == held.family.ack:
            held.ack_is_there = change == "put"
            if change == "put":
                self.tell(event="ack", session=session, matches=sample["command"] == held.command)
        if change == "unregister":
            held.status_is_there = held.ack_is_there = False
            self.tell(event="unregistered", session=session, topic=topic.name)
        if change != "put":
            self.finish(session, held)

    def status(self, session: uuid.UUID, held: Session, status: dict) -> None:
        state, reason = status["commandStatus"], status["commandStatusReason"]
        possible = FOLLOWS.values() if held.starts_anywhere else [FOLLOWS[held.state]]
        if not any((state, reason) in follows for follows in possible):
            self.tell(event="violation", session=session, was=held.state, state=state, reason=reason)
        held.starts_anywhere, held.status_is_there = False, True
        held.state = state
        self.tell(event="status", session=session, state=state, reason=reason, text=status["logMessage"])
        if state in ("COMPLETED", "FAILED"):
            # 4.1.5: the end is known, so the command goes.
            self.dispose(held)

    def finish(self, session: uuid.UUID, held: Session) -> None:
        if held.is_disposed and held.state in TERMINAL and not held.status_is_there and not held.ack_is_there:
            self.tell(event="clean", session=session)
            del self.sessions[session]

    def lost(self, source: Tuple[int, int]) -> None:
        """Contact is lost, which says nothing of the commands."""
        for held in self.sessions.values():
            if self.provider_of(held.command["destination"]) == source:
                held.starts_anywhere = True

    def settled(self) -> None:
        pass

    # --- 4.1.6.2 shutdown --------------------------------------------------------------------------------------------

    def shut_down(self) -> None:
        """Cancels what is incomplete, then unregisters as publisher; the session's end unsubscribes."""
        for held in self.sessions.values():
            if self.fault != "keep-at-shutdown":
                self.dispose(held)
        for held in self.sessions.values():
            topic = held.family.command
            self.node.write(self.sid, topic, "unregister", topic.key(held.command))
        self.sessions.clear()
