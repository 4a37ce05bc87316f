"""ResourceAllocation (ICD 5.1.3): a service that gives control of one resource, and reports who has it until when."""

import time
import uuid
from dataclasses import dataclass
from typing import Callable, List, Optional, Tuple

from .node import Node
from .provider import Provider, Session
from .samples import ALLOCATION, CONFIG_REPORT, CONTROL_REPORT, PRIORITY, PRIORITY_REPORT, Topic

REPEAT_EVERY = 2.0
ACKNOWLEDGE_WITHIN = 5.0


@dataclass
class Hold:
    """A consumer in control, or about to be."""

    session: uuid.UUID
    consumer: uuid.UUID
    life: int
    ends: Optional[int]
    is_confirmed: bool = False
    reported: Optional[Tuple] = None
    """Stream and number of the report that all its readers are to confirm first, and until when."""


class Arbiter:
    """`resource` stands for what backs the commands: it answers, is slow, or fails, as an order says."""

    def __init__(
        self, node: Node, sid: int, guid: uuid.UUID, resource: uuid.UUID, priorities: List[uuid.UUID], recovers: bool,
        fault: str, tell: Callable,
    ) -> None:
        self.node, self.sid, self.guid, self.resource, self.priorities = node, sid, guid, resource, priorities
        self.recovers, self.tell = recovers, tell
        self.hold: Optional[Hold] = None
        self.former: Optional[dict] = None
        self.is_slow = False
        self.allocation = Provider(node, sid, guid, ALLOCATION, self, fault, tell)
        self.priority = Provider(node, sid, guid, PRIORITY, Priorities(self), fault, tell)
        self.providers = [self.priority, self.allocation]

    # --- as a service ------------------------------------------------------------------------------------------------

    def subscriptions(self):
        return [prefix for provider in self.providers for prefix in provider.subscriptions()]

    def recovered(self, topic: Topic, sample: dict) -> None:
        if topic == CONTROL_REPORT:
            self.former = sample["controlInfo"][0]["controlSession"]
        elif topic == PRIORITY_REPORT:
            self.priorities = sample["priorities"][0]["priorities"]
        for provider in self.providers:
            provider.recovered(topic, sample)

    def begin(self) -> None:
        """4.2.1.1: the reports of a former life are updated at once."""
        self.tell(event="ready")
        self.publish(CONFIG_REPORT, resources=[{"relatedSources": [], "resourceID": self.resource}])
        self.report_priorities()
        for provider in self.providers:
            provider.begin()
        self.report()
        self.node.after(REPEAT_EVERY, self.repeat)

    def heard(self, *what) -> None:
        for provider in self.providers:
            provider.heard(*what)

    def lost(self, source: Tuple[int, int]) -> None:
        for provider in self.providers:
            provider.lost(source)

    def shut_down(self) -> None:
        """4.1.6.1 and 4.2.1.3: the commands first, then the reports."""
        for provider in self.providers:
            provider.shut_down()
        for topic in (CONTROL_REPORT, PRIORITY_REPORT, CONFIG_REPORT):
            self.node.write(self.sid, topic, "dispose", self.guid.bytes)
            self.node.write(self.sid, topic, "unregister", self.guid.bytes)

    # --- as the executor of allocations ------------------------------------------------------------------------------

    def validate(self, _session: uuid.UUID, held: Session) -> Optional[str]:
        known = held.command["resourceID"] == self.resource
        return None if known else "it is no resource of this service"

    def start(self, session: uuid.UUID, held: Session) -> None:
        consumer, duration = held.command["source"], held.command["duration"]
        objection = self.objection(consumer)
        if objection is not None:
            self.free(session)
            self.allocation.fail(session, "RESOURCE_REJECTED", objection)
            return
        if self.is_slow:
            # The provider's time limit ends it.
            return
        before = self.hold
        ends = None if duration is None else time.time_ns() + int(duration * 1e9)
        self.hold = Hold(session, consumer, held.life, ends)
        if before is not None and before.session != session:
            if before.consumer == consumer:
                self.allocation.complete(before.session)
            else:
                self.allocation.fail(before.session, "INTERRUPTED", f"{consumer} goes before")
        self.report()
        if duration is not None:
            life = held.life
            self.node.after(duration, lambda: self.expire(session, life))

    def objection(self, consumer: uuid.UUID) -> Optional[str]:
        if consumer not in self.priorities:
            return f"{consumer} is not on the priority list"
        holder = self.hold.consumer if self.hold is not None else consumer
        outranked = holder in self.priorities and self.priorities.index(holder) > self.priorities.index(consumer)
        return f"{holder} goes before" if outranked else None

    def stop(self, session: uuid.UUID, _held: Session, why: str) -> None:
        # A renewal keeps control while it is looked at.
        if why != "updated":
            self.free(session)

    def recover(self, session: uuid.UUID, held: Session) -> bool:
        """Control goes on where the former life's report says that it was given."""
        was_given = self.former is not None and self.former["controllingConsumer"] == held.command["source"]
        if not self.recovers or held.state == "EXECUTING" and not was_given:
            return False
        if held.state == "EXECUTING":
            ends = self.former["endTime"]
            self.hold = Hold(session, held.command["source"], held.life, ends, is_confirmed=True)
            if ends is not None:
                life = held.life
                self.node.after(max(0.0, (ends - time.time_ns()) / 1e9), lambda: self.expire(session, life))
        return True

    def expire(self, session: uuid.UUID, life: int) -> None:
        if self.hold is not None and (self.hold.session, self.hold.life) == (session, life) and self.hold.is_confirmed:
            self.free(session)
            self.allocation.complete(session)

    def free(self, session: uuid.UUID) -> None:
        if self.hold is not None and self.hold.session == session:
            self.hold = None
            self.report()

    def resource_fails(self) -> None:
        """The backing resource is out of reach."""
        hold = self.hold
        if hold is not None:
            self.allocation.fail(hold.session, "RESOURCE_FAILED", "the resource does not answer any more")
            self.free(hold.session)

    # --- the reports -------------------------------------------------------------------------------------------------

    def publish(self, topic: Topic, **members):
        sample = {**members, "timeStamp": time.time_ns(), "source": self.guid}
        return self.node.write(self.sid, topic, "put", self.guid.bytes, topic.encode(sample))

    def report(self) -> None:
        session = None
        if self.hold is not None:
            session = {"controllingConsumer": self.hold.consumer, "endTime": self.hold.ends}
        told = self.publish(CONTROL_REPORT, controlInfo=[{"controlSession": session, "resourceID": self.resource}])
        if self.hold is not None and not self.hold.is_confirmed and self.hold.reported is None:
            self.hold.reported = (*told, time.monotonic() + ACKNOWLEDGE_WITHIN)

    def report_priorities(self) -> None:
        self.publish(PRIORITY_REPORT, priorities=[{"priorities": self.priorities, "resourceID": self.resource}])

    def repeat(self) -> None:
        self.report()
        self.node.after(REPEAT_EVERY, self.repeat)

    def settled(self) -> None:
        """5.1.3, strong consistency: the command executes once every reliable reader has the report."""
        hold = self.hold
        if hold is None or hold.is_confirmed or hold.reported is None:
            return
        stream, sequence, until = hold.reported
        if not self.node.writers.missing(stream, sequence):
            hold.is_confirmed = True
            self.allocation.executing(hold.session)
        elif until <= time.monotonic():
            self.allocation.fail(hold.session, "TIMEOUT", "not every reader has the report")
            self.free(hold.session)


class Priorities:
    """Executes priority commands: who may control the resource, from low to high."""

    def __init__(self, arbiter: Arbiter) -> None:
        self.arbiter = arbiter

    def validate(self, _session: uuid.UUID, held: Session) -> Optional[str]:
        priorities = held.command["priorities"]
        if len(set(priorities)) < len(priorities):
            return "the list names a consumer twice"
        return self.arbiter.validate(_session, held)

    def start(self, session: uuid.UUID, held: Session) -> None:
        self.arbiter.priority.executing(session)
        self.arbiter.priorities = held.command["priorities"]
        self.arbiter.report_priorities()
        self.arbiter.priority.complete(session)

    def stop(self, _session: uuid.UUID, _held: Session, _why: str) -> None:
        pass

    def recover(self, _session: uuid.UUID, held: Session) -> bool:
        return held.state != "EXECUTING"
