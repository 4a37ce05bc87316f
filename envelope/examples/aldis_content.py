"""Contents of Aldis that WIRE.md lays out: HealthReport and LogReport (`umaa`), NodeStatus (`aldis`), and GUIDs."""

import hashlib
import uuid
from typing import Optional, Tuple

from aldis_wire import Reader, WireError, check

ERROR_CODES = ["ACTUATOR", "FILESYS", "NONE", "POWER", "PROCESSOR", "RAM", "ROM", "SENSOR", "SOFTWARE"]
ERROR_CONDITIONS = ["ERROR", "FAIL", "INFO", "NONE", "WARN"]
LOG_LEVELS = ["ERROR", "INFORMATION", "WARNING"]
NAMESPACE = uuid.UUID("6b1d43f2-5a0e-4c77-9d0b-a1d15f1a6e55")


def fleet_hash(fleet: str) -> int:
    """The first 42 bits of the MD5 of the fleet's name."""
    return int.from_bytes(hashlib.md5(fleet.encode()).digest()[:8], "big") >> 22


def service_guid(fleet: str, entity: int, service: int) -> uuid.UUID:
    high, low = fleet_hash(fleet) >> 30, fleet_hash(fleet) & 0x3FFFFFFF
    return uuid.UUID(int=entity << 80 | 8 << 76 | high << 64 | 0b10 << 62 | service << 30 | low)


def service_of(fleet: str, guid: uuid.UUID) -> Optional[Tuple[int, int]]:
    """The entity and service that a readable GUID of this fleet names."""
    entity, service = guid.int >> 80, guid.int >> 30 & 0xFFFFFFFF
    return (entity, service) if service_guid(fleet, entity, service) == guid else None


def resource_guid(fleet: str, entity: int, resource: str) -> uuid.UUID:
    """The GUID of what is no service: a disk, the bus."""
    return uuid.uuid5(NAMESPACE, f"{fleet}/eid{entity}/{resource}")


def date_time(r: Reader) -> int:
    """A DateTime, as nanoseconds since the POSIX epoch."""
    seconds, nanoseconds = r.signed(), r.signed()
    check(0 <= nanoseconds < 10**9, f"{nanoseconds} nanoseconds in a DateTime")
    return seconds * 10**9 + nanoseconds


def guid(r: Reader) -> uuid.UUID:
    return uuid.UUID(bytes=r.take(16))


def health_report(r: Reader) -> dict:
    return {
        "code": ERROR_CODES[r.ordinal(len(ERROR_CODES))],
        "log_time": date_time(r),
        "severity": ERROR_CONDITIONS[r.ordinal(len(ERROR_CONDITIONS))],
        "status": r.text(),
        "time_stamp": date_time(r),
        "source": guid(r),
        "resource_id": guid(r),
    }


def log_report(r: Reader) -> dict:
    return {
        "entry": r.text(),
        "level": LOG_LEVELS[r.ordinal(len(LOG_LEVELS))],
        "time_stamp": date_time(r),
        "source": guid(r),
    }


def node_status(r: Reader) -> dict:
    def many(one):
        return [one() for _ in range(r.varint())]

    def service():
        return {"source": (r.varint(), r.varint()), "name": r.text(), "state": r.text()}

    return {
        "node": r.varint(),
        "entities": many(r.varint),
        "boot": r.varint(),
        "uptime_ms": r.varint(),
        "services": many(service),
        "counters": dict(many(lambda: (r.text(), r.varint()))),
    }


READERS = {
    ("umaa", "UMAA::SO::HealthReport::HealthReport"): health_report,
    ("umaa", "UMAA::SO::LogReport::LogReport"): log_report,
    ("aldis", "aldis.NodeStatus"): node_status,
}


def read(content_type: str, descriptor: str, content: bytes) -> Optional[dict]:
    """A content whose layout is known here; None for any other, which is carried and never guessed at."""
    reader = READERS.get((content_type, descriptor))
    if reader is None or content == b"":
        return None
    r = Reader(content)
    value = reader(r)
    r.end()
    return value
