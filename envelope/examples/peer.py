"""A peer of an Aldis fleet on the command line, in Python alone: pip install eclipse-zenoh==1.10.2

    python peer.py sub                                   everything, one JSON object a line
    python peer.py sub UMAA::SO eid300 --count 3         what begins so, or goes to entity 300; three messages
    python peer.py pub weather --content-type text --text calm
    python peer.py pub track --key 0000012c --change dispose
    python peer.py ping eid400sid1                       is it there, and how far away?
    python peer.py --as 300 --service 5 serve            be a service that answers pings, until end of input
"""

import argparse
import json
import queue
import sys
import threading
import time

import zenoh

import aldis_content
import aldis_wire as wire

PING, PONG = "aldis.Ping", "aldis.Pong"


class Peer:
    """One service of one entity, with a session of its own."""

    def __init__(self, connect: str, fleet: str, entity: int, service: int):
        config = zenoh.Config()
        for key, value in [
            ("mode", '"client"'),
            ("connect/endpoints", json.dumps([connect])),
            ("scouting/multicast/enabled", "false"),
            ("scouting/gossip/enabled", "false"),
        ]:
            config.insert_json5(key, value)
        self.session = zenoh.open(config)
        self.fleet, self.entity, self.service = fleet, entity, service
        # A later start is larger: the wall clock, where no number of starts is kept.
        self.boot = time.time_ns()
        self.sequences, self.calls, self.lock = {}, 0, threading.Lock()

    def envelope(self, to: str, content_type: str, descriptor: str, **more) -> wire.Envelope:
        """An envelope with this peer's next stamp. A stream is all that it sends to one address."""
        to = wire.address(to)
        with self.lock:
            self.sequences[to] = self.sequences.get(to, 0) + 1
        return wire.Envelope(
            (self.entity, self.service), to, content_type, descriptor, self.entity, self.boot, self.sequences[to],
            time.time_ns(), **more,
        )

    def send(self, e: wire.Envelope) -> None:
        key, header = wire.key_of(self.fleet, e), wire.encode(e)
        how = {"attachment": header, "congestion_control": zenoh.CongestionControl.BLOCK}
        if e.change == "dispose":
            self.session.delete(key, **how)
        else:
            self.session.put(key, e.content, **how)

    def subscribe(self, prefix: str, take):
        """Has `take` called for each envelope that the prefix receives; what is none of ours is told and left out."""

        def sample(s):
            header = s.attachment.to_bytes() if s.attachment is not None else b""
            deleted = s.kind == zenoh.SampleKind.DELETE
            try:
                e = wire.decode(self.fleet, str(s.key_expr), deleted, header, s.payload.to_bytes())
            except wire.WireError as why:
                print(f"refused: {why}", file=sys.stderr)
                return
            if wire.matches(prefix, e.address):
                take(e)

        expressions = [wire.subscription(self.fleet, prefix, unregisters) for unregisters in (False, True)]
        return [self.session.declare_subscriber(expression, sample) for expression in expressions]

    def is_alive(self, to: str) -> bool:
        """Whether somebody shows a token at an id. Of mailboxes, tokens know nothing."""
        if not wire.looks_like_an_id(to):
            return True
        entity, _, service = to[len("eid") :].partition("sid")
        service = "*" if service in ("", "all") else service
        key = f"aldis/{self.fleet}/@alive/{entity}/{service}"
        return any(reply.ok for reply in self.session.liveliness().get(key, timeout=3.0))

    def call(self, to: str, descriptor: str, within: float, content: bytes = b"", content_type: str = "aldis"):
        """Gives each answer as it comes: until the last, where one service is called, or until the time is over."""
        to = wire.address(to)
        if not self.is_alive(to):
            return
        self.calls += 1
        call = wire.Call(self.calls, "request", time_left_ms=int(within * 1000))
        answers = queue.Queue()
        own = f"eid{self.entity}sid{self.service}"
        subscribers = self.subscribe(own, answers.put)
        deadline = time.monotonic() + within
        self.send(self.envelope(to, content_type, descriptor, call=call, content=content))
        try:
            while (left := deadline - time.monotonic()) > 0:
                answer = answers.get(timeout=left)
                if answer.call is None or answer.call.id != call.id or answer.call.role == "request":
                    continue
                yield answer
                one_is_asked = to == "eid{}sid{}".format(*answer.source)
                if one_is_asked and (answer.call.role == "refused" or answer.call.last):
                    return
        except queue.Empty:
            return
        finally:
            for subscriber in subscribers:
                subscriber.undeclare()

    def serve(self):
        """Shows this service's token, and answers what is addressed to it, to all services or to the entity."""
        token = self.session.liveliness().declare_token(f"aldis/{self.fleet}/@alive/{self.entity}/{self.service}")
        return token, self.subscribe(f"eid{self.entity}", self.answer)

    def answer(self, request: wire.Envelope) -> None:
        entity = f"eid{self.entity}"
        mine = request.address in (entity, f"{entity}sidall", f"{entity}sid{self.service}")
        if not mine or request.call is None or request.call.role != "request":
            return
        to = "eid{}sid{}".format(*request.source)
        if request.descriptor == PING:
            call = wire.Call(request.call.id, "reply", last=True)
            reply = self.envelope(to, request.content_type, PONG, call=call, content=request.content)
        else:
            call = wire.Call(request.call.id, "refused", reason="not understood", text=request.descriptor)
            reply = self.envelope(to, request.content_type, request.descriptor, call=call)
        self.send(reply)


