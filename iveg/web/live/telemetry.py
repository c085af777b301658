"""Parts of telemetry frames, each version encoded once for all browsers.

A part is JSON, and for a scan also its ranges as integers; docs/interfaces/live.md has
their shapes.  Browsers differ in when they take a part, never in its bytes: each part
carries the moment of its truth (``at``, the server's monotonic clock).
"""

import math
from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

import numpy as np
import orjson

from iveg.domain.margins import LeastMargins
from iveg.domain.observations import Instant, LaserScan, Odometry
from iveg.models.base import rounded, write_json
from iveg.models.people import Person
from iveg.models.robot import Robot
from iveg.vital import topics
from iveg.vital.publish import Hub
from iveg.web.views import Views

LIST_S: Final = 0.1
"""Time between two lists of people (s)."""
PEOPLE_A_BEAT: Final = 50
"""People in a list at full rate; a longer one comes less often (0.1 ms a person)."""
UNIT_M: Final = 0.005
"""Unit of a range (m): finer than a map shows, and 327 m fit in 16 bits."""
NO_RETURN: Final = 0xFFFF


def write_ranges(scan: LaserScan) -> bytes:
    """Ranges as ``uint16`` in ``UNIT_M``, little-endian, padded to four bytes."""
    ranges = scan.ranges
    units = np.full(ranges.size + ranges.size % 2, NO_RETURN, "<u2")
    # Longer ranges would wrap round in 16 bits and draw a wall nearby.
    counts = scan.returns() & (ranges < UNIT_M * NO_RETURN)
    units[: ranges.size][counts] = np.rint(ranges[counts] / UNIT_M)
    return units.tobytes()


_MOVES: Final = frozenset({"pose", "twist", "stamp", "age_s"})
"""Members of a robot that go by themselves, with each measure."""


class Part(NamedTuple):
    """One topic's share of a frame.

    Attributes:
        version: Version of the topic; a browser that has it needs nothing newer.
        head: JSON.
        body: Bytes after the JSON of the frame; a multiple of four.
    """

    version: int
    head: bytes
    body: bytes = b""


class TelemetryEncoder:
    """Encodes each part once, when the first browser needs it."""

    def __init__(self, views: Views, hub: Hub) -> None:
        self._views = views
        self._hub = hub
        self._parts: dict[str, Part] = {}
        self._states: dict[str, _RobotState] = {}
        self._people = _People()
        self._moves: dict[str, tuple[Odometry, Part]] = {}
        self._margins: LeastMargins | None = None

    @property
    def lists_apart_s(self) -> float:
        """Least time between two lists of people (s)."""
        return LIST_S * max(1, math.ceil(self._people.count / PEOPLE_A_BEAT))

    def begin(self) -> None:
        """Begin a frame: values computed for the one before are dropped."""
        self._margins = None

    def move(self, robot_id: str, now: Instant) -> Part | None:
        """Pose and motion of a robot; None before its first odometry."""
        robot = self._views.robot_state(robot_id)
        odometry = robot.odometry
        if odometry is None:
            return None
        cached = self._moves.get(robot_id)
        # Encoded with its first age: ``at`` lets each page add the time since.
        if cached is not None and cached[0] is odometry:
            return cached[1]
        pose, twist = odometry.pose, odometry.twist
        place = round(pose.x, 3), round(pose.y, 3), round(pose.yaw, 4)
        speed = round(twist.linear_x, 3), round(twist.angular_z, 3)
        age_s = rounded(robot.age_s(now))
        head = [robot_id, now.mono, age_s, *place, *speed, odometry.origin.stamp]
        version = self._hub.versions[topics.ROBOT.for_id(robot_id)]
        part = Part(version, orjson.dumps(head))
        self._moves[robot_id] = odometry, part
        return part

    def state(self, robot_id: str, since: int, now: Instant) -> Part | None:
        """Members of a robot that changed since a version; None without a change."""
        topic = topics.ROBOT.for_id(robot_id)
        state = self._states.setdefault(robot_id, _RobotState())
        if state.version != self._hub.versions[topic]:
            robot = self._views.robot(robot_id, now, self._margins_at(now))
            state.update(robot, self._hub.versions[topic], now.mono)
        return state.changes(topic, since)

    def people(self, since: int, now: Instant) -> Part | None:
        """The list of people, and changes since a version; None without a change."""
        version = self._hub.versions[topics.PEOPLE.name]
        if self._people.version != version:
            self._people.update(self._views.people(now), version, now.mono)
        return self._people.changes(since)

    def part(self, topic: str, now: Instant) -> Part | None:
        """A scan or one detection frame; None where there is none."""
        version = self._hub.versions[topic]
        cached = self._parts.get(topic)
        if cached is not None and cached.version == version:
            return cached
        part = self._encode(topic, version, now)
        if part is not None:
            self._parts[topic] = part
        return part

    def _margins_at(self, now: Instant) -> LeastMargins:
        if self._margins is None:
            self._margins = self._views.margins(now)
        return self._margins

    def _encode(self, topic: str, version: int, now: Instant) -> Part | None:
        row, robot_id = topics.find(topic)
        if row is topics.SCAN:
            try:
                return self._scan(topic, robot_id, version, now)
            except Exception as error:
                # One robot's scan must not end the connection of every browser.
                self._views.reject(robot_id, "undrawable_scan", repr(error))
                return None
        data = self._views.frame(robot_id, now)
        if data is None:
            return None
        head = {"topic": topic, "at": now.mono, "data": data}
        return Part(version, write_json(head))

    def _scan(
        self, topic: str, robot_id: str, version: int, now: Instant
    ) -> Part | None:
        robot = self._views.robot_state(robot_id)
        scan = robot.scan
        if scan is None or robot.scan_pose is None:
            return None
        sensor = robot.scan_pose.compose(scan.mount)
        head = {
            "topic": topic,
            "at": now.mono,
            "robot_id": robot_id,
            "stamp": scan.origin.stamp,
            "age_s": self._views.scan_age_s(robot_id, now),
            "x": round(sensor.x, 3),
            "y": round(sensor.y, 3),
            "yaw": round(sensor.yaw, 5),
            "angle_min": scan.angle_min,
            "angle_increment": scan.angle_increment,
            "unit_m": UNIT_M,
            "count": scan.ranges.size,
        }
        return Part(version, orjson.dumps(head), write_ranges(scan))


