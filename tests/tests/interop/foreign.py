"""What the tests need of a foreign peer beyond the example: messages in turn, and such as are to be refused."""

import argparse
import json
import sys
import threading
import time

import aldis_content
import aldis_wire as wire
from peer import PING, Peer, say

NODE = "eid400sid1"
TOPIC = "interop.Topic"
KEY = bytes([0, 0, 1, 44])


def cycle(peer: Peer) -> None:
    """Says the same things again and again, until end of input: so nobody has to listen from the start."""
    chunk = wire.instance_chunk(TOPIC, TOPIC, KEY, always_fits=True)
    to_service = wire.instance_chunk("eid9000sid7", TOPIC, KEY, always_fits=True)
    forms = [
        lambda: peer.envelope(TOPIC, "text", TOPIC, content=b"broadcast"),
        lambda: peer.envelope(TOPIC, "text", TOPIC, instance=chunk, content=b"keyed"),
        lambda: peer.envelope(TOPIC, "text", TOPIC, change="dispose", instance=chunk, key=KEY),
        lambda: peer.envelope(TOPIC, "text", TOPIC, change="unregister", instance=chunk, key=KEY),
        lambda: peer.envelope("eid9000.sid7", "lmcp", TOPIC, source_group="g", skipped=3, via=[7], content=b"to one"),
        lambda: peer.envelope("eid9000sid7", "lmcp", TOPIC, change="dispose", instance=to_service, key=KEY),
        lambda: peer.envelope("eid9000sidall", "x-own", TOPIC, priority=2, content=b"to all"),
        lambda: peer.envelope("UMAA::.a:b. é", "cdr", "d", lifespan_left_ms=9, content=b"exact"),
        lambda: peer.envelope("eid90000sid7", "text", TOPIC, content=b"to another entity"),
        lambda: peer.envelope("interop", "text", "interop", content=b"shorter than the prefix"),
    ]
    ended = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), ended.set()), daemon=True).start()
    while not ended.wait(0.05):
        for form in forms:
            peer.send(form())


def node_status(peer: Peer) -> dict:
    (answer,) = peer.call(NODE, "aldis.NodeQuery", within=10)
    return aldis_content.read(answer.content_type, answer.descriptor, answer.content)


def garbage(peer: Peer):
    """Attachments that are no headers, and keys that do not agree with theirs: each is to be refused once."""
    good = peer.envelope(NODE, "aldis", "d")
    key, header = wire.key_of(peer.fleet, good), wire.encode(good)
    root = f"aldis/{peer.fleet}"
    yield key, None
    yield key, b""
    yield key, bytes([wire.VERSION + 1]) + header[1:]
    yield key, bytes([0]) + header[1:]
    yield key, b"\xff" * 64
    yield key, b"no header at all"
    yield key, header + b"\0"
    for end in range(1, len(header)):
        yield key, header[:end]
    yield f"{root}/0/1/-/eid400/sid1", header
    yield f"{root}/300/01/-/eid400/sid1", header
    yield f"{root}/300/5/zz/eid400/sid1", header
    yield f"{root}/@writer/300/5/-/eid400/sid1", header
    yield f"{root}/300/5/-/eid400/sid01", header
    yield key, wire.encode(peer.envelope(NODE, "aldis", "d", change="dispose", key=KEY))
    other = wire.instance_chunk(NODE, "d", b"another key", always_fits=True)
    disposed = peer.envelope(NODE, "aldis", "d", change="unregister", instance=other, key=KEY)
    yield wire.key_of(peer.fleet, disposed), wire.encode(disposed)


def refused(peer: Peer) -> None:
    """Sends garbage, and a ping straight after it. What is lost of sequences so is this peer's own doing."""
    before, count = node_status(peer), 0
    for key, header in garbage(peer):
        peer.session.put(key, b"?", attachment=header)
        count += 1
    begin = time.monotonic()
    (pong,) = peer.call(NODE, PING, within=10, content=b"good")
    seconds = time.monotonic() - begin
    after = node_status(peer)
    counted = after["counters"]["refused_headers"] - before["counters"]["refused_headers"]
    pong = {"descriptor": pong.descriptor, "content": pong.content.decode(), "seconds": seconds}
    say(json.dumps({"sent": count, "counted": counted, "pong": pong, "services": after["services"]}))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--connect", required=True)
    parser.add_argument("--fleet", required=True)
    parser.add_argument("what", choices=["cycle", "refused"])
    args = parser.parse_args()
    peer = Peer(args.connect, args.fleet, 300, 5)
    try:
        {"cycle": cycle, "refused": refused}[args.what](peer)
    finally:
        peer.session.close()


if __name__ == "__main__":
    main()
