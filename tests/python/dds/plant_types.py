"""Types that are no UMAA's: a union, a nested key, an optional member."""

from dataclasses import dataclass
from typing import Optional

from cyclonedds.idl import IdlStruct, IdlUnion, annotations, types


class Plant:
    """What a plant measures; every type final, or every one appendable."""

    def __init__(self, _, extensibility):
        grows = getattr(annotations, extensibility)

        @grows
        class Value(IdlUnion, discriminator=types.int32, typename="plant::Value"):
            number: types.case[1, types.float64]
            text: types.case[2, types.bounded_str[64]]

        @dataclass
        @grows
        class Place(IdlStruct, typename="plant::Place"):
            row: types.int32
            annotations.key("row")
            label: types.bounded_str[32]

        @dataclass
        @grows
        class Reading(IdlStruct, typename="plant::Reading"):
            place: Place
            annotations.key("place")
            value: Value
            error: Optional[types.float64]
            count: types.int32

        self.topics = {"plant/readings": Reading}
