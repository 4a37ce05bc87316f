"""Headers and key expressions of Aldis, read and written by WIRE.md alone. Needs Python 3.9 and nothing else.

    header, key = encode(envelope), key_of("blue", envelope)
    envelope = decode("blue", key, deleted=False, header=header, content=payload)

An address is a text here: a name, or an id in the spelling `eid400sid37`, `eid400sidall` or `eid400`.
"""

import hashlib
import re
from dataclasses import dataclass, field
from typing import List, Optional, Tuple

VERSION = 1
NAME_BYTES_MAX = 512
VIA_MAX = 16
ENTITY_MAX = 2**48 - 1
SERVICE_MAX = 2**32 - 1

CONTENT_TYPES = ["lmcp", "umaa", "cdr", "aldis"]
CHANGES = ["put", "dispose", "unregister"]
ROLES = ["request", "reply", "refused"]
REFUSALS = ["nobody there", "no answer", "not allowed", "not understood", "failed", "overloaded"]
REFUSALS_WITHOUT_TEXT = 2


class WireError(ValueError):
    """The bytes or texts are not what WIRE.md says. A receiver counts this and goes on."""


def check(holds: bool, why: str) -> None:
    if not holds:
        raise WireError(why)


# --- postcard's primitives -------------------------------------------------------------------------------------------


def put_varint(number: int) -> bytes:
    check(0 <= number < 2**64, f"{number} is not an unsigned number of 64 bits")
    out = bytearray()
    while number >= 0x80:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    out.append(number)
    return bytes(out)


def put_signed(number: int) -> bytes:
    return put_varint(number * 2 if number >= 0 else -number * 2 - 1)


def put_bytes(content: bytes) -> bytes:
    return put_varint(len(content)) + content


def put_text(text: str) -> bytes:
    return put_bytes(text.encode())


def put_option(content: Optional[bytes]) -> bytes:
    return b"\0" if content is None else b"\1" + content


class Reader:
    """Takes postcard's primitives from bytes, never past their end."""

    def __init__(self, content: bytes):
        self.content, self.at = bytes(content), 0

    def take(self, count: int) -> bytes:
        check(count <= len(self.content) - self.at, "it ends too early")
        self.at += count
        return self.content[self.at - count : self.at]

    def byte(self) -> int:
        return self.take(1)[0]

    def ordinal(self, count: int) -> int:
        number = self.byte()
        check(number < count, f"{number} is outside 0 to {count - 1}")
        return number

    def present(self) -> bool:
        return self.ordinal(2) == 1

    def varint(self, bits: int = 64) -> int:
        number = 0
        for shift in range(0, 70, 7):
            byte = self.byte()
            number |= (byte & 0x7F) << shift
            if byte < 0x80:
                check(number < 2**bits, f"{number} has more than {bits} bits")
                return number
        raise WireError("a number has more than 64 bits")

    def signed(self) -> int:
        number = self.varint()
        return number >> 1 if number % 2 == 0 else -(number >> 1) - 1

    def bytes(self) -> bytes:
        return self.take(self.varint())

    def text(self) -> str:
        try:
            return self.bytes().decode()
        except UnicodeDecodeError as why:
            raise WireError(f"a text is not UTF-8: {why}") from why

    def end(self) -> None:
        left = len(self.content) - self.at
        check(left == 0, f"{left} bytes follow the end")


# --- names, ids and addresses ----------------------------------------------------------------------------------------

DECIMAL = r"(0|[1-9][0-9]*)"
ID = re.compile(rf"eid{DECIMAL}(?:\.?sid(?:(all)|{DECIMAL}))?")


def entity_id(number: int) -> int:
    check(1 <= number <= ENTITY_MAX, f"{number} is no entity id")
    return number


def service_id(number: int) -> int:
    check(1 <= number <= SERVICE_MAX, f"{number} is no service id")
    return number


