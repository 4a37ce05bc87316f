"""A DDS peer that does what it is told: one JSON array a line on standard input, JSON lines on standard output.

    ["writer", TOPIC, TYPE, {qos}]      a writer, autodispose off
    ["write", TOPIC, {member: value}, TIME]     members left out are zero; TIME in nanoseconds, or null for now
    ["dispose" | "unregister", TOPIC, {key members}, TIME]
    ["reader", TOPIC, TYPE, {qos}]      tells each change as [TOPIC, state, {members}, source time]
    ["matched", TOPIC, N]               waits until N endpoints match at least, then says so
    ["close", TOPIC]
"""

import dataclasses
import json
import sys
import threading
import typing

from cyclonedds.core import Qos, Policy, InstanceState, WaitSet, ReadCondition, SampleState, ViewState
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct, IdlUnion
from cyclonedds.pub import DataWriter, Publisher
from cyclonedds.sub import DataReader, Subscriber
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from plant_types import Plant
from umaa_types import Types

CONFIG = """<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast><Interfaces>
<NetworkInterface address="127.0.0.1"/></Interfaces></General><Discovery><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>60</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""


def say(value):
    sys.stdout.write(json.dumps(value) + "\n")
    sys.stdout.flush()


def zero(kind):
    """The value of a member that is not given."""
    if typing.get_origin(kind) is typing.Union:
        return None
    if dataclasses.is_dataclass(kind):
        return build(kind, {})
    if hasattr(kind, "__members__"):
        return list(kind)[0]
    base = typing.get_origin(kind)
    text = str(kind)
    if "array[" in text:
        return [0] * 16
    if "sequence[" in text:
        return []
    if "bounded_str" in text or kind is str:
        return ""
    return 0.0 if "float" in text else 0


def plain_kind(kind):
    if typing.get_origin(kind) is typing.Union:
        return next(part for part in typing.get_args(kind) if part is not type(None))
    return kind


def value_of(kind, given):
    kind = plain_kind(kind)
    if dataclasses.is_dataclass(kind) or isinstance(kind, type) and issubclass(kind, IdlUnion):
        return build(kind, given)
    if hasattr(kind, "__members__"):
        return kind[given]
    if isinstance(given, list):
        return [value_of(typing.get_args(kind)[1].subtype, each) for each in given]
    return bytes.fromhex(given) if isinstance(given, str) and "array[" in str(kind) else given


def hints(kind):
    return typing.get_type_hints(kind, include_extras=True)


def build(kind, given):
    if issubclass(kind, IdlUnion):
        return kind(**given)
    members = hints(kind)
    return kind(**{name: value_of(member, given[name]) if given.get(name) is not None else zero(member)
                   for name, member in members.items()})


def tell(value):
    if value is None or isinstance(value, (int, float, str)) and not hasattr(value, "name"):
        return value
    if hasattr(value, "name"):
        return value.name
    if isinstance(value, IdlUnion):
        names = [name for name in hints(type(value)) if getattr(value, name, None) is not None]
        return {name: tell(getattr(value, name)) for name in names}
    if isinstance(value, IdlStruct):
        return {name: tell(getattr(value, name)) for name in hints(type(value))}
    if isinstance(value, (bytes, bytearray)) or len(value) == 16 and all(isinstance(x, int) for x in value):
        return bytes(value).hex()
    return [tell(each) for each in value]


def qos(given, writes):
    policies = [
        Policy.Reliability.BestEffort if given.get("best_effort") else Policy.Reliability.Reliable(duration(seconds=10)),
        getattr(Policy.Durability, given.get("durability", "TransientLocal")),
        Policy.History.KeepAll if given.get("keep_all") else Policy.History.KeepLast(given.get("keep_last", 1)),
        Policy.DestinationOrder.BySourceTimestamp,
    ]
    if given.get("topic_access"):
        policies.append(Policy.PresentationAccessScope.Topic(False, True))
    if given.get("partition"):
        policies.append(Policy.Partition([given["partition"]]))
    if writes:
        policies.append(Policy.WriterDataLifecycle(autodispose=given.get("autodispose", False)))
    return Qos(*policies)


STATES = {InstanceState.Alive: "alive", InstanceState.NotAliveDisposed: "disposed",
          InstanceState.NotAliveNoWriters: "no_writers"}


class Peer:
    def __init__(self, domain):
        self.domain = Domain(domain, CONFIG)
        self.participant = DomainParticipant(domain)
        self.known, self.writers, self.readers, self.types = {}, {}, {}, {}

    def kind(self, name):
        version, extensibility, topic = name.split(" ", 2)
        if (version, extensibility) not in self.known:
            kinds = Plant if version == "plant" else Types
            self.known[version, extensibility] = kinds(version, extensibility)
        return self.known[version, extensibility].topics[topic]

    def writer(self, topic, name, given):
        kind = self.types[topic] = self.kind(name)
        wanted = qos(given, True)
        self.writers[topic] = DataWriter(Publisher(self.participant, wanted), Topic(self.participant, topic, kind), wanted)
        say(["writer", topic])

    def reader(self, topic, name, given):
        kind = self.kind(name)
        wanted = qos(given, False)
        reader = DataReader(Subscriber(self.participant, wanted), Topic(self.participant, topic, kind), wanted)
        self.readers[topic] = reader
        say(["reader", topic])
        threading.Thread(target=self.follow, args=(topic, reader), daemon=True).start()

    def follow(self, topic, reader):
        waits = WaitSet(self.participant)
        waits.attach(ReadCondition(reader, SampleState.Any | ViewState.Any | InstanceState.Any))
        while topic in self.readers:
            waits.wait(duration(milliseconds=200))
            for sample in reader.take(N=1000):
                info = sample.sample_info
                state = STATES[info.instance_state]
                if info.valid_data:
                    say([topic, "alive", tell(sample), info.source_timestamp])
                    if state == "alive":
                        continue
                    say([topic, state, keys(sample), info.source_timestamp])
                else:
                    say([topic, state, keys(sample), info.source_timestamp])

    def change(self, what, topic, given, at):
        writer = self.writers[topic]
        sample = build(self.types[topic], given)
        args = (sample,) if at is None else (sample, at)
        getattr(writer, what)(*args)

    def matched(self, topic, count):
        def now():
            if topic in self.writers:
                return len(self.writers[topic].get_matched_subscriptions())
            return len(self.readers[topic].get_matched_publications())
        pause = threading.Event()
        while now() < count:
            pause.wait(0.01)
        say(["matched", topic, count])

    def run(self):
        say(["ready"])
        for line in sys.stdin:
            what, *rest = json.loads(line)
            if what in ("write", "dispose", "unregister"):
                topic, given, at = rest
                name = {"write": "write", "dispose": "dispose", "unregister": "unregister_instance"}[what]
                self.change(name, topic, given, at)
            elif what == "close":
                self.writers.pop(rest[0], None)
                self.readers.pop(rest[0], None)
            else:
                getattr(self, what)(*rest)


def keys(sample):
    """The key members, which alone mean something of a sample without data."""
    sample = getattr(sample, "key_sample", sample)
    annotated = getattr(type(sample), "__idl_field_annotations__", {})
    names = [name for name, notes in annotated.items() if notes.get("key")]
    return {name: tell(getattr(sample, name)) for name in names}


Peer(int(sys.argv[1])).run()