class _RobotState:
    """A robot's members, each encoded when its value has changed."""

    def __init__(self) -> None:
        self.version = -1
        self.at = float("-inf")
        self._values: dict[str, object] = {}
        self._members: dict[str, tuple[int, bytes]] = {}

    def update(self, robot: Robot, version: int, at: float) -> None:
        """Compare with the members of the last update."""
        self.version, self.at = version, at
        for name, value in robot.__dict__.items():
            if name in _MOVES or self._values.get(name, self) == value:
                continue
            self._values[name] = value
            member = b'"%b":%b' % (name.encode(), write_json(value))
            self._members[name] = version, member

    def changes(self, topic: str, since: int) -> Part | None:
        """The members that are newer than a version."""
        newer = [text for version, text in self._members.values() if version > since]
        if not newer:
            return None
        head = b'{"topic":%b,"at":%b,"data":{%b}}' % (
            orjson.dumps(topic),
            orjson.dumps(self.at),
            b",".join(newer),
        )
        return Part(self.version, head)


class _People:
    """All known people, each encoded when more than an age has changed."""

    def __init__(self) -> None:
        self.version = -1
        self.at = float("-inf")
        self._changed = -1
        self._ids: list[str] = []
        self._values: dict[str, object] = {}
        self._texts: dict[str, tuple[int, bytes]] = {}

    def update(self, people: Sequence[Person], version: int, at: float) -> None:
        """Compare with the people of the last update."""
        self.version, self.at = version, at
        ids = [person.person_id for person in people]
        if ids != self._ids:
            self._ids, self._changed = ids, version
        # People who have left are forgotten; a new id has no value to compare with.
        self._values = {name: self._values.get(name) for name in ids}
        self._texts = {name: self._texts[name] for name in ids if name in self._texts}
        for person in people:
            value = _without_ages(person)
            if self._values[person.person_id] == value:
                continue
            self._values[person.person_id] = value
            # The age counts from ``at``, also for a browser that takes the part later.
            text = b'%b,"at":%b}' % (write_json(person)[:-1], orjson.dumps(at))
            self._texts[person.person_id] = version, text
            self._changed = version

    @property
    def count(self) -> int:
        """Number of people."""
        return len(self._ids)

    def changes(self, since: int) -> Part | None:
        """The list of people, and the people who changed since a version."""
        if self._changed <= since:
            return None
        newer = [text for version, text in self._texts.values() if version > since]
        head = b'{"topic":"people","at":%b,"data":{"ids":%b,"changed":[%b]}}' % (
            orjson.dumps(self.at),
            orjson.dumps(self._ids),
            b",".join(newer),
        )
        return Part(self.version, head)


def _without_ages(person: Person) -> dict[str, object]:
    return {name: value for name, value in vars(person).items() if name != "age_s"}


def write_frame(head: bytes, bodies: Iterable[bytes]) -> bytes:
    """``uint32`` length of the JSON, the JSON padded with spaces, the bodies."""
    padded = head + b" " * (-len(head) % 4)
    return b"".join((len(padded).to_bytes(4, "little"), padded, *bodies))