def decimal(text: str) -> int:
    check(re.fullmatch(DECIMAL, text) is not None, f"{text!r} is no decimal number without leading zeros")
    return int(text)


def looks_like_an_id(text: str) -> bool:
    return re.match("eid[0-9]", text) is not None


def field_text(text: str, may_be_empty: bool = False) -> str:
    """A text that can stand in an envelope: a descriptor, a source group."""
    check(may_be_empty or text != "", "a name is empty")
    check(len(text.encode()) <= NAME_BYTES_MAX, f"a name has more than {NAME_BYTES_MAX} bytes")
    check("$" not in text and "|" not in text, f"{text!r} holds $ or |")
    return text


def name(text: str) -> str:
    check(not looks_like_an_id(text), f"{text!r} begins like an id")
    return field_text(text)


def address(text: str) -> str:
    """An address in its one spelling: `eid400.sid37` becomes `eid400sid37`."""
    if not looks_like_an_id(text):
        return name(text)
    found = ID.fullmatch(text)
    check(found is not None, f"{text!r} begins like an id and is none")
    entity_id(int(found[1]))
    if found[3] is not None:
        service_id(int(found[3]))
    return text.replace(".", "")


# --- names as chunks of a key ----------------------------------------------------------------------------------------


def separator_at(text: bytes, at: int) -> int:
    """How many bytes of a separator stand there."""
    return 1 if text[at : at + 1] == b"." else 2 if text[at : at + 2] == b"::" else 0


def escape(text: str) -> str:
    rest, out, at, chunk_is_empty = text.encode(), "", 0, True
    while at < len(rest):
        width = separator_at(rest, at)
        if width and not chunk_is_empty and at + width < len(rest):
            out, chunk_is_empty = out + "/", True
        else:
            for byte in rest[at : at + max(width, 1)]:
                plain = width == 0 and re.fullmatch("[A-Za-z0-9_-]", chr(byte))
                out += chr(byte) if plain else f"%{byte:02X}"
            chunk_is_empty = False
        at += max(width, 1)
    return out


def unescape(chunks: str, separator: str) -> str:
    parts = re.split("%([0-9A-F]{2})", chunks.replace("/", separator))
    try:
        raw = b"".join(p.encode() if i % 2 == 0 else bytes([int(p, 16)]) for i, p in enumerate(parts))
        return raw.decode()
    except UnicodeDecodeError as why:
        raise WireError(f"{chunks!r} is not UTF-8 once its escapes are read") from why


def spelling(text: str) -> int:
    """0: separators are dots or there are none; 1: they are `::`; 2: both occur, and the exact text must follow."""
    raw, at, seen = text.encode(), 0, set()
    while at < len(raw):
        width = separator_at(raw, at)
        seen.add(width)
        at += max(width, 1)
    return 2 if {1, 2} <= seen else 1 if 2 in seen else 0


def address_chunks(to: str) -> str:
    return to.replace("sid", "/sid") if looks_like_an_id(to) else escape(to)


# --- subscriptions ---------------------------------------------------------------------------------------------------


def subscription(fleet: str, prefix: str, unregisters: bool = False) -> str:
    """The key expression that a prefix declares. It may match too much: `matches` decides."""
    root = f"aldis/{fleet}/@writer/*/*/*" if unregisters else f"aldis/{fleet}/*/*/*"
    if looks_like_an_id(prefix):
        to = address(prefix)
        return f"{root}/{address_chunks(to)}" + ("" if "sid" in to else "/**")
    certain = prefix.rstrip(".:")
    return f"{root}/{escape(certain)}$*/**" if certain else f"{root}/**"


def matches(prefix: str, to: str) -> bool:
    """Whether a subscription with this prefix receives what is sent to this address."""
    if looks_like_an_id(prefix):
        wanted = address(prefix)
        return to == wanted or ("sid" not in wanted and looks_like_an_id(to) and to.startswith(wanted + "sid"))
    return (to.replace("sid", ".sid") if looks_like_an_id(to) else to).startswith(prefix)


