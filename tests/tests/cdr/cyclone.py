"""Types of UMAA Support Operations as a user of Cyclone DDS writes them by hand, from the ICD and the public differences of 6.0.

Reads one JSON object a line, writes one: {"version", "extensibility", "type", "members"} gives the sample's bytes in XCDR1 and
XCDR2 and in both byte orders, its serialized key and its key hash; {"read": hexadecimal digits, …} gives its members.
"""

import dataclasses
import enum
import json
import sys
import uuid

from cyclonedds.idl import IdlEnum, make_idl_enum, make_idl_struct
from cyclonedds.idl._support import Endianness
from cyclonedds.idl.types import array, bounded_str, float64, int32, int64, sequence, uint8
from typing import Optional

SO = "UMAA::SO::"
RA = SO + "ResourceAllocation::ResourceAllocation"
TEXT = bounded_str[4095]
GUID = array[uint8, 16]


def names(text):
    return {name: value for value, name in enumerate(text.split())}


def build(version, extensibility):
    """All types of a version by their names."""
    made = {}

    def define(name, fields, keys=""):
        made[name] = struct(name, fields, keys, extensibility)
        return made[name]

    code = enumeration("ErrorCodeEnumType", "ACTUATOR FILESYS NONE POWER PROCESSOR RAM ROM SENSOR SOFTWARE")
    condition = enumeration("ErrorConditionEnumType", "ERROR FAIL INFO NONE WARN")
    level = enumeration("LogLevelEnumType", "ERROR INFORMATION WARNING")
    state = enumeration("CommandStatusEnumType", "CANCELED COMMANDED COMPLETED EXECUTING FAILED ISSUED")
    reason = enumeration(
        "CommandStatusReasonEnumType",
        "CANCELED INTERRUPTED OBJECTIVE_FAILED RESOURCE_FAILED RESOURCE_REJECTED SERVICE_FAILED SUCCEEDED TIMEOUT "
        "UPDATED VALIDATION_FAILED",
    )
    date = define("UMAA::Common::Measurement::DateTime", {"seconds": int64, "nanoseconds": int32})
    newer = version == "6.0"
    who = define("UMAA::Common::IdentifierType", {"id": GUID, "parentID": GUID}) if newer else GUID

    if newer:
        health = {"logTime": date, "severity": condition, "status": Optional[TEXT], "timeStamp": date,
                  "source": who, "code": code, "resourceID": who}
        define(SO + "HealthReport::HealthReportType", health, "source code resourceID")
    else:
        health = {"code": code, "logTime": date, "severity": condition, "status": TEXT, "timeStamp": date,
                  "source": who, "resourceID": who}
        define(SO + "HealthReport::HealthReportType", health, "source resourceID")
    define(SO + "LogReport::LogReportType", {"entry": TEXT, "level": level, "timeStamp": date, "source": who}, "source")

    head = {"timeStamp": date, "source": who, "sessionID": GUID, "destination": who}
    priorities = sequence[who, 100]
    commands = {
        "": {"duration": Optional[float64], "resourceID": who, **head},
        "Priority": {"priorities": priorities, "resourceID": who, **head},
    }
    for kind, members in commands.items():
        command = define(f"{RA}{kind}CommandType", members, "source sessionID destination")
        status = {"timeStamp": date, "source": who, "sessionID": GUID, "commandStatus": state,
                  "commandStatusReason": reason, "logMessage": TEXT}
        define(f"{RA}{kind}CommandStatusType", status, "source sessionID")
        ack = {"command": command, "timeStamp": date, "source": who, "sessionID": GUID}
        define(f"{RA}{kind}CommandAckReportType", ack, "source sessionID")

    session = define(RA + "ControlSession", {"controllingConsumer": who, "endTime": Optional[date]})
    info = define(RA + "ControlInfo", {"controlSession": Optional[session], "resourceID": who}, "resourceID")
    define(RA + "ReportType", {"controlInfo": sequence[info, 256], "timeStamp": date, "source": who}, "source")
    definition = define(RA + "DefinitionType", {"relatedSources": priorities, "resourceID": who}, "resourceID")
    if newer:
        metadata = define("UMAA::Common::LargeSetMetadata", {
            "setID": GUID, "updateElementID": GUID, "updateElementTimestamp": Optional[date], "size": int32})
        define(RA + "ConfigReportType", {"timeStamp": date, "source": who, "resourcesSetMetadata": metadata}, "source")
        define(RA + "ConfigReportTypeResourcesSetElement", {
            "element": definition, "setID": GUID, "elementID": GUID, "elementTimestamp": date}, "setID elementID")
    else:
        resources = sequence[definition, 256]
        define(RA + "ConfigReportType", {"resources": resources, "timeStamp": date, "source": who}, "source")
    listed = sequence[who, 64 if newer else 100]
    priority = define(RA + "PriorityInfo", {"priorities": listed, "resourceID": who}, "resourceID")
    reports = sequence[priority, 24 if newer else 32]
    define(RA + "PriorityReportType", {"priorities": reports, "timeStamp": date, "source": who}, "source")
    return made


