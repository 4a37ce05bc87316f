"""What a writer keeps for others and what a reader misses (WIRE.md, Retained topics). Neither knows the bus.

A stream is `(eid, sid, topic)`; a participant, one life of a node, is `(node, boot)`.
"""

import json
import os
from dataclasses import dataclass, field
from typing import Dict, List, Optional, Tuple

import aldis_wire as wire
from aldis_wire import Reader, put_bytes, put_option, put_signed, put_text, put_varint

Stream = Tuple[int, int, str]
Participant = Tuple[int, int]

LEASE = 10.0
REMIND_AFTER = 0.3
REMIND_MAX = 5.0
ASK_AGAIN = 0.25
PAGE = 256


def put_stream(stream: Stream) -> bytes:
    return put_varint(stream[0]) + put_varint(stream[1]) + put_text(stream[2])


def take_stream(r: Reader) -> Stream:
    return r.varint(), r.varint(32), r.text()


def put_list(items: list, put) -> bytes:
    return put_varint(len(items)) + b"".join(map(put, items))


def take_list(r: Reader, take) -> list:
    return [take() for _ in range(r.varint())]


@dataclass
class Sample:
    """A sample of a stream, as it is told to whoever misses it."""

    sequence: int
    source_time: int
    change: str
    instance: str
    key: bytes
    content: bytes

    def put(self) -> bytes:
        out = put_varint(self.sequence) + put_signed(self.source_time)
        out += put_varint(wire.CHANGES.index(self.change)) + put_option(bytes.fromhex(self.instance))
        return out + put_option(put_bytes(self.key)) + put_bytes(self.content)

    @staticmethod
    def take(r: Reader) -> dict:
        told = {"sequence": r.varint(), "source_time": r.signed(), "change": wire.CHANGES[r.ordinal(len(wire.CHANGES))]}
        told["instance"] = r.take(16).hex() if r.present() else None
        told["key"] = r.bytes() if r.present() else None
        return dict(told, content=r.bytes())


@dataclass
class Reading:
    """A participant that reads here."""

    reliable: bool
    lease: float
    prefixes: List[str]
    heard: float
    confirmed: Dict[Stream, int] = field(default_factory=dict)
    remind: Optional[float] = None
    wait: float = REMIND_AFTER

    def reads(self, stream: Stream) -> bool:
        return any(wire.matches(prefix, stream[2]) for prefix in self.prefixes)

    def has(self, stream: Stream) -> int:
        return self.confirmed.get(stream, 0)


@dataclass
class Written:
    """What is kept of an own stream."""

    keep_all: bool
    last: int = 0
    samples: List[Sample] = field(default_factory=list)

    def add(self, sample: Sample, had_by_all: int) -> None:
        """A sample supersedes those of its instance: at once where the last is enough, once all have them where it ends."""
        ends = {s.instance: s.sequence for s in [*self.samples, sample] if s.change != "put"}
        self.samples.append(sample)
        self.last = sample.sequence

        def is_needed(kept: Sample) -> bool:
            if kept is sample:
                return True
            if kept.instance == sample.instance and not self.keep_all:
                return False
            end = ends.get(kept.instance, 0)
            return kept.sequence >= end or end > had_by_all

        self.samples = [kept for kept in self.samples if is_needed(kept)]


