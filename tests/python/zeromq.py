"""How many messages a node passes between foreign ZeroMQ sockets, and how many it loses.

    python tests/python/zeromq.py target/release/aldis [--messages 100000]

Needs the package pyzmq. One process pushes, another subscribes, the node is between them; `direct` is the same two processes
with nothing between. Prints one JSON object for each framing and rate. Rate 0 is as fast as it goes.
"""
import argparse
import json
import multiprocessing
import pathlib
import socket
import subprocess
import tempfile
import time

import zmq

HEAD = [b"afrl.cmasi.KeyValuePair", b"lmcp", b"afrl.cmasi.KeyValuePair", b"", b"1", b"61"]
PAYLOAD_BYTES = 255
WITHIN_MS = 20_000

CONFIG = """
name = "measured"
fleet = "measured"
entities = [1]
[bus]
listen = ["tcp/127.0.0.1:{bus}"]
[[bridge]]
kind = "uxas-zmq"
name = "zmq"
service = 21
framing = "{framing}"
pull = "127.0.0.1:{push}"
publish = "127.0.0.1:{subscribe}"
"""


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def message(framing, number):
    payload = b"%d" % number
    payload = payload.rjust(PAYLOAD_BYTES, b"$")
    if framing == "single":
        return [HEAD[0] + b"$" + b"|".join(HEAD[1:]) + b"$" + payload]
    return [*HEAD, payload]


def send(framing, port, count, rate, told, begin):
    out = zmq.Context().socket(zmq.PUSH)
    out.setsockopt(zmq.SNDTIMEO, WITHIN_MS)
    out.connect(f"tcp://127.0.0.1:{port}")
    while not begin.is_set():
        out.send_multipart(message(framing, 0))
        begin.wait(0.05)
    messages = [message(framing, number) for number in range(1, count + 1)]
    start = time.perf_counter()
    for number, parts in enumerate(messages):
        if rate:
            ahead = number / rate - (time.perf_counter() - start)
            if ahead > 0.001:
                time.sleep(ahead)
        out.send_multipart(parts, copy=True)
    told.put(("sent_per_s", round(count / (time.perf_counter() - start))))
    out.close(linger=WITHIN_MS)


def receive(framing, port, count, direct, told, begin):
    into = zmq.Context().socket(zmq.PULL if direct else zmq.SUB)
    into.setsockopt(zmq.RCVTIMEO, WITHIN_MS)
    if direct:
        into.bind(f"tcp://127.0.0.1:{port}")
    else:
        into.setsockopt(zmq.SUBSCRIBE, b"")
        into.connect(f"tcp://127.0.0.1:{port}")
    first = message(framing, 0)
    into.recv_multipart()
    begin.set()
    expected, came, altered, gaps, start = 1, 0, 0, 0, None
    try:
        while expected <= count:
            parts = into.recv_multipart()
            if parts == first:
                continue
            start = start or time.perf_counter()
            number = int(parts[-1][-10:].lstrip(b"$"))
            altered += len(parts) != len(first) or len(parts[-1]) != len(first[-1])
            gaps += number - expected
            expected, came = number + 1, came + 1
    except zmq.Again:
        pass
    took = time.perf_counter() - (start or 0)
    told.put(("received", {"came": came, "lost": count - came, "altered": altered, "gaps": gaps,
                           "delivered_per_s": round(came / took)}))


def flood(framing, ports, count, rate, direct):
    told, begin = multiprocessing.Queue(), multiprocessing.Event()
    ends = [
        multiprocessing.Process(target=receive, args=(framing, ports[1], count, direct, told, begin)),
        multiprocessing.Process(target=send, args=(framing, ports[0], count, rate, told, begin)),
    ]
    for end in ends:
        end.start()
    figures = dict(told.get() for _ in ends)
    for end in ends:
        end.join()
    return {"framing": framing, "rate": rate, "through": "direct" if direct else "node",
            **figures.pop("received"), **figures}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("aldis")
    parser.add_argument("--messages", type=int, default=100_000)
    parser.add_argument("--rate", type=int, default=40_000)
    asked = parser.parse_args()
    for framing in ("single", "multipart"):
        for rate in (asked.rate, 0):
            port = free_port()
            print(json.dumps(flood(framing, [port, port], asked.messages, rate, True)), flush=True)
            ports = [free_port(), free_port()]
            with tempfile.TemporaryDirectory() as folder:
                file = pathlib.Path(folder) / "node.toml"
                file.write_text(CONFIG.format(bus=free_port(), framing=framing, push=ports[0], subscribe=ports[1]))
                node = subprocess.Popen([asked.aldis, "run", file], stderr=subprocess.DEVNULL)
                try:
                    print(json.dumps(flood(framing, ports, asked.messages, rate, False)), flush=True)
                finally:
                    node.terminate()
                    node.wait(10)


if __name__ == "__main__":
    main()