def enumeration(name, values):
    return make_idl_enum(name, "UMAA.Common.MaritimeEnumeration." + name, names(values))


def struct(name, fields, keys, extensibility):
    made = make_idl_struct(name.replace("::", "_"), name.replace("::", "."), dict(fields))
    for key in keys.split():
        made.__idl_field_annotations__.setdefault(key, {})["key"] = True
    made.__idl_annotations__["extensibility"] = extensibility
    return made


def of_json(kind, value):
    """A value of a type from what JSON says of it."""
    kind = resolved(kind)
    if value is None:
        return None
    if dataclasses.is_dataclass(kind):
        hints = {field.name: field.type for field in dataclasses.fields(kind)}
        return kind(**{name: of_json(hints[name], value[name]) for name in hints})
    if isinstance(kind, type) and issubclass(kind, IdlEnum):
        return kind[value]
    if isinstance(kind, array):
        return list(uuid.UUID(value).bytes)
    if isinstance(kind, sequence):
        return [of_json(kind.subtype, element) for element in value]
    return value


def to_json(value):
    if dataclasses.is_dataclass(value):
        return {field.name: to_json(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, enum.Enum):
        return value.name
    if isinstance(value, (bytes, bytearray)) or isinstance(value, (list, tuple)) and len(value) == 16 and isinstance(value[0], int):
        return str(uuid.UUID(bytes=bytes(value)))
    if isinstance(value, (list, tuple)):
        return [to_json(element) for element in value]
    return value


def resolved(kind):
    """The type without `Optional` and the annotations of the binding."""
    while True:
        if hasattr(kind, "__metadata__"):
            metadata = [given for given in kind.__metadata__ if isinstance(given, (array, sequence, bounded_str))]
            kind = metadata[0] if metadata else kind.__origin__
        elif getattr(kind, "__args__", None) and type(None) in kind.__args__:
            kind = next(argument for argument in kind.__args__ if argument is not type(None))
        else:
            return kind


def main():
    known = {}
    for line in sys.stdin:
        asked = json.loads(line)
        at = (asked["version"], asked["extensibility"])
        if at not in known:
            known[at] = build(*at)
        kind = known[at][asked["type"]]
        if "read" in asked:
            told = to_json(kind.deserialize(bytes.fromhex(asked["read"])))
        else:
            sample = of_json(kind, asked["members"])
            told = {
                f"xcdr{2 if second else 1}-{order.name.lower()}": sample.serialize(endianness=order, use_version_2=second).hex()
                for second in (False, True) for order in (Endianness.Little, Endianness.Big)
            }
            told["key"] = sample.serialize_key(endianness=Endianness.Big, use_version_2=True).hex()
        print(json.dumps(told), flush=True)


if __name__ == "__main__":
    main()