class Writers:
    """The own streams, and who reads them."""

    def __init__(self) -> None:
        self.streams: Dict[Stream, Written] = {}
        self.readers: Dict[Participant, Reading] = {}

    def wrote(self, now: float, stream: Stream, keep_all: bool, sample: Sample) -> None:
        written = self.streams.setdefault(stream, Written(keep_all))
        readers = [reading for reading in self.readers.values() if reading.reads(stream)]
        written.add(sample, min((reading.has(stream) for reading in readers), default=sample.sequence))
        for reading in readers:
            if reading.remind is None:
                reading.remind, reading.wait = now + REMIND_AFTER, REMIND_AFTER

    def announced(self, now: float, who: Participant, r: Reader) -> Optional[Tuple[int, bool]]:
        """The number of the announcement, and whether the participant is new; None where it leaves."""
        number, reliable, lease = r.varint(), r.present(), min(r.varint(32) / 1000, 60.0)
        prefixes = take_list(r, r.text)
        r.end()
        if not prefixes:
            self.readers.pop(who, None)
            return None
        if reliable:
            for known in [k for k in self.readers if k[0] == who[0] and k[1] < who[1] and self.readers[k].reliable]:
                del self.readers[known]
        known = self.readers.get(who)
        if known is None:
            self.readers[who] = Reading(reliable, lease, prefixes, now)
        else:
            known.reliable, known.lease, known.prefixes, known.heard = reliable, lease, prefixes, now
        return number, known is None

    def ends(self, who: Participant, answers: Optional[int]) -> bytes:
        """Where the streams stand that a participant reads."""
        reading = self.readers[who]
        ends = [(name, written.last) for name, written in self.streams.items() if reading.reads(name)]
        out = put_varint(who[1]) + put_option(None if answers is None else put_varint(answers))
        return out + put_list(ends, lambda end: put_stream(end[0]) + put_varint(end[1]))

    def asked(self, who: Participant, stream: Stream, first: int, last: int) -> Optional[bytes]:
        written = self.streams.get(stream)
        if written is None:
            return None
        last = min(last, written.last)
        told = [sample for sample in written.samples if first <= sample.sequence <= last]
        if len(told) > PAGE:
            told = told[:PAGE]
            last = told[-1].sequence
        out = put_varint(who[1]) + put_stream(stream) + put_text("umaa") + put_text("")
        out += put_varint(first) + put_varint(last) + b"\0"
        return out + put_list(told, Sample.put)

    def confirmed(self, now: float, who: Participant, upto: List[Tuple[Stream, int]]) -> None:
        reading = self.readers.get(who)
        if reading is None:
            return
        reading.heard = now
        for stream, sequence in upto:
            reading.confirmed[stream] = max(reading.has(stream), sequence)
        if not self.behind(reading):
            reading.remind = None

    def behind(self, reading: Reading) -> bool:
        return any(reading.reads(name) and reading.has(name) < written.last for name, written in self.streams.items())

    def due(self, now: float) -> List[Participant]:
        """Forgets whose lease has run out; gives those that are to be reminded of the ends of their streams."""
        self.readers = {who: reading for who, reading in self.readers.items() if reading.heard + reading.lease > now}
        late = [who for who, reading in self.readers.items() if reading.remind is not None and reading.remind <= now]
        for who in late:
            reading = self.readers[who]
            reading.wait = min(reading.wait * 2, REMIND_MAX)
            reading.remind = now + reading.wait
        return late

    def missing(self, stream: Stream, sequence: int) -> List[Participant]:
        """The reliable readers of a stream that have not confirmed a sample."""
        readers = [(who, reading) for who, reading in self.readers.items() if reading.reliable and reading.reads(stream)]
        return [who for who, reading in readers if reading.has(stream) < sequence]


@dataclass
class Followed:
    """A stream of somebody else: each sample is handed over once, in the order of its writer."""

    boot: int
    next: int = 1
    end: int = 0
    held: Dict[int, wire.Envelope] = field(default_factory=dict)
    ask_at: Optional[float] = None
    wait: float = ASK_AGAIN

    def missing(self) -> Optional[int]:
        """The last number of the first hole."""
        last = min(self.held) - 1 if self.held else self.end
        return last if last >= self.next else None

    def take_ready(self) -> List[wire.Envelope]:
        ready = []
        while self.held:
            first = min(self.held)
            if first - self.held[first].skipped > self.next:
                break
            ready.append(self.held.pop(first))
            self.next = first + 1
        return ready


