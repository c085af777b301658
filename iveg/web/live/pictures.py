"""Recorded pictures: topics as pages get them, written and read back.

A picture holds the topics that pages are sent (docs/interfaces/recordings.md): a whole
picture every ten seconds, between them only changes.
"""

import asyncio
from base64 import b64decode, b64encode
from collections.abc import Callable, Iterable
from typing import Any, Final

import numpy as np
import orjson

from iveg.adapters.recordings.pictures import CHANGED, WHOLE, WHOLE_S, PictureFiles
from iveg.domain.observations import Instant
from iveg.domain.stamps import format_stamp
from iveg.models.base import write_json
from iveg.vital import topics
from iveg.vital.ports import Clock
from iveg.vital.publish import Hub
from iveg.web.live.encoder import Encoder
from iveg.web.live.telemetry import NO_RETURN
from iveg.web.views import Views

PICTURE_S: Final = 0.2
"""Time between two pictures (s)."""
REFUSED_S: Final = 2.0
"""Pause after a refused picture (s): the next is whole, which costs more."""
_COMMANDS: Final = "commands"
_AT_ONCE: Final = tuple(
    row.name
    for row in topics.TOPICS
    if row.read and row is not topics.LOG and "{id}" not in row.name
)
_MEMBERS: Final = frozenset(row.member for row in topics.TOPICS if row.read)
_LOG_LINES: Final = 200


class PictureRecorder:
    """Records the topics that pages get, five times a second.

    Args:
        encoder: Encodes scans.
        views: Reads all other topics.
        hub: Has the version of each topic.
        clock: Gives the time of pictures.
        write: Takes a picture and its moment; returns whether there was room.
    """

    def __init__(
        self,
        encoder: Encoder,
        views: Views,
        hub: Hub,
        clock: Clock,
        write: Callable[[bytes, Instant], bool],
    ) -> None:
        self._encoder, self._views, self._hub = encoder, views, hub
        self._clock, self._write = clock, write
        self._whole_at = float("-inf")
        self._begin_anew()

    def _begin_anew(self) -> None:
        """Forget the last picture, so that the next is whole."""
        self._versions: dict[str, int] = {}
        self._log_id = -1
        self._commands: object = None

    async def run(self) -> None:
        """Take pictures until cancelled."""
        while True:
            is_taken = await self.take()
            await asyncio.sleep(PICTURE_S if is_taken else REFUSED_S)

    async def take(self) -> bool:
        """Take a picture; returns whether there was room for it.

        The loop has its turn between the parts.  After a refusal the next picture is
        whole, because the changes in the refused picture are lost.
        """
        now = self._clock()
        is_whole = now.mono - self._whole_at >= WHOLE_S
        if is_whole:
            self._begin_anew()
            self._whole_at = now.mono
        parts, scans = self._events(), list[bytes]()
        for topic in self._changed(is_whole=is_whole):
            self._versions[topic] = self._hub.versions[topic]
            if topics.find(topic)[0] is topics.SCAN:
                scans += self._scan(topic)
            else:
                parts += self._part(topic)
            await asyncio.sleep(0)
        payload = b'%b"at":%b,"parts":[%b],"scans":[%b]}' % (
            WHOLE if is_whole else CHANGED,
            orjson.dumps(self._clock().mono),
            b",".join(parts),
            b",".join(scans),
        )
        is_taken = self._write(payload, now)
        if not is_taken:
            self._whole_at = float("-inf")
        return is_taken

    def _changed(self, *, is_whole: bool) -> Iterable[str]:
        versions = self._hub.versions
        if is_whole:
            robots = map(topics.ROBOT.for_id, self._views.robot_ids)
            return list(dict.fromkeys((*robots, *_AT_ONCE, *versions)))
        seen = self._versions
        return [name for name, version in versions.items() if seen.get(name) != version]

    def _events(self) -> list[bytes]:
        """New lines of the log, and orders where they have changed."""
        parts = []
        if lines := self._views.log_since(self._log_id):
            self._log_id = lines[-1].id
            parts.append(self._written(topics.LOG.name, lines))
        commands = self._views.open_commands(self._clock())
        if commands != self._commands:
            self._commands = commands
            parts.append(self._written(_COMMANDS, commands))
        return parts

    def _part(self, topic: str) -> Iterable[bytes]:
        """A topic's newest value; nothing of a topic without one."""
        now = self._clock()
        data: object = None
        row, key = topics.find(topic)
        if row is topics.ROBOT:
            data = self._views.robot(key, now)
        elif row is topics.DETECTIONS:
            data = self._views.frame(key, now)
        elif row is topics.PEOPLE:
            data = self._people(now)
        elif row.read is not None:
            data = row.read(self._views, now)
        return [] if data is None else [self._written(topic, data)]

    def _people(self, now: Instant) -> dict[str, Any]:
        people = [person.model_dump(mode="json") for person in self._views.people(now)]
        return {
            "ids": [person["person_id"] for person in people],
            "changed": [{**person, "at": now.mono} for person in people],
        }

    def _scan(self, topic: str) -> Iterable[bytes]:
        part = self._encoder.telemetry.part(topic, self._clock())
        if part is not None:
            yield b'%b,"ranges":"%b"}' % (part.head[:-1], b64encode(part.body))

    def _written(self, topic: str, data: object) -> bytes:
        return write_json({"topic": topic, "at": self._clock().mono, "data": data})


