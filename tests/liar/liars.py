"""The parts that lie, one script each, all from a seed.

A liar is given the field before each step, and may alter what passes its part.

Lies that need more than these doors are told elsewhere: files that go bad
(``tests/integration/test_damage.py``), a second server (``test_two_servers.py``), a
second publisher beside the gate (``test_discovery.py``), a laser of no use on the robot
(``tests/unit/robot/ros2/test_inputs.py``).
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from random import Random
from typing import Any

import orjson

from iveg.domain.feedback import CLEAR, Feedback
from iveg.domain.observations import Origin
from iveg.ngsi import codec
from tests.liar.greenhouse import FLEET, HONEST, LIAR, Field, as_notification

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
                ["person", "farmer", "tomato", "AGI", "x" * 99, "0", "", 7, "tractor"]
            ),
            "probability": self.rnd.choice([0.0, 0.8, 0.95, 1.0, 95, None]),
            "frame_id": self.rnd.choice(
                ["map", "base_link", "moon", None, "rear_camera_optical_frame"]
            ),
            "position": {
                axis + end: self.rnd.uniform(-30.0, 60.0)
                for axis in "xyz"
                for end in ("min", "max")
            },
        }
        if self.rnd.random() < 0.2:
            sides = (axis + end for axis in "xyz" for end in ("min", "max"))
            box["position"] = dict.fromkeys(sides, 0.0)
        said["bounding_boxes"] = [box] * self.rnd.choice([0, 0, 1, 3, 40, 257])
        sent = [(topic, orjson.dumps(said))]
        return sent * self.rnd.choice([0, 1, 1, 1, 5])


class WordsDiffer(Liar):
    """Honest robots name people, frames and sides in ways that others have, too."""

    def __init__(self, field: Field, rnd: Random) -> None:
        super().__init__(field, rnd)
        field.translate = self.translate
        self.word = rnd.choice(["persona", "people", "gente", "trabajador_0", "0", ""])

    def translate(self, topic: str, payload: bytes) -> list[tuple[str, bytes]]:
        """The same in other words; some nobody can understand."""
        said = orjson.loads(payload)
        for box in said.get("bounding_boxes", ()):
            if box["class_id"] == "farmer":
                box["class_id"] = self.word
                long = self.rnd.choice([0.0, 0.0, 0.5, 1.2])
                box["position"]["xmin"] -= long
                box["position"]["xmax"] += long
        odometry = said.get("base_pose_ground_truth")
        if odometry is not None:
            odometry["frame_id"] = self.rnd.choice(["map", "/map", None, "odom"])
        return [(topic, orjson.dumps(said))]


class LensLies(_Telemetry):
    """A covered lens: each picture is empty, wherever people are."""

    def alter(self, topic: str, payload: bytes) -> list[tuple[str, bytes]]:
        """The same picture without anybody."""
        said = orjson.loads(payload)
        if "bounding_boxes" in said:
            said["bounding_boxes"] = []
        return [(topic, orjson.dumps(said))]


class LaserLies(_Telemetry):
    """A laser over everybody's head, and obstacles that are not there."""

    def alter(self, topic: str, payload: bytes) -> list[tuple[str, bytes]]:
        """A sweep that meets walls alone; a report of somebody, or of nonsense."""
        said = orjson.loads(payload)
        if "lidar_points" in said:
            said["lidar_points"] = [12.0] * len(said["lidar_points"])
        if "safety_state" in said and self.rnd.random() < 0.5:
            places = (self.rnd.uniform(-30.0, 60.0) for _ in range(2))
            seen = dict(zip("xy", places, strict=True))
            seen |= {"width_m": 0.4, "moved": self.rnd.random() < 0.5}
            said["safety_state"]["obstacle"] = self.rnd.choice(
                (seen, seen, wild(seen, self.rnd))
            )
        return [(topic, orjson.dumps(said))]


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


class KeptMeasures(_Telemetry):
    """What a broker kept of earlier boots, given to an agent that starts again."""

    def alter(self, topic: str, payload: bytes) -> list[tuple[str, bytes]]:
        """One message of a boot an hour ago, and nothing of today."""
        said = orjson.loads(payload)
        for value in said.values():
            if isinstance(value, dict) and "boot" in value:
                value["boot"] = f"old-{self.rnd.random()}"
                value["stamp"] = "2020-01-01T00:00:00.000Z"
        body = as_notification(topic, orjson.dumps(said))
        if body is not None:
            self.field.notify(body)
        robot = self.field.desk.world.robot(LIAR)
        assert robot.link(self.field.desk.clock()) == "UNKNOWN"
        return []


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


_STARTED = 100
"""Lies after which a robot has its first speed limit."""


class AuthorLies(Liar):
    """A second author of feedback: all clear, in its own name, iVeg's, or new ones."""

    def __init__(self, field: Field, rnd: Random) -> None:
        super().__init__(field, rnd)
        self.count = 0

    async def act(self) -> None:
        """Tell robots that they may drive.

        None is faster than iVeg lately allowed, and nobody deaf to it for that.
        """
        told = self.field.desk.fleet.told
        for robot_id in HONEST if told else ():
            robot = self.field.stage.robots[robot_id]
            lately = [one.speed_limits[robot_id] for one in told[-2 * len(FLEET) :]]
            allowed = max(one.speed_factor for one in lately)
            assert robot.factor <= allowed, (robot_id, lately)
            is_stopped = robot_id == "AGI" and self.field.pressed_at is not None
            held = self.count > _STARTED and robot.factor == 0.0
            assert is_stopped or not held, robot_id
            topic = self.rnd.choice(FLEET)
            lie = self._all_clear(topic, told[-1])
            robot.listen(topic, lie, self.field.desk.clock())

    def _all_clear(self, topic: str, newest: Feedback) -> bytes:
        self.count += 1
        boot = self.rnd.choice(["another", "iveg-boot", f"b{self.count}"])
        ahead = self.rnd.choice([-50, 0, 1, 3, 1000, 2**40])
        return codec.write_feedback(
            Feedback(
                topic,
                Origin(boot, max(0, (newest.origin.seq or 0) + ahead)),
                speed_limits=dict.fromkeys(FLEET, CLEAR),
                seen=newest.seen if self.rnd.random() < 0.5 else {},
            )
        )


class BrowserLies(Liar):
    """A page without rights, and one with rights and nonsense."""

    async def act(self) -> None:
        """Ask for something."""
        robot_id = self.rnd.choice([*HONEST, LIAR, "AGX"])
        path = self.rnd.choice(["release", "resume", "detector"])
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
    "words": WordsDiffer,
    "lens": LensLies,
    "laser": LaserLies,
    "clock": ClockLies,
    "agent": AgentLies,
    "orion": OrionLies,
    "kept measures": KeptMeasures,
    "mqtt client": ClientLies,
    "author of feedback": AuthorLies,
    "browser": BrowserLies,
    "disk": DiskLies,
}