def as_json(e: wire.Envelope) -> str:
    """An envelope as one line for people and machines; bytes and GUIDs as text."""
    shown = dict(vars(e), call=vars(e.call) if e.call else None, content=e.content.hex())
    shown["read"] = aldis_content.read(e.content_type, e.descriptor, e.content)
    return json.dumps(shown, default=lambda value: value.hex() if isinstance(value, bytes) else str(value))


def say(line: str) -> None:
    print(line, flush=True)


def sub(peer: Peer, args) -> int:
    heard = queue.Queue()
    subscribers = [peer.subscribe(prefix, heard.put) for prefix in args.prefixes or [""]]
    count = 0
    while args.count is None or count < args.count:
        say(as_json(heard.get()))
        count += 1
    del subscribers
    return 0


def pub(peer: Peer, args) -> int:
    descriptor = args.descriptor or wire.address(args.address)
    key = bytes.fromhex(args.key) if args.key is not None else None
    for number in range(args.count):
        time.sleep(args.period if number else 0)
        e = peer.envelope(args.address, args.content_type, descriptor, change=args.change, key=key)
        e.content = args.text.encode() if args.change == "put" else b""
        if key is not None:
            e.instance = wire.instance_chunk(e.address, descriptor, key, always_fits=not args.wide)
        peer.send(e)
    return 0


def ping(peer: Peer, args) -> int:
    begin, answers = time.monotonic(), 0
    for answer in peer.call(args.address, PING, args.within):
        milliseconds = (time.monotonic() - begin) * 1000
        answers += answer.call.role == "reply"
        what = answer.call.reason or answer.descriptor
        source = "eid{}sid{}".format(*answer.source)
        say(json.dumps({"from": source, "descriptor": what, "round_trip_ms": round(milliseconds, 3)}))
    say(json.dumps({"ok": answers > 0, "answers": answers}))
    return 0 if answers else 1


def serve(peer: Peer, args) -> int:
    shown = peer.serve()
    say(json.dumps({"serving": f"eid{peer.entity}sid{peer.service}"}))
    sys.stdin.read()
    del shown
    return 0


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--connect", default="tcp/127.0.0.1:7447", help="the Zenoh locator of a node or router")
    parser.add_argument("--fleet", default="fleet")
    parser.add_argument("--as", dest="entity", type=int, default=300, help="the entity to be")
    parser.add_argument("--service", type=int, default=100, help="the service to be")
    commands = parser.add_subparsers(required=True)
    command = commands.add_parser("sub", help="show messages as they come")
    command.add_argument("prefixes", nargs="*")
    command.add_argument("--count", type=int)
    command.set_defaults(run=sub)
    command = commands.add_parser("pub", help="publish a message")
    command.add_argument("address")
    command.add_argument("--descriptor", help="by default the address: a broadcast")
    command.add_argument("--content-type", default="text")
    command.add_argument("--text", default="")
    command.add_argument("--key", help="the serialized key of the instance, in hexadecimal")
    command.add_argument("--wide", action="store_true", help="keys of this type may be longer than 16 bytes")
    command.add_argument("--change", choices=wire.CHANGES, default="put")
    command.add_argument("--count", type=int, default=1)
    command.add_argument("--period", type=float, default=0.1, help="seconds between two")
    command.set_defaults(run=pub)
    command = commands.add_parser("ping", help="ask whether a service is there")
    command.add_argument("address")
    command.add_argument("--within", type=float, default=2.0, help="seconds to wait for answers")
    command.set_defaults(run=ping)
    commands.add_parser("serve", help="answer pings until end of input").set_defaults(run=serve)
    return parser.parse_args()


def main() -> int:
    args = arguments()
    peer = Peer(args.connect, args.fleet, args.entity, args.service)
    try:
        return args.run(peer, args)
    except BrokenPipeError:
        return 0
    finally:
        peer.session.close()


if __name__ == "__main__":
    sys.exit(main())
