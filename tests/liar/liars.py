"""The parts that lie, one script each, all from a seed.

A liar is given the field before each step, and may alter what passes its part.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from random import Random
from typing import Any

import orjson

from tests.liar.greenhouse import HONEST, LIAR, Field, as_notification

Json = dict[str, Any]
_WILD: tuple[Any, ...] = (
    None,
    True,
    "",
    "stop",
    "NaN",
    -1,
    0,
    0.5,
    95,
    1e9,
    1e308,
    [],
    {},
    [[]],
    [None],
)


class Liar:
    """Base of all: honest until overridden."""

    def __init__(self, field: Field, rnd: Random) -> None:
        self.field = field
        self.rnd = rnd

    async def act(self) -> None:
        """Lie before a step."""


def wild(value: Any, rnd: Random) -> Any:
    """Something like a value, or nothing like it."""
    if isinstance(value, dict) and value and rnd.random() < 0.8:
        key = rnd.choice(sorted(value))
        if rnd.random() < 0.1:
            return {name: one for name, one in value.items() if name != key}
        return {**value, key: wild(value[key], rnd)}
    if isinstance(value, list) and value and rnd.random() < 0.8:
        place = rnd.randrange(len(value))
        return [*value[:place], wild(value[place], rnd), *value[place + 1 :]]
    if isinstance(value, float) and rnd.random() < 0.5:
        return value + rnd.choice((-1e3, -10.0, -1.0, 0.1, 1.0, 10.0, 1e3))
    return rnd.choice(_WILD)


class _Telemetry(Liar, ABC):
    """Alters what the liar's robot sends."""

    def __init__(self, field: Field, rnd: Random) -> None:
        super().__init__(field, rnd)
        field.alter = self.alter

    @abstractmethod
    def alter(self, topic: str, payload: bytes) -> list[tuple[str, bytes]]:
        """What is sent instead."""


class RobotLies(_Telemetry):
    """Poses, speeds, reports, counters: any value of any message may be another."""

    def alter(self, topic: str, payload: bytes) -> list[tuple[str, bytes]]:
        """A value or two that are not so."""
        if self.rnd.random() < 0.3:
            return [(topic, payload)]
        said = orjson.loads(payload)
        for _ in range(self.rnd.randint(1, 3)):
            said = wild(said, self.rnd)
        return [(topic, orjson.dumps(said))]


class DetectorLies(_Telemetry):
    """Empty pictures, ghosts, crowds, boxes that nobody can use."""

    def alter(self, topic: str, payload: bytes) -> list[tuple[str, bytes]]:
        """Another picture."""
        if "yolox" not in topic:
            return [(topic, payload)]
        said = orjson.loads(payload)
        box = {
            "class_id": self.rnd.choice(
                ["person", "farmer", "tomato", "AGI", "x" * 99]
            ),
            "probability": self.rnd.choice([0.0, 0.8, 0.95, 1.0, 95, None]),
            "frame_id": self.rnd.choice(["map", "base_link", "moon", None]),
            "position": {
                axis + end: self.rnd.uniform(-30.0, 60.0)
                for axis in "xyz"
                for end in ("min", "max")
            },
        }
        said["bounding_boxes"] = [box] * self.rnd.choice([0, 0, 1, 3, 40, 257])
        sent = [(topic, orjson.dumps(said))]
        return sent * self.rnd.choice([0, 1, 1, 1, 5])


class ClockLies(_Telemetry):
    """Stamps, seconds since boot and echoes of another time."""

    def alter(self, topic: str, payload: bytes) -> list[tuple[str, bytes]]:
        """The same at another time."""
        said = orjson.loads(payload)
        year = self.rnd.choice([1970, 2020, 2031, 9999])
        stamp = f"{year}-01-01T00:00:00.000Z"
        for value in said.values():
            if isinstance(value, dict) and "seq" in value:
                value["stamp"] = stamp
                value["mono"] = self.rnd.choice([0.0, 1e6, value.get("mono") or 0.0])
                if self.rnd.random() < 0.3:
                    value["heard"] = {"boot": "iveg-boot", "seq": 10**9}
        said["TimeInstant"] = stamp
        return [(topic, orjson.dumps(said))]