class Readers:
    """The streams of others, by node and stream."""

    def __init__(self) -> None:
        self.streams: Dict[Tuple[int, Stream], Followed] = {}
        self.unconfirmed: Dict[Participant, List[Tuple[Stream, int]]] = {}

    def follow(self, who: Participant, stream: Stream) -> Optional[Followed]:
        """A later life of a node begins its streams anew; what an earlier one says is passed over."""
        known = self.streams.get((who[0], stream))
        if known is not None and known.boot > who[1]:
            return None
        if known is None or known.boot < who[1]:
            known = self.streams[who[0], stream] = Followed(who[1])
        return known

    def advance(self, who: Participant, stream: Stream, followed: Followed, now: float) -> List[wire.Envelope]:
        """What can be handed over now; what is still missing is to be asked for at once."""
        ready = followed.take_ready()
        self.unconfirmed.setdefault(who, []).append((stream, followed.next - 1))
        if followed.missing() is None:
            followed.ask_at = None
        elif followed.ask_at is None or ready:
            followed.ask_at, followed.wait = now, ASK_AGAIN
        return ready

    def sample(self, now: float, e: wire.Envelope) -> List[wire.Envelope]:
        who, stream = (e.node, e.boot), (*e.source, e.address)
        followed = self.follow(who, stream)
        if followed is None or e.sequence < followed.next:
            return []
        followed.end = max(followed.end, e.sequence)
        followed.held[e.sequence] = e
        return self.advance(who, stream, followed, now)

    def ends(self, now: float, who: Participant, ends: List[Tuple[Stream, int]]) -> None:
        for stream, end in ends:
            followed = self.follow(who, stream)
            if followed is not None:
                followed.end = max(followed.end, end)
                self.advance(who, stream, followed, now)

    def told(self, now: float, who: Participant, r: Reader) -> List[wire.Envelope]:
        stream, content_type, group = take_stream(r), r.text(), r.text()
        first, last, _broken = r.varint(), r.varint(), r.present()
        samples = take_list(r, lambda: Sample.take(r))
        r.end()
        followed = self.streams.get((who[0], stream))
        stale = followed is None or followed.boot != who[1] or first > followed.next or last < followed.next
        if stale or last > followed.end:
            return []
        for told in samples:
            if followed.next <= told["sequence"] <= last:
                e = wire.Envelope(
                    (stream[0], stream[1]), stream[2], content_type, stream[2], who[0], who[1], source_group=group, **told
                )
                followed.held.setdefault(e.sequence, e)
        ready = [followed.held.pop(sequence) for sequence in sorted(followed.held) if sequence <= last]
        followed.next, followed.ask_at = last + 1, None
        return ready + self.advance(who, stream, followed, now)

    def due(self, now: float) -> List[Tuple[Participant, bytes]]:
        """What is to be asked for now: the node's life and the content of the request."""
        asks = []
        for (node, stream), followed in self.streams.items():
            last = followed.missing()
            if last is not None and followed.ask_at is not None and followed.ask_at <= now:
                followed.ask_at, followed.wait = now + followed.wait, followed.wait * 2
                content = put_varint(followed.boot) + put_stream(stream)
                asks.append(((node, followed.boot), content + put_varint(followed.next) + put_varint(last)))
        return asks

    def is_complete(self) -> bool:
        return all(followed.missing() is None for followed in self.streams.values())


class Journal:
    """What outlives the process: the last sample of every own instance that is there, in a file."""

    def __init__(self, path: Optional[str]) -> None:
        self.path, self.alive = path, {}
        if path is not None and os.path.exists(path):
            with open(path, encoding="utf-8") as file:
                self.alive = {(sid, topic, instance): rest for sid, topic, instance, *rest in json.load(file)}

    def write(self, sid: int, topic: str, change: str, instance: str, key: bytes, content: bytes) -> None:
        """Before the sample goes out."""
        if change == "put":
            self.alive[sid, topic, instance] = [key.hex(), content.hex()]
        else:
            self.alive.pop((sid, topic, instance), None)
        if self.path is not None:
            draft = f"{self.path}.draft"
            with open(draft, "w", encoding="utf-8") as file:
                json.dump([[*place, *rest] for place, rest in self.alive.items()], file)
            os.replace(draft, self.path)