# --- envelopes -------------------------------------------------------------------------------------------------------


@dataclass
class Call:
    """A part in a call: `time_left_ms` of a request, `last` of a reply, `reason` and its text of a refusal."""

    id: int
    role: str
    time_left_ms: int = 0
    last: bool = True
    reason: str = ""
    text: str = ""


@dataclass
class Envelope:
    source: Tuple[int, int]
    address: str
    content_type: str
    descriptor: str
    node: int
    boot: int
    sequence: int
    source_time: int
    source_group: str = ""
    priority: int = 5
    lifespan_left_ms: Optional[int] = None
    skipped: int = 0
    via: List[int] = field(default_factory=list)
    change: str = "put"
    instance: Optional[str] = None
    """The instance chunk of the key: 32 lower-case hexadecimal digits. `instance_chunk` makes it."""
    key: Optional[bytes] = None
    """The serialized key, where it is known."""
    call: Optional[Call] = None
    content: bytes = b""

    @property
    def is_broadcast(self) -> bool:
        return self.address == self.descriptor and not looks_like_an_id(self.address)


def key_hash(key: bytes, always_fits: bool) -> str:
    """DDS's key hash: the key padded with zeros where every key of its type fits 16 bytes, otherwise its MD5."""
    return key.ljust(16, b"\0").hex() if always_fits and len(key) <= 16 else hashlib.md5(key).hexdigest()


def instance_chunk(to: str, descriptor: str, key: bytes, always_fits: bool) -> str:
    if to == descriptor:
        return key_hash(key, always_fits)
    return hashlib.md5(descriptor.encode() + b"\0" + key).hexdigest()


def key_of(fleet: str, e: Envelope) -> str:
    """The key expression that an envelope is put on, or deleted from."""
    space = "@writer/" if e.change == "unregister" else ""
    return f"aldis/{fleet}/{space}{e.source[0]}/{e.source[1]}/{e.instance or '-'}/{address_chunks(e.address)}"


def encode(e: Envelope) -> bytes:
    """The header: the attachment of the Zenoh put or delete."""
    spelled = 0 if looks_like_an_id(e.address) else spelling(e.address)
    out = bytes([VERSION, spelled]) + (put_text(e.address) if spelled == 2 else b"")
    if e.content_type in CONTENT_TYPES:
        out += bytes([CONTENT_TYPES.index(e.content_type)])
    else:
        out += bytes([len(CONTENT_TYPES)]) + put_text(name(e.content_type))
    out += put_option(None if e.is_broadcast else put_text(field_text(e.descriptor)))
    out += put_text(field_text(e.source_group, may_be_empty=True))
    out += put_varint(entity_id(e.node)) + put_varint(e.boot) + bytes([e.priority])
    # From here on it differs from sample to sample.
    out += put_varint(e.sequence) + put_signed(e.source_time)
    out += put_option(None if e.lifespan_left_ms is None else put_varint(e.lifespan_left_ms))
    out += put_varint(e.skipped)
    out += put_varint(len(e.via)) + b"".join(put_varint(entity_id(node)) for node in e.via)
    out += bytes([CHANGES.index(e.change)])
    in_content = e.change == "put" and e.is_broadcast
    out += put_option(None if e.key is None or in_content else put_bytes(e.key))
    return out + put_option(None if e.call is None else encode_call(e.call))


def encode_call(call: Call) -> bytes:
    out = put_varint(call.id) + bytes([ROLES.index(call.role)])
    if call.role == "request":
        return out + put_varint(call.time_left_ms)
    if call.role == "reply":
        return out + bytes([call.last])
    reason = REFUSALS.index(call.reason)
    return out + bytes([reason]) + (put_text(call.text) if reason >= REFUSALS_WITHOUT_TEXT else b"")


