"""A consumer or a provider of ResourceAllocation that a test drives: orders come as JSON lines, and what happens is told as
JSON lines.

    python figures.py --connect L --fleet F --as 300 consumer --service 100 [--recovery resume|cancel]
    python figures.py --connect L --fleet F --as 500 provider --service 10 --resource autopilot --priority eid9000sid100

With `--journal FILE` what is retained outlives the process. With `--fault NAME` one rule of the ICD is broken.
"""

import argparse
import json
import re
import sys
import uuid

import aldis_content
from umaa.arbiter import Arbiter
from umaa.consumer import Consumer
from umaa.node import Node

FAULTS = {
    "consumer": ["old-update", "keep-at-shutdown"],
    "provider": ["skip-commanded", "late-ack", "wrong-reason", "silent-shutdown"],
}


def tell(**what) -> None:
    print(json.dumps(what, default=str), flush=True)


class Names:
    """The GUIDs of services and resources, as orders name them: `eid400sid10`, `400:autopilot`."""

    def __init__(self, fleet: str) -> None:
        self.fleet = fleet

    def service(self, name: str) -> uuid.UUID:
        entity, sid = map(int, re.fullmatch(r"eid(\d+)sid(\d+)", name).groups())
        return aldis_content.service_guid(self.fleet, entity, sid)

    def resource(self, name: str) -> uuid.UUID:
        entity, resource = name.split(":")
        return aldis_content.resource_guid(self.fleet, int(entity), resource)

    def source(self, guid: uuid.UUID):
        return aldis_content.service_of(self.fleet, guid)


def parameters(names: Names, order: dict) -> dict:
    """The members of a command that are its own, as an order gives them."""
    own = {"resourceID": names.resource(order["resource"])} if "resource" in order else {}
    if "duration" in order:
        own["duration"] = order["duration"]
    if "priorities" in order:
        own["priorities"] = [names.service(name) for name in order["priorities"]]
    return own


def consumer(node: Node, names: Names, args) -> tuple:
    guid = aldis_content.service_guid(args.fleet, args.entity, args.service)
    service = Consumer(node, args.service, guid, names.source, args.recovery, args.fault, tell)
    named = {}

    def obey(order: dict) -> None:
        do, session = order["do"], named.get(order.get("name"))
        if "session" in order:
            session = uuid.UUID(order["session"])
        if do == "start":
            session = service.start(order["kind"], names.service(order["to"]), parameters(names, order))
            named[order["name"]] = session
            tell(event="started", name=order["name"], session=session)
        elif do == "update":
            service.update(session, parameters(names, order))
        elif do == "cancel":
            service.cancel(session)
        elif do == "deaf":
            node.withholds_confirmations = order["deaf"]
        elif do == "shutdown":
            service.shut_down()
            tell(event="shut-down")
        elif do == "leave":
            node.leave()

    return service, obey


def provider(node: Node, names: Names, args) -> tuple:
    guid = aldis_content.service_guid(args.fleet, args.entity, args.service)
    resource = aldis_content.resource_guid(args.fleet, args.entity, args.resource)
    priorities = [names.service(name) for name in args.priority]
    service = Arbiter(node, args.service, guid, resource, priorities, not args.gives_up, args.fault, tell)

    def obey(order: dict) -> None:
        do = order["do"]
        if do == "fail":
            service.resource_fails()
        elif do == "slow":
            service.is_slow = order["slow"]
            service.allocation.start_within = order["within"]
        elif do == "shutdown":
            service.shut_down()
            tell(event="shut-down")
        elif do == "leave":
            node.leave()

    return service, obey


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--connect", required=True, help="the Zenoh locator of a node or router")
    parser.add_argument("--fleet", required=True)
    parser.add_argument("--as", dest="entity", type=int, required=True, help="the entity to be")
    parser.add_argument("--journal", help="a file that outlives the process")
    roles = parser.add_subparsers(dest="role", required=True)
    for name, service, make in [("consumer", 100, consumer), ("provider", 10, provider)]:
        role = roles.add_parser(name)
        role.add_argument("--service", type=int, default=service)
        role.add_argument("--fault", choices=FAULTS[name], help="a rule to break")
        role.set_defaults(make=make)
    roles.choices["consumer"].add_argument("--recovery", choices=["resume", "cancel"], default="cancel")
    roles.choices["provider"].add_argument("--resource", default="autopilot")
    roles.choices["provider"].add_argument("--priority", action="append", default=[], help="from low to high")
    roles.choices["provider"].add_argument("--gives-up", action="store_true", help="fail the commands of a former life")
    return parser.parse_args()


def main() -> int:
    args = arguments()
    node = Node(args.connect, args.fleet, args.entity, args.journal)
    service, obey = args.make(node, Names(args.fleet), args)
    node.start([service])
    node.run(obey)
    return 0


if __name__ == "__main__":
    sys.exit(main())
