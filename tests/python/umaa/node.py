"""A node of the fleet: one session, the services that run on it, and what nodes tell one another. One thread does all."""

import json
import queue
import sys
import threading
import time
from typing import Callable, Dict, List, Optional, Tuple

import zenoh

import aldis_wire as wire
from aldis_wire import Reader, put_text, put_varint

from .retained import LEASE, Journal, Readers, Sample, Stream, Writers, put_list, put_stream, take_list, take_stream
from .samples import TOPICS, Topic

ANNOUNCE_EVERY = 2.5
ANNOUNCE_AGAIN = 0.5
HISTORY_WITHIN = 5.0
NODE_SERVICE = 1


class Node:
    """`services` get what they subscribe to: `heard(topic, change, key, sample, envelope)`."""

    def __init__(self, connect: str, fleet: str, entity: int, journal: Optional[str]) -> None:
        config = zenoh.Config()
        for name, value in [
            ("mode", '"client"'),
            ("connect/endpoints", json.dumps([connect])),
            ("scouting/multicast/enabled", "false"),
            ("scouting/gossip/enabled", "false"),
        ]:
            config.insert_json5(name, value)
        self.session = zenoh.open(config)
        self.fleet, self.entity, self.boot = fleet, entity, time.time_ns()
        self.inbox: queue.Queue = queue.Queue()
        self.journal = Journal(journal)
        self.writers, self.readers = Writers(), Readers()
        self.sequences: Dict[Stream, int] = {}
        self.told = 0
        self.services: List = []
        self.prefixes: List[str] = []
        self.alive = set()
        self.answered: Dict[int, int] = {}
        self.number = 0
        self.announce_at = 0.0
        self.history_until: Optional[float] = None
        self.withholds_confirmations = False
        self.ended = False
        self.declared: List = []
        self.timers: List[Tuple[float, Callable]] = []

    # --- start and end -----------------------------------------------------------------------------------------------

    def start(self, services: List) -> None:
        """Subscribes, shows the services, and announces what is read here. What the fleet retains then comes."""
        self.services = services
        self.prefixes = sorted({prefix for service in services for prefix in service.subscriptions()})
        self.recall()
        to_node = f"eid{self.entity}/sid{NODE_SERVICE}"
        root = f"aldis/{self.fleet}"
        expressions = [wire.subscription(self.fleet, f"eid{self.entity}")]
        for prefix in self.prefixes:
            expressions += [wire.subscription(self.fleet, prefix, unregisters) for unregisters in (False, True)]
        expressions += [f"{root}/@state/*/*/*/{to_node}", f"{root}/@ack/*/*/*/{to_node}"]
        expressions.append(f"{root}/@ack/*/*/*/aldis/dds/Readers")
        self.declared += [self.session.declare_subscriber(each, self.on_sample) for each in expressions]
        liveliness = self.session.liveliness()
        everybody = f"{root}/@alive/*/*"
        self.declared.append(liveliness.declare_subscriber(everybody, self.on_token))
        for reply in liveliness.get(everybody, timeout=3.0):
            if reply.ok:
                self.inbox.put(("token", str(reply.ok.key_expr), True))
        for sid in [NODE_SERVICE, *(service.sid for service in services)]:
            self.declared.append(liveliness.declare_token(f"{root}/@alive/{self.entity}/{sid}"))
        self.inbox.put(("joined",))

    def recall(self) -> None:
        """What a former life left is retained by this one, and told to the service whose it was."""
        for (sid, name, instance), (key, content) in list(self.journal.alive.items()):
            topic = TOPICS[name]
            stream = (self.entity, sid, name)
            self.sequences[stream] = self.sequences.get(stream, 0) + 1
            content = bytes.fromhex(content)
            sample = Sample(self.sequences[stream], time.time_ns(), "put", instance, bytes.fromhex(key), content)
            self.writers.wrote(time.monotonic(), stream, topic.keep_all, sample)
            for service in self.services:
                if service.sid == sid:
                    service.recovered(topic, topic.decode(content))

    def leave(self) -> None:
        """Nobody here reads any more; then the session ends, once all that was written has gone out."""
        self.prefixes = []
        self.announce(None)
        self.ended = True

    # --- what comes in -----------------------------------------------------------------------------------------------

    def on_sample(self, s) -> None:
        header = s.attachment.to_bytes() if s.attachment is not None else b""
        self.inbox.put(("sample", str(s.key_expr), s.kind == zenoh.SampleKind.DELETE, header, s.payload.to_bytes()))

    def on_token(self, s) -> None:
        self.inbox.put(("token", str(s.key_expr), s.kind == zenoh.SampleKind.PUT))

    def run(self, orders: Callable) -> None:
        """Handles what comes until it leaves. Lines of standard input are orders; their end is the order to leave."""
        threading.Thread(target=self.read_orders, daemon=True).start()
        while not self.ended:
            try:
                event = self.inbox.get(timeout=max(0.0, self.next_deadline() - time.monotonic()))
            except queue.Empty:
                event = None
            try:
                self.event(event, orders)
            except wire.WireError as why:
                print(f"refused: {why}: {event}", file=sys.stderr)
            self.due()
        self.session.close()

    def read_orders(self) -> None:
        for line in sys.stdin:
            self.inbox.put(("order", json.loads(line)))
        self.inbox.put(("order", {"do": "leave"}))

    def event(self, event, orders: Callable) -> None:
        if event is None:
            return
        kind, *rest = event
        if kind == "sample":
            self.sample(*rest)
        elif kind == "order":
            orders(rest[0])
        elif kind == "joined":
            self.history_until = time.monotonic() + HISTORY_WITHIN
            self.announce(None)
        elif kind == "token":
            _, entity, sid = rest[0].rsplit("/", 2)
            self.token((int(entity), int(sid)), rest[1])

    def token(self, source: Tuple[int, int], alive: bool) -> None:
        (self.alive.add if alive else self.alive.discard)(source)
        if alive and source[1] == NODE_SERVICE and source[0] != self.entity and self.number:
            self.announce(source[0])
        if not alive:
            for service in self.services:
                service.lost(source)

    def sample(self, key: str, deleted: bool, header: bytes, content: bytes) -> None:
        now = time.monotonic()
        for space in ("@state", "@ack"):
            key = key.replace(f"aldis/{self.fleet}/{space}/", f"aldis/{self.fleet}/", 1)
        e = wire.decode(self.fleet, key, deleted, header, content)
        if (e.node, e.boot) == (self.entity, self.boot):
            return
        if e.content_type == "aldis" and e.descriptor.startswith("aldis.dds."):
            self.among_nodes(now, e)
        elif e.call is not None:
            self.answer(e)
        elif e.is_broadcast and e.address in TOPICS and self.reads(e.address):
            self.hand_over(self.readers.sample(now, e))

    def reads(self, address: str) -> bool:
        return any(wire.matches(prefix, address) for prefix in self.prefixes)

    def among_nodes(self, now: float, e: wire.Envelope) -> None:
        who, r = (e.node, e.boot), Reader(e.content)
        if e.descriptor == "aldis.dds.Readers":
            announced = self.writers.announced(now, who, r)
            if announced is not None:
                number, is_new = announced
                self.tell("@state", e.node, "aldis.dds.Streams", self.writers.ends(who, number))
                if is_new and self.number:
                    self.announce(e.node)
            return
        if r.varint() != self.boot:
            return
        if e.descriptor == "aldis.dds.Streams":
            answers = r.varint() if r.present() else None
            ends = take_list(r, lambda: (take_stream(r), r.varint()))
            self.readers.ends(now, who, [end for end in ends if end[0][2] in TOPICS and self.reads(end[0][2])])
            if answers is not None:
                self.answered[e.node] = answers
        elif e.descriptor == "aldis.dds.Ask":
            told = self.writers.asked(who, take_stream(r), r.varint(), r.varint())
            if told is not None:
                self.tell("@state", e.node, "aldis.dds.History", told)
        elif e.descriptor == "aldis.dds.History":
            self.hand_over(self.readers.told(now, who, r))
        elif e.descriptor == "aldis.dds.Confirm":
            self.writers.confirmed(now, who, take_list(r, lambda: (take_stream(r), r.varint())))

    def hand_over(self, ready: List[wire.Envelope]) -> None:
        for e in ready:
            topic = TOPICS[e.address]
            sample = topic.decode(e.content) if e.change == "put" else None
            key = topic.key(sample) if sample is not None else e.key
            if sample is not None and topic.instance(key) != e.instance:
                print(f"refused: {e.instance} is not the instance of {sample}", file=sys.stderr)
                continue
            members = topic.read_key(key) if key is not None else None
            for service in self.services:
                if any(wire.matches(prefix, e.address) for prefix in service.subscriptions()):
                    service.heard(topic, e.change, members, sample, e)

    def answer(self, request: wire.Envelope) -> None:
        """Every service answers a ping; nothing else is understood here."""
        if request.call.role != "request":
            return
        entity = f"eid{self.entity}"
        for sid in [NODE_SERVICE, *(service.sid for service in self.services)]:
            if request.address not in (entity, f"{entity}sidall", f"{entity}sid{sid}"):
                continue
            is_ping = request.descriptor == "aldis.Ping"
            call = wire.Call(request.call.id, "reply" if is_ping else "refused")
            if not is_ping:
                call.reason, call.text = "not understood", request.descriptor
            descriptor = "aldis.Pong" if is_ping else request.descriptor
            content = request.content if is_ping else b""
            to = "eid{}sid{}".format(*request.source)
            stream = (self.entity, sid, to)
            self.sequences[stream] = self.sequences.get(stream, 0) + 1
            e = wire.Envelope(
                (self.entity, sid), to, request.content_type, descriptor, self.entity, self.boot, self.sequences[stream],
                time.time_ns(), call=call, content=content,
            )
            self.put(wire.key_of(self.fleet, e), e)

    # --- what goes out -----------------------------------------------------------------------------------------------

    def put(self, key: str, e: wire.Envelope) -> None:
        how = {"attachment": wire.encode(e), "congestion_control": zenoh.CongestionControl.BLOCK}
        if e.change == "dispose":
            self.session.delete(key, **how)
        else:
            self.session.put(key, e.content, **how)

    def write(self, sid: int, topic: Topic, change: str, key: bytes, content: bytes = b"") -> Tuple[Stream, int]:
        """Puts, disposes or unregisters an instance; what is retained of it follows. Gives its stream and number."""
        stream, instance = (self.entity, sid, topic.name), topic.instance(key)
        self.journal.write(sid, topic.name, change, instance, key, content)
        sequence = self.sequences[stream] = self.sequences.get(stream, 0) + 1
        at = time.time_ns()
        self.writers.wrote(time.monotonic(), stream, topic.keep_all, Sample(sequence, at, change, instance, key, content))
        e = wire.Envelope(
            (self.entity, sid), topic.name, "umaa", topic.name, self.entity, self.boot, sequence, at, change=change,
            instance=instance, key=key, content=content,
        )
        self.put(wire.key_of(self.fleet, e), e)
        return stream, sequence

    def tell(self, space: str, to: Optional[int], descriptor: str, content: bytes) -> None:
        """Tells something to one node, or to all. These envelopes have one count of their own."""
        self.told += 1
        address = descriptor if to is None else f"eid{to}sid{NODE_SERVICE}"
        e = wire.Envelope(
            (self.entity, NODE_SERVICE), address, "aldis", descriptor, self.entity, self.boot, self.told, time.time_ns(),
            content=content,
        )
        data = wire.key_of(self.fleet, e)
        root = f"aldis/{self.fleet}/"
        self.put(f"{root}{space}/{data[len(root):]}", e)

    def announce(self, to: Optional[int]) -> None:
        if to is None:
            self.number += 1
            self.announce_at = time.monotonic() + ANNOUNCE_AGAIN
        content = put_varint(self.number) + b"\1" + put_varint(int(LEASE * 1000)) + put_list(self.prefixes, put_text)
        self.tell("@ack", to, "aldis.dds.Readers", content)

    # --- time --------------------------------------------------------------------------------------------------------

    def after(self, seconds: float, act: Callable) -> None:
        self.timers.append((time.monotonic() + seconds, act))

    def next_deadline(self) -> float:
        times = [at for at, _ in self.timers] + ([self.announce_at] if self.number else [])
        times += [followed.ask_at for followed in self.readers.streams.values() if followed.ask_at is not None]
        times += [reading.remind for reading in self.writers.readers.values() if reading.remind is not None]
        times += [self.history_until] if self.history_until is not None else []
        return min(times, default=time.monotonic() + 1.0)

    def due(self) -> None:
        now = time.monotonic()
        for timer in [timer for timer in self.timers if timer[0] <= now]:
            self.timers.remove(timer)
            timer[1]()
        for who in self.writers.due(now):
            self.tell("@state", who[0], "aldis.dds.Streams", self.writers.ends(who, None))
        for (node, _), content in self.readers.due(now):
            self.tell("@ack", node, "aldis.dds.Ask", content)
        if not self.withholds_confirmations:
            unconfirmed, self.readers.unconfirmed = self.readers.unconfirmed, {}
            for who, upto in unconfirmed.items():
                content = put_varint(who[1]) + put_list(upto, lambda end: put_stream(end[0]) + put_varint(end[1]))
                self.tell("@ack", who[0], "aldis.dds.Confirm", content)
        if self.number and self.announce_at <= now and not self.ended:
            self.announce_again(now)
        if self.history_until is not None and (self.history_is_complete() or self.history_until <= now):
            self.history_until = None
            for service in self.services:
                service.begin()
        for service in self.services:
            service.settled()

    def announce_again(self, now: float) -> None:
        content = put_varint(self.number) + b"\1" + put_varint(int(LEASE * 1000)) + put_list(self.prefixes, put_text)
        self.tell("@ack", None, "aldis.dds.Readers", content)
        self.announce_at = now + (ANNOUNCE_EVERY if self.everybody_answered() else ANNOUNCE_AGAIN)

    def everybody_answered(self) -> bool:
        others = {entity for entity, sid in self.alive if sid == NODE_SERVICE and entity != self.entity}
        return bool(others) and all(self.answered.get(other, 0) >= self.number for other in others)

    def history_is_complete(self) -> bool:
        return self.everybody_answered() and self.readers.is_complete()
