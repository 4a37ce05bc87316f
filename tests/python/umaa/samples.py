"""The types of ResourceAllocation (ICD 5.1.3, 5.2) as WIRE.md lays them out, with their keys.

A sample is a dict with the names of the IDL; GUIDs are `uuid.UUID`, times nanoseconds since the POSIX epoch, enumerations
their names, absent optional members None.
"""

import struct
import uuid
from dataclasses import dataclass
from typing import Callable, List, Optional, Tuple

import aldis_wire as wire
from aldis_wire import Reader, check, put_option, put_signed, put_text, put_varint

STATES = ["CANCELED", "COMMANDED", "COMPLETED", "EXECUTING", "FAILED", "ISSUED"]
REASONS = [
    "CANCELED", "INTERRUPTED", "OBJECTIVE_FAILED", "RESOURCE_FAILED", "RESOURCE_REJECTED", "SERVICE_FAILED", "SUCCEEDED",
    "TIMEOUT", "UPDATED", "VALIDATION_FAILED",
]
TERMINAL = ("COMPLETED", "FAILED", "CANCELED")
DURATION_MAX = 37_817_280

# Figure 5: what may follow a state, and for which reasons. None stands for a command that has no status yet.
_ANY_TIME = {("ISSUED", "UPDATED"), ("CANCELED", "CANCELED")}
_FAILED = {("FAILED", reason) for reason in ("INTERRUPTED", "TIMEOUT", "SERVICE_FAILED")}
FOLLOWS = {
    None: {("ISSUED", "SUCCEEDED")},
    "ISSUED": {("COMMANDED", "SUCCEEDED"), ("FAILED", "VALIDATION_FAILED"), ("FAILED", "RESOURCE_FAILED")}
    | _ANY_TIME | _FAILED,
    "COMMANDED": {("EXECUTING", "SUCCEEDED"), ("FAILED", "RESOURCE_REJECTED")} | _ANY_TIME | _FAILED,
    "EXECUTING": {("COMPLETED", "SUCCEEDED"), ("FAILED", "OBJECTIVE_FAILED"), ("FAILED", "RESOURCE_FAILED")}
    | _ANY_TIME | _FAILED,
    **{state: set() for state in TERMINAL},
}


@dataclass(frozen=True)
class Layout:
    """How a value is written and read."""

    put: Callable
    take: Callable