class AgentLies(Liar):
    """Copies through FIWARE come late, mixed, doubled, with words in between."""

    def __init__(self, field: Field, rnd: Random) -> None:
        super().__init__(field, rnd)
        self.waiting: list[bytes] = []

    async def act(self) -> None:
        """Deliver some of what waits, in any order."""
        bodies = (as_notification(*one) for one in self.field.copied)
        self.waiting += [one for one in bodies if one is not None]
        self.field.copied.clear()
        for _ in range(self.rnd.choice([0, 0, 3, 30])):
            if self.waiting:
                place = self.rnd.randrange(len(self.waiting))
                self.field.notify(self.waiting[place])
                if self.rnd.random() < 0.8:
                    del self.waiting[place]
        del self.waiting[:-2000]


class OrionLies(Liar):
    """Old values as new, values of one robot as another's, opinions as facts."""

    def __init__(self, field: Field, rnd: Random) -> None:
        super().__init__(field, rnd)
        self.old: list[bytes] = []

    async def act(self) -> None:
        """Post some of it."""
        bodies = (as_notification(*one) for one in self.field.copied)
        self.old += [one for one in bodies if one is not None]
        self.field.copied.clear()
        for _ in range(self.rnd.randint(0, 3)):
            if not self.old:
                return
            said = orjson.loads(self.rnd.choice(self.old))
            entity = said["data"][0]
            lie = self.rnd.randrange(4)
            if lie == 0:
                entity["id"] = LIAR
            elif lie == 1:
                entity["cmd_status"] = {"type": "Text", "value": "OK"}
            elif lie == 2:
                said["data"] = [entity] * 20
            else:
                said = wild(said, self.rnd)
            self.field.notify(orjson.dumps(said))


class ClientLies(Liar):
    """A client with the liar's own name says anything on its topics, and on none."""

    async def act(self) -> None:
        """Publish bytes."""
        for _ in range(self.rnd.randint(0, 5)):
            suffix = self.rnd.choice(["_odom", "_safety", "_yolox_bounding_boxes", ""])
            topic = self.rnd.choice(
                [f"/iveg/{LIAR}{suffix}/attrs", f"/iveg/{LIAR}/cmdexe", "/iveg//attrs"]
            )
            payload = self.rnd.choice(
                [
                    self.rnd.randbytes(self.rnd.randrange(40)),
                    b"[" * 10_000,
                    b'{"safety_state": {"speed_factor": 1, "reason": "clear"}}',
                    orjson.dumps(
                        wild({"base_pose_ground_truth": {"x": 1.0}}, self.rnd)
                    ),
                ]
            )
            self.field.reader.read(topic, payload)


class BrowserLies(Liar):
    """A page without rights, and one with rights and nonsense."""

    async def act(self) -> None:
        """Ask for something."""
        robot_id = self.rnd.choice([*HONEST, LIAR, "AGX"])
        path = self.rnd.choice(["release", "resume", "drill", "detector"])
        body = wild({"holds": ["01X"], "in_service": False}, self.rnd)
        async with self.field.desk.browser("viewer") as viewer:
            method = "PUT" if path == "detector" else "POST"
            answer = await viewer.request(
                method, f"/api/v1/robots/{robot_id}/{path}", json=body
            )
            assert 400 <= answer.status_code < 500
        async with self.field.desk.browser() as operator:
            rule = wild({"confidence_threshold": 0.8, "version": 10**6}, self.rnd)
            answer = await operator.put("/api/v1/rule", json=rule)
            assert 400 <= answer.status_code < 500 or answer.status_code == 200
        self.field.asked = len(self.field.desk.fleet.asked)


class DiskLies(Liar):
    """The disk hangs, and comes back."""

    async def act(self) -> None:
        """Hang or come back."""
        journal, sink = self.field.desk.journal.opened, self.field.desk.sink.opened
        for door in (journal, sink):
            if self.rnd.random() < 0.1:
                (door.set if door.is_set() else door.clear)()


LIARS: dict[str, Callable[[Field, Random], Liar]] = {
    "robot": RobotLies,
    "detector": DetectorLies,
    "clock": ClockLies,
    "agent": AgentLies,
    "orion": OrionLies,
    "mqtt client": ClientLies,
    "browser": BrowserLies,
    "disk": DiskLies,
}
