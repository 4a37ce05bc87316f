"""The UMAA types of both versions, from the tables of the public IDL, final or appendable."""

from cyclonedds.idl import make_idl_enum, make_idl_struct
from cyclonedds.idl import annotations, types
from typing import Optional

GUID = types.array[types.byte, 16]


class Types:
    """The types of one version: "5.2.1" or "6.0"; every one final, or every one appendable."""

    def __init__(self, version, extensibility):
        self.version, self.annotate = version, getattr(annotations, extensibility)
        self.made = {}
        self.six = version == "6.0"
        self.text = types.bounded_str[4095]
        self.time = self.struct(
            "UMAA::Common::Measurement::DateTime", [("seconds", types.int64), ("nanoseconds", types.int32)]
        )
        self.status = self.enumeration(
            "UMAA::Common::MaritimeEnumeration::CommandStatusEnumModule::CommandStatusEnumType",
            "CANCELED COMMANDED COMPLETED EXECUTING FAILED ISSUED",
        )
        self.reason = self.enumeration(
            "UMAA::Common::MaritimeEnumeration::CommandStatusReasonEnumModule::CommandStatusReasonEnumType",
            "CANCELED INTERRUPTED OBJECTIVE_FAILED RESOURCE_FAILED RESOURCE_REJECTED SERVICE_FAILED SUCCEEDED "
            "TIMEOUT UPDATED VALIDATION_FAILED",
        )
        self.error_code = self.enumeration(
            "UMAA::Common::MaritimeEnumeration::ErrorCodeEnumModule::ErrorCodeEnumType",
            "ACTUATOR FILESYS NONE POWER PROCESSOR RAM ROM SENSOR SOFTWARE",
        )
        self.condition = self.enumeration(
            "UMAA::Common::MaritimeEnumeration::ErrorConditionEnumModule::ErrorConditionEnumType",
            "ERROR FAIL INFO NONE WARN",
        )
        self.level = self.enumeration(
            "UMAA::Common::MaritimeEnumeration::LogLevelEnumModule::LogLevelEnumType", "ERROR INFORMATION WARNING"
        )
        self.identifier = GUID
        if self.six:
            self.identifier = self.struct("UMAA::Common::IdentifierType", [("id", GUID), ("parentID", GUID)])
        self.topics = self.declare()

    def struct(self, name, members, keys=(), optional=()):
        fields = {member: Optional[kind] if member in optional else kind for member, kind in members}
        notes = {member: {"key": True} for member in keys}
        made = make_idl_struct(name.split("::")[-1], name, fields, field_annotations=notes)
        self.made[name] = self.annotate(made)
        return self.made[name]

    def enumeration(self, name, literals):
        values = {literal: number for number, literal in enumerate(literals.split())}
        self.made[name] = self.annotate(make_idl_enum(name.split("::")[-1], name, values))
        return self.made[name]

    def topic(self, service, name, members, keys, optional=()):
        topic = f"UMAA::SO::{service}::{name}"
        made = self.struct(topic + "Type", members, keys, optional)
        return (topic + "Type" if self.six else topic), made

    def declare(self):
        time, ident, text = self.time, self.identifier, self.text
        health = [("logTime", time), ("severity", self.condition), ("status", text), ("timeStamp", time),
                  ("source", ident)]
        if self.six:
            health += [("code", self.error_code), ("resourceID", ident)]
            keys, optional = ("source", "code", "resourceID"), ("status",)
        else:
            health = [("code", self.error_code)] + health + [("resourceID", ident)]
            keys, optional = ("source", "resourceID"), ()
        topics = [self.topic("HealthReport", "HealthReport", health, keys, optional)]
        log = [("entry", text), ("level", self.level), ("timeStamp", time), ("source", ident)]
        topics.append(self.topic("LogReport", "LogReport", log, ("source",)))
        session = [("source", ident), ("sessionID", GUID)]
        ids = ("source", "sessionID")
        command = [("duration", types.float64), ("resourceID", ident), ("timeStamp", time)] + session
        command += [("destination", ident)]
        name = "ResourceAllocationCommand"
        allocation = self.topic("ResourceAllocation", name, command, ids + ("destination",), ("duration",))
        topics.append(allocation)
        status = [("timeStamp", time)] + session
        status += [("commandStatus", self.status), ("commandStatusReason", self.reason), ("logMessage", text)]
        topics.append(self.topic("ResourceAllocation", name + "Status", status, ids))
        ack = [("command", allocation[1]), ("timeStamp", time)] + session
        topics.append(self.topic("ResourceAllocation", name + "AckReport", ack, ids))
        control_session = self.struct(
            "UMAA::SO::ResourceAllocation::ResourceAllocationControlSession",
            [("controllingConsumer", ident), ("endTime", time)], (), ("endTime",),
        )
        control = self.struct(
            "UMAA::SO::ResourceAllocation::ResourceAllocationControlInfo",
            [("controlSession", control_session), ("resourceID", ident)], ("resourceID",), ("controlSession",),
        )
        report = [("controlInfo", types.sequence[control, 256]), ("timeStamp", time), ("source", ident)]
        topics.append(self.topic("ResourceAllocation", "ResourceAllocationReport", report, ("source",)))
        return dict(topics + self.configuration() + self.priorities(session, status))

    def configuration(self):
        """The resources of a provider: inline in 5.2.1, a large set in 6.0."""
        name = "ResourceAllocationConfigReport"
        end = [("timeStamp", self.time), ("source", self.identifier)]
        definition = self.struct(
            "UMAA::SO::ResourceAllocation::ResourceAllocationDefinitionType",
            [("relatedSources", types.sequence[self.identifier, 100]), ("resourceID", self.identifier)], ("resourceID",),
        )
        if not self.six:
            resources = [("resources", types.sequence[definition, 256])]
            return [self.topic("ResourceAllocation", name, resources + end, ("source",))]
        metadata = self.struct(
            "UMAA::Common::LargeSetMetadata",
            [("setID", GUID), ("updateElementID", GUID), ("updateElementTimestamp", self.time), ("size", types.int32)],
            (), ("updateElementTimestamp",),
        )
        element = [("element", definition), ("setID", GUID), ("elementID", GUID), ("elementTimestamp", self.time)]
        topic = f"UMAA::SO::ResourceAllocation::{name}TypeResourcesSetElement"
        report = self.topic("ResourceAllocation", name, end + [("resourcesSetMetadata", metadata)], ("source",))
        return [report, (topic, self.struct(topic, element, ("setID", "elementID")))]

    def priorities(self, session, status):
        """Who may have a resource."""
        name, ids = "ResourceAllocationPriorityCommand", ("source", "sessionID")
        infos, count = (24, 64) if self.six else (32, 100)
        command = [("priorities", types.sequence[self.identifier, 100]), ("resourceID", self.identifier),
                   ("timeStamp", self.time)] + session + [("destination", self.identifier)]
        command = self.topic("ResourceAllocation", name, command, ids + ("destination",))
        status = self.topic("ResourceAllocation", name + "Status", status, ids)
        ack = [("command", command[1]), ("timeStamp", self.time)] + session
        ack = self.topic("ResourceAllocation", name + "AckReport", ack, ids)
        info = self.struct(
            "UMAA::SO::ResourceAllocation::ResourceAllocationPriorityInfo",
            [("priorities", types.sequence[self.identifier, count]), ("resourceID", self.identifier)], ("resourceID",),
        )
        report = [("priorities", types.sequence[info, infos]), ("timeStamp", self.time), ("source", self.identifier)]
        report = self.topic("ResourceAllocation", "ResourceAllocationPriorityReport", report, ("source",))
        return [command, status, ack, report]