def _put_time(nanoseconds: int) -> bytes:
    return put_signed(nanoseconds // 10**9) + put_signed(nanoseconds % 10**9)


def _take_time(r: Reader) -> int:
    seconds, nanoseconds = r.signed(), r.signed()
    check(0 <= nanoseconds < 10**9, f"{nanoseconds} nanoseconds in a DateTime")
    return seconds * 10**9 + nanoseconds


def _put_duration(seconds: float) -> bytes:
    check(0 <= seconds <= DURATION_MAX, f"a duration of {seconds} s")
    return struct.pack("<d", seconds)


def _take_duration(r: Reader) -> float:
    (seconds,) = struct.unpack("<d", r.take(8))
    check(0 <= seconds <= DURATION_MAX, f"a duration of {seconds} s")
    return seconds


def _put_description(text: str) -> bytes:
    check(len(text.encode()) <= 4095, "a description has more than 4095 bytes")
    return put_text(text)


def _take_description(r: Reader) -> str:
    text = r.text()
    check(len(text.encode()) <= 4095, "a description has more than 4095 bytes")
    return text


def enumeration(names: List[str]) -> Layout:
    return Layout(lambda name: bytes([names.index(name)]), lambda r: names[r.ordinal(len(names))])


def optional(of: Layout) -> Layout:
    return Layout(
        lambda value: put_option(None if value is None else of.put(value)),
        lambda r: of.take(r) if r.present() else None,
    )


def sequence(of: Layout, most: int) -> Layout:
    def take(r: Reader) -> list:
        count = r.varint()
        check(count <= most, f"{count} elements where {most} are the most")
        return [of.take(r) for _ in range(count)]

    return Layout(lambda values: put_varint(len(values)) + b"".join(map(of.put, values)), take)


def struct_of(*members: Tuple[str, Layout]) -> Layout:
    return Layout(
        lambda sample: b"".join(layout.put(sample[name]) for name, layout in members),
        lambda r: {name: layout.take(r) for name, layout in members},
    )


GUID = Layout(lambda guid: guid.bytes, lambda r: uuid.UUID(bytes=r.take(16)))
TIME = Layout(_put_time, _take_time)
DURATION = Layout(_put_duration, _take_duration)
DESCRIPTION = Layout(_put_description, _take_description)

_STATUS_KEY = [("source", GUID), ("sessionID", GUID)]
_COMMAND = [("resourceID", GUID), ("timeStamp", TIME), *_STATUS_KEY, ("destination", GUID)]
ALLOCATION_COMMAND = struct_of(("duration", optional(DURATION)), *_COMMAND)
PRIORITY_COMMAND = struct_of(("priorities", sequence(GUID, 100)), *_COMMAND)
STATUS = struct_of(
    ("timeStamp", TIME), *_STATUS_KEY, ("commandStatus", enumeration(STATES)),
    ("commandStatusReason", enumeration(REASONS)), ("logMessage", DESCRIPTION),
)
SESSION = struct_of(("controllingConsumer", GUID), ("endTime", optional(TIME)))
CONTROL_INFO = struct_of(("controlSession", optional(SESSION)), ("resourceID", GUID))
DEFINITION = struct_of(("relatedSources", sequence(GUID, 100)), ("resourceID", GUID))
PRIORITY_INFO = struct_of(("priorities", sequence(GUID, 100)), ("resourceID", GUID))


@dataclass(frozen=True)
class Topic:
    """A topic with the layout of its type, its key members in their order, and whether all its samples are kept."""

    name: str
    layout: Layout
    keys: Tuple[str, ...]
    keep_all: bool = False

    def key(self, sample: dict) -> bytes:
        return b"".join(sample[name].bytes for name in self.keys)

    def read_key(self, key: bytes) -> Optional[dict]:
        if len(key) != 16 * len(self.keys):
            return None
        return {name: uuid.UUID(bytes=key[at * 16 : at * 16 + 16]) for at, name in enumerate(self.keys)}

    def instance(self, key: bytes) -> str:
        """One GUID is its own hash; of more the hash is the MD5."""
        return wire.key_hash(key, always_fits=len(self.keys) == 1)

    def encode(self, sample: dict) -> bytes:
        return self.layout.put(sample)

    def decode(self, content: bytes) -> dict:
        r = Reader(content)
        sample = self.layout.take(r)
        r.end()
        return sample


@dataclass(frozen=True)
class Family:
    """A command with all that is said of it (ICD 4.1). No execution status is defined for those of 5.1.3."""

    command: Topic
    status: Topic
    ack: Topic


def family(name: str, command: Layout) -> Family:
    ack = struct_of(("command", command), ("timeStamp", TIME), *_STATUS_KEY)
    return Family(
        Topic(f"{name}Command", command, ("source", "sessionID", "destination")),
        Topic(f"{name}CommandStatus", STATUS, ("source", "sessionID"), keep_all=True),
        Topic(f"{name}CommandAckReport", ack, ("source", "sessionID")),
    )


def _report(name: str, member: str, element: Layout, most: int) -> Topic:
    layout = struct_of((member, sequence(element, most)), ("timeStamp", TIME), ("source", GUID))
    return Topic(f"{_SERVICE}{name}", layout, ("source",))


_SERVICE = "UMAA::SO::ResourceAllocation::ResourceAllocation"
ALLOCATION = family(_SERVICE, ALLOCATION_COMMAND)
PRIORITY = family(f"{_SERVICE}Priority", PRIORITY_COMMAND)
CONTROL_REPORT = _report("Report", "controlInfo", CONTROL_INFO, 256)
CONFIG_REPORT = _report("ConfigReport", "resources", DEFINITION, 256)
PRIORITY_REPORT = _report("PriorityReport", "priorities", PRIORITY_INFO, 32)

FAMILIES = {"allocation": ALLOCATION, "priority": PRIORITY}
TOPICS = {
    topic.name: topic
    for topic in [
        *(part for f in FAMILIES.values() for part in (f.command, f.status, f.ack)),
        CONTROL_REPORT, CONFIG_REPORT, PRIORITY_REPORT,
    ]
}
