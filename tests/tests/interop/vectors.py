"""Headers and keys by WIRE.md: `read` decodes those on standard input and writes them anew, `write SEED COUNT` makes some."""

import json
import random
import sys

import aldis_wire as wire

PIECES = [".", "::", ":", "eid", "sid", "a", "B", "7", "_", "-", "@", "*", "/", "%", "é", "$*"[1:], "?", "#", " ", "海"]


def fields(e: wire.Envelope) -> dict:
    call = {k: v for k, v in vars(e.call).items()} if e.call else None
    key = e.key.hex() if e.key is not None else None
    return dict(vars(e), source=list(e.source), call=call, key=key, content=e.content.decode())


def written(fleet: str, e: wire.Envelope) -> dict:
    return {
        "fields": fields(e),
        "key": wire.key_of(fleet, e),
        "header": wire.encode(e).hex(),
        "deleted": e.change == "dispose",
    }


def read(fleet: str) -> None:
    for line in sys.stdin:
        v = json.loads(line)
        if "prefix" in v:
            prefix, to = v["prefix"], wire.address(v["address"])
            print(json.dumps([wire.subscription(fleet, prefix), wire.matches(prefix, to)]))
            continue
        header = bytes.fromhex(v["header"])
        e = wire.decode(fleet, v["key"], v["deleted"], header, v["fields"]["content"].encode())
        print(json.dumps(written(fleet, e)))


class Random(random.Random):
    """Random parts of envelopes, small and large ones alike."""

    def number(self, bits: int) -> int:
        return self.getrandbits(self.randint(1, bits))

    def one_to(self, bits: int) -> int:
        return max(1, self.number(bits))

    def name(self) -> str:
        while True:
            text = "".join(self.choices(PIECES, k=self.randint(1, 8)))
            if not wire.looks_like_an_id(text):
                return text

    def address(self) -> str:
        entity, service = f"eid{self.one_to(48)}", f"sid{self.one_to(32)}"
        return self.choice([self.name(), self.name(), self.name(), entity, entity + "sidall", entity + service])

    def call(self) -> wire.Call:
        call = wire.Call(self.number(64), self.choice(wire.ROLES))
        if call.role == "request":
            call.time_left_ms = self.number(32)
        elif call.role == "reply":
            call.last = self.random() < 0.5
        else:
            call.reason = self.choice(wire.REFUSALS)
            if wire.REFUSALS.index(call.reason) >= wire.REFUSALS_WITHOUT_TEXT:
                call.text = self.name()
        return call

    def envelope(self) -> wire.Envelope:
        to = self.address()
        is_id = wire.looks_like_an_id(to)
        e = wire.Envelope(
            source=(self.one_to(48), self.one_to(32)),
            address=to,
            content_type=self.choice([*wire.CONTENT_TYPES, self.name()]),
            descriptor=self.name() if is_id or self.random() < 0.5 else to,
            node=self.one_to(48),
            boot=self.number(64),
            sequence=self.one_to(64),
            source_time=self.number(63) * self.choice([-1, 1]),
            source_group=self.choice(["", self.name()]),
            priority=self.randint(1, 7),
            lifespan_left_ms=self.choice([None, self.number(32)]),
            skipped=self.number(32),
            via=[self.one_to(48) for _ in range(self.choice([0, 0, 1, wire.VIA_MAX]))],
            change=self.choice(wire.CHANGES),
            call=self.call() if self.random() < 0.3 else None,
            content=b"content",
        )
        if e.change != "put" or self.random() < 0.5:
            key = self.randbytes(self.choice([0, 4, 16, 17, 40]))
            e.instance = wire.instance_chunk(to, e.descriptor, key, self.random() < 0.5)
            e.key = None if e.change == "put" and e.is_broadcast else key
        return e


def write(fleet: str, seed: int, count: int) -> None:
    draw = Random(seed)
    for _ in range(count):
        print(json.dumps(written(fleet, draw.envelope())))


if __name__ == "__main__":
    if sys.argv[1] == "read":
        read(sys.argv[2])
    else:
        write(sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
