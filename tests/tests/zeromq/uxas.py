"""A UxAS as ZeroMQ sees it: it pushes messages and subscribes to all, or binds and is connected to.

Commands come on standard input, one JSON array a line; what happens is written as one JSON value a line.
"""
import json
import sys
import threading
import time

import zmq

WITHIN_MS = 20_000


def say(value):
    print(json.dumps(value), flush=True)


def frames(framing, number, size=255):
    payload = str(number).encode().rjust(size, b"$")
    texts = [b"afrl.cmasi.KeyValuePair", b"lmcp", b"afrl.cmasi.KeyValuePair", b"", b"1", b"61"]
    if framing == "single":
        return [b"$".join([texts[0], b"|".join(texts[1:]), payload])]
    return texts + [payload]


class Uxas:
    def __init__(self, kind, framing, out, into, topic):
        self.framing = framing
        context = zmq.Context()
        self.push = context.socket(zmq.PUSH if kind == "connect" else zmq.PUB)
        self.sub = context.socket(zmq.SUB if kind == "connect" else zmq.PULL)
        for socket in (self.push, self.sub):
            socket.setsockopt(zmq.LINGER, 0)
        self.sub.setsockopt(zmq.RCVTIMEO, WITHIN_MS)
        self.push.setsockopt(zmq.SNDTIMEO, WITHIN_MS)
        if kind == "connect":
            self.sub.setsockopt(zmq.SUBSCRIBE, topic.encode())
            self.push.connect(out)
            self.sub.connect(into)
        else:
            self.push.bind(out)
            self.sub.bind(into)

    def send(self, text):
        """Sends frames given as text."""
        self.push.send_multipart([frame.encode("latin-1") for frame in text])

    def receive(self):
        """The next message, as text."""
        say([frame.decode("latin-1") for frame in self.sub.recv_multipart()])

    def warm(self):
        """Sends messages until one comes back: a subscription takes effect some time after the connection. Says how many."""
        sent, marked = 0, False
        while not marked:
            self.push.send_multipart(frames(self.framing, 0))
            sent += 1
            marked = self.sub.poll(50) > 0
        self.push.send_multipart(frames(self.framing, 1))
        while self.sub.recv_multipart() != frames(self.framing, 1):
            pass
        say(sent + 1)

    def flood(self, count, rate):
        """Sends messages, so many a second or as fast as they go, and counts what comes back in order."""

        def send():
            start = time.perf_counter()
            for number in range(count):
                if rate:
                    while time.perf_counter() - start < number / rate:
                        pass
                self.push.send_multipart(frames(self.framing, number))

        sender = threading.Thread(target=send)
        sender.start()
        start, came, altered = time.perf_counter(), 0, 0
        try:
            for number in range(count):
                altered += self.sub.recv_multipart() != frames(self.framing, number)
                came += 1
        except zmq.Again:
            pass
        took = time.perf_counter() - start
        sender.join()
        say({"came": came, "altered": altered, "per_second": round(came / took)})


def main():
    uxas = Uxas(*sys.argv[1:])
    say("ready")
    for line in sys.stdin:
        name, *args = json.loads(line)
        getattr(uxas, name)(*args)


main()