def decode(fleet: str, key_expression: str, deleted: bool, header: bytes, content: bytes = b"") -> Envelope:
    """An envelope from a Zenoh sample. Raises WireError where key and header are not ours or do not agree."""
    on_writer, source, instance, chunks = parse_key(fleet, key_expression)
    r = Reader(header)
    check(len(header) > 0, "the sample has no header")
    version = r.byte()
    check(version == VERSION, f"header version {version} is not {VERSION}")
    spelled = r.ordinal(3)
    to = read_address(chunks, spelled, r.text() if spelled == 2 else "")
    content_type = r.ordinal(len(CONTENT_TYPES) + 1)
    content_type = (CONTENT_TYPES + [None])[content_type] or name(r.text())
    if r.present():
        descriptor = field_text(r.text())
    else:
        check(not looks_like_an_id(to), "the descriptor is missing, and the address is no name")
        descriptor = to
    e = Envelope(
        source, to, content_type, descriptor, source_group=field_text(r.text(), may_be_empty=True),
        node=entity_id(r.varint()), boot=r.varint(), priority=r.byte(), sequence=r.varint(), source_time=r.signed(),
        content=content, instance=instance,
    )
    check(1 <= e.priority <= 7, f"{e.priority} is no priority")
    check(e.sequence >= 1, "streams count from 1")
    e.lifespan_left_ms = r.varint(32) if r.present() else None
    e.skipped = r.varint(32)
    passed = r.varint()
    check(passed <= VIA_MAX, f"{passed} nodes passed")
    e.via = [entity_id(r.varint()) for _ in range(passed)]
    e.change = CHANGES[r.ordinal(len(CHANGES))]
    agrees = deleted == (e.change == "dispose") and on_writer == (e.change == "unregister")
    check(agrees, f"key and header disagree about a {e.change}")
    e.key = r.bytes() if r.present() else None
    check(e.key is None or instance_fits(e), "the instance is not that of the serialized key")
    check(e.change == "put" or instance is not None, f"a {e.change} without an instance")
    e.call = decode_call(r) if r.present() else None
    r.end()
    return e


def decode_call(r: Reader) -> Call:
    call = Call(r.varint(), ROLES[r.ordinal(len(ROLES))])
    if call.role == "request":
        call.time_left_ms = r.varint(32)
    elif call.role == "reply":
        call.last = r.present()
    else:
        reason = r.ordinal(len(REFUSALS))
        call.reason, call.text = REFUSALS[reason], r.text() if reason >= REFUSALS_WITHOUT_TEXT else ""
    return call


def parse_key(fleet: str, key_expression: str) -> Tuple[bool, Tuple[int, int], Optional[str], str]:
    """On @writer or not, the source, the instance and the chunks of the address."""
    root = f"aldis/{fleet}/"
    check(key_expression.startswith(root), f"{key_expression!r} is not a key of fleet {fleet}")
    rest = key_expression[len(root) :]
    on_writer = rest.startswith("@writer/")
    chunks = (rest[len("@writer/") :] if on_writer else rest).split("/", 3)
    check(len(chunks) == 4 and not chunks[0].startswith("@"), f"{key_expression!r} is no key of an envelope")
    source = entity_id(decimal(chunks[0])), service_id(decimal(chunks[1]))
    instance = None if chunks[2] == "-" else chunks[2]
    check(instance is None or re.fullmatch("[0-9a-f]{32}", instance) is not None, f"{instance!r} is no instance")
    return on_writer, source, instance, chunks[3]


def read_address(chunks: str, spelled: int, exact: str) -> str:
    if looks_like_an_id(chunks):
        to = address(chunks.replace("/", "", 1))
    else:
        to = name(exact if spelled == 2 else unescape(chunks, [".", "::"][spelled]))
    check(address_chunks(to) == chunks, f"the chunks {chunks!r} are not those of {to!r}")
    return to


def instance_fits(e: Envelope) -> bool:
    return e.instance in [instance_chunk(e.address, e.descriptor, e.key, fits) for fits in (True, False)]