class Past:
    """The world of a recorded moment, made of pictures in a thread, one at a time.

    Args:
        files: Finds recorded pictures.
    """

    def __init__(self, files: PictureFiles) -> None:
        self._files = files
        self._turn = asyncio.Lock()

    async def world(self, wall: float) -> bytes:
        """The world at a moment (Unix s), as JSON (``PastWorld``).

        Raises:
            NotRecordedError: there is no picture of it.
            HopError: the disk refuses.
        """
        # Many threads would take the processor from the loop in which a STOP waits.
        async with self._turn:
            return await asyncio.to_thread(self._world, wall)

    def _world(self, wall: float) -> bytes:
        pictures = self._files.by(wall)
        world = World()
        for payload in pictures.payloads:
            world.take(orjson.loads(payload))
        at = {"at": format_stamp(pictures.at), "at_s": pictures.at}
        return orjson.dumps({**world.members(), **at})


class World:
    """State of a page, as pictures bring it up to date.

    Every value is kept with its moment on the monotonic clock of its server (s).
    Earlier versions wrote only changed members of robots and people, and poses
    separately.
    """

    def __init__(self) -> None:
        self._at = 0.0
        self._values: dict[str, tuple[float, Any]] = {}
        self._robots: dict[str, tuple[float, dict[str, Any]]] = {}
        self._moves: dict[str, list[Any]] = {}
        self._people: dict[str, tuple[float, Any]] = {}
        self._detections: dict[str, tuple[float, Any]] = {}
        self._scans: dict[str, dict[str, Any]] = {}
        self._log: list[Any] = []
        self._left_out: set[str] = set()

    def take(self, picture: dict[str, Any]) -> None:
        """Apply the next picture."""
        self._at = picture["at"]
        for part in picture["parts"]:
            self._take(part["topic"], part["at"], part["data"])
        self._moves |= {move[0]: move for move in picture.get("moves", ())}
        self._scans |= {scan["robot_id"]: scan for scan in picture.get("scans", ())}

    def _take(self, topic: str, at: float, data: Any) -> None:
        member, _, key = topic.partition("/")
        if member not in _MEMBERS:
            # A newer or older version of iVeg recorded it.
            self._left_out.add(topic)
        elif member == topics.ROBOT.member:
            self._robots[key] = at, {**self._robots.get(key, (at, {}))[1], **data}
        elif member == topics.PEOPLE.member:
            people = self._people
            people |= {
                person["person_id"]: (person["at"], person)
                for person in data["changed"]
            }
            # The ids name all people who are still known; the others have left.
            self._people = {
                name: people[name] for name in data["ids"] if name in people
            }
        elif member == topics.DETECTIONS.member:
            self._detections[key] = at, data
        elif member == topics.LOG.member:
            self._log = [*self._log, *data][-_LOG_LINES:]
        else:
            self._values[member] = at, data

    def members(self) -> dict[str, Any]:
        """The members of the snapshot, with ages of the newest picture."""
        lists = dict.fromkeys(_MEMBERS - {topics.CLIMATE.member}, ())
        return {
            **lists,
            topics.CLIMATE.member: None,
            **{name: self._aged(value) for name, value in self._values.items()},
            "robots": [self._robot(robot_id) for robot_id in self._robots],
            "people": [self._person(value) for value in self._people.values()],
            "detections": {
                key: self._aged(value) for key, value in self._detections.items()
            },
            "log": self._log,
            "scans": [_drawn(scan) for scan in self._scans.values()],
            "left_out": sorted(self._left_out),
        }

    def _person(self, value: tuple[float, Any]) -> Any:
        person = self._aged(value)
        del person["at"]
        return person

    def _robot(self, robot_id: str) -> Any:
        robot = self._aged(self._robots[robot_id])
        move = self._moves.get(robot_id)
        if move is None:
            # Only earlier versions recorded poses apart; else its own members count.
            return {**dict.fromkeys(("pose", "twist", "stamp", "age_s")), **robot}
        _, at, age_s, x, y, yaw, linear, angular, stamp = move
        motion = {
            "pose": {"x": x, "y": y, "yaw": yaw},
            "twist": {"linear": linear, "angular": angular},
            "stamp": stamp,
        }
        return {**robot, **motion, **self._aged((at, {"age_s": age_s}))}

    def _aged(self, value: tuple[float, Any]) -> Any:
        at, data = value
        return _older(data, self._at - at)


def _older(value: Any, by: float) -> Any:
    """A value with ``by`` (s) added to all of its ages."""
    if isinstance(value, list):
        return [_older(item, by) for item in value]
    if not isinstance(value, dict):
        return value
    return {
        key: round(member + by, 3)
        if key == "age_s" and member is not None
        else _older(member, by)
        for key, member in value.items()
    }


def _drawn(scan: dict[str, Any]) -> dict[str, Any]:
    """A sweep as points in ``map`` (m)."""
    units = np.frombuffer(b64decode(scan["ranges"]), "<u2")[: scan["count"]]
    angles = scan["yaw"] + scan["angle_min"]
    angles = angles + scan["angle_increment"] * np.arange(units.size)
    hits = units != NO_RETURN
    ranges, angles = units[hits] * scan["unit_m"], angles[hits]
    x, y = scan["x"] + ranges * np.cos(angles), scan["y"] + ranges * np.sin(angles)
    points = np.round(np.column_stack((x, y)), 3).tolist()
    return {
        "robot_id": scan["robot_id"],
        "stamp": scan["stamp"],
        "frame_id": "map",
        "points": points,
    }
