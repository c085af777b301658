"""Honest robots among people on the virtual clock, before the real doors of iVeg.

AGI and AGII are the emulator's robots with their own safety machines; every message
passes the reader of the direct transport as bytes, and a copy of it Orion's
notifications.  Orders and feedback reach them as bytes, too.  What a liar does with its
part it does between these doors.
"""

import asyncio
import math
from collections.abc import Callable
from dataclasses import dataclass

import orjson

from iveg.adapters.direct import DirectReader
from iveg.adapters.greenhouses import load_greenhouse
from iveg.domain.feedback import HALF_SPEED
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.lab.emulator.camera import DETECTORS
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.world import RobotHardware, SimulatedWorld, in_view
from iveg.lab.experiment.stage import Sensing, Stage
from iveg.ngsi import codec
from tests.builders import ignore, notification
from tests.unit.vital.desk import settle
from tests.unit.web.desk import WebDesk

HONEST = ("AGI", "AGII")
LIAR = "AGIII"
FLEET = (*HONEST, LIAR)
STANDS_M_S = 0.05
SEEN_WITHIN_S = 0.3
"""A picture this young has reached iVeg, whatever one direct message suffers."""
INSIDE_M = 0.2
"""So far inside a ring that neither grounding nor odometry makes it the outside."""

Alter = Callable[[str, bytes], list[tuple[str, bytes]]]


@dataclass(frozen=True, slots=True)
class Sight:
    """A person in an honest picture: when (s) and where (m)."""

    at: float
    x: float
    y: float


class Field:
    """The fleet, iVeg, and what lies between.

    Args:
        seed: Of people, noise and detectors.

    Attributes:
        desk: iVeg with fakes for disk and broker.
        alter: What becomes of each direct message of the robot whose part lies.
        translate: What becomes of those of the honest ones: true, and said otherwise.
        copied: Each message of honest robots, for the liar between robot and Orion.
        asked: Releases and resumes that a person asked for.
    """

    def __init__(self, seed: int) -> None:
        greenhouse = load_greenhouse(scenario_named("demo").greenhouse)
        layout = lay_out(scenario_named("demo"), FLEET, greenhouse)
        detector = DETECTORS["perfect"]
        self.world = SimulatedWorld(greenhouse, layout, detector, seed)
        self.desk = desk = WebDesk(FLEET, greenhouse)
        self.alter: Alter = lambda topic, payload: [(topic, payload)]
        self.translate: Alter = self.alter
        self.copied: list[tuple[str, bytes]] = []
        self.sights: list[Sight] = []
        self.asked = 0
        self.pressed_at: float | None = None
        self._orders = 0
        self.reader = DirectReader(
            "iveg",
            FLEET,
            desk.clock,
            desk.ingest,
            "all",
            ignore,
        )
        self.stage = Stage(
            self.world,
            desk.parts,
            desk.fleet.told,
            self._move,
            self._hear,
            Sensing(scan_every=6, looked=self._looked),
        )

    # --- the way up -----------------------------------------------------------------

    def _move(self, seconds: float) -> Instant:
        self.desk.clock.now = seconds
        return self.desk.clock()

    def _hear(self, topic: str, payload: bytes) -> None:
        if f"/{LIAR}" in topic:
            for one in self.alter(topic, payload):
                self.reader.read(*one)
            return
        for one in self.translate(topic, payload):
            self.reader.read(*one)
            self.copied.append(one)

    def notify(self, body: bytes) -> None:
        """Orion posts something."""
        self.desk.notifications.receive(body)

    def _looked(self, rig: RobotHardware) -> None:
        if rig.robot_id not in HONEST:
            return
        for target, _ in in_view(rig, self.world):
            if target.class_id == "farmer":
                pose = target.body.pose
                self.sights.append(Sight(self.desk.clock.now, pose.x, pose.y))

    # --- the way down -----------------------------------------------------------------

    async def step(self) -> None:
        """A twentieth of a second for everybody, and orders that were sent in it."""
        self.stage.step()
        await settle()
        stops = self.desk.fleet.stops
        for robot_id, hold_id in stops[self._orders :]:
            order = codec.write_command(codec.StopOrder(hold_id, "ana"))
            self.stage.robots[robot_id].order(order, self.desk.clock())
        self._orders = len(stops)
        self.check()

    def press(self, robot_id: str) -> "asyncio.Task[object]":
        """Somebody presses STOP; the answer may wait for the disk."""
        self.pressed_at = self.desk.clock.now
        pressing = self.desk.commander.stop([robot_id], "ana", self.desk.clock())
        return asyncio.create_task(pressing)

    # --- what must hold ---------------------------------------------------------------

    def check(self) -> None:
        """The invariants, at every step."""
        self._check_limits()
        self._check_standing()
        assert len(self.desk.fleet.asked) == self.asked, "a release that nobody asked"
        if self.pressed_at is not None:
            assert self.desk.fleet.stops, "a STOP that was not sent at once"

    def _check_limits(self) -> None:
        now = self.desk.clock.now
        self.sights = [one for one in self.sights if now - one.at <= SEEN_WITHIN_S]
        if not self.desk.fleet.told:
            return
        told = self.desk.fleet.told[-1].speed_limits
        for robot_id in HONEST:
            pose = self.world.rigs[robot_id].vehicle.pose
            near = [
                one
                for one in self.sights
                if math.dist((one.x, one.y), (pose.x, pose.y))
                <= LIMITS.zone_default_m - INSIDE_M
            ]
            factor = told[robot_id].speed_factor
            assert not near or factor <= HALF_SPEED, (robot_id, near, told[robot_id])

    def _check_standing(self) -> None:
        for robot_id in HONEST:
            state = self.desk.commander.machine(robot_id).state
            speed = self.stage.robots[robot_id].speed
            assert state != "STANDING" or speed <= STANDS_M_S, (robot_id, speed)


def as_notification(topic: str, payload: bytes) -> bytes | None:
    """A measure as Orion posts it; None for what no agent reads."""
    _, _, device, *_ = topic.split("/")
    if not topic.endswith("/attrs"):
        return None
    values = orjson.loads(payload)
    values.pop("TimeInstant", None)
    robot_id = device.partition("_")[0]
    return notification(values, robot_id=robot_id, subscription_id="ours")
