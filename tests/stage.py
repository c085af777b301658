"""A greenhouse on a clock that is moved by hand: the emulator's world, the robots' own
safety machines and all of iVeg between its doors, without a socket or a process.

What goes from one to the other is written and read by the codec, as on the wire.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Any, TypeVar

import orjson

from iveg.adapters.greenhouses import load_greenhouse
from iveg.domain.observations import Instant, Received
from iveg.domain.records import DecisionRecord, DetectionRecord
from iveg.emulator.camera import DETECTORS
from iveg.emulator.layout import lay_out
from iveg.emulator.orders import FaultOrder
from iveg.emulator.scenarios import scenario_named
from iveg.emulator.world import REST, Rig, World
from iveg.ngsi import codec
from iveg.robot.echo import Echo
from iveg.robot.effects import Drive, Effect, Report
from iveg.robot.holds import HoldSet
from iveg.robot.judgement import Limits
from iveg.robot.safety import SafetyMachine
from iveg.robot.uplink import Uplink
from iveg.web.views import Views
from tests.unit.pipeline.desk import Desk, settle

Json = dict[str, Any]
T = TypeVar("T")
STEP_S = 0.05
_LOOK_EVERY, _NAVIGATION_EVERY = 2, 20
"""Steps between two looks, the first when everybody has said where it is, and between
two words of navigation."""


@dataclass
class Faults:
    """What is wrong with a robot.

    Attributes:
        mute: Nothing that it says arrives.
        deaf: It drives as it likes whatever speed limit iVeg sets; holds still bite.
        clock_offset_s: Its wall clock is this far ahead (s).
    """

    mute: bool = False
    deaf: bool = False
    clock_offset_s: float = 0.0


class Robot:
    """One rig under its safety machine, whose effects are performed at once.

    Args:
        hear: Where its messages go, by topic.
    """

    def __init__(
        self, rig: Rig, now: Instant, hear: Callable[[str, bytes], None]
    ) -> None:
        texts = count(1)
        self.faults = Faults()
        self._rig = rig
        self._hear = hear
        self._echo = Echo()
        self._uplink = Uplink(rig.robot_id, "iveg", "b1", self._say, echo=self._echo)
        self._machine = SafetyMachine(
            rig.robot_id,
            "b1",
            now.mono,
            stored=HoldSet(),
            fresh=lambda: f"{rig.robot_id}-{next(texts)}",
            limits=Limits(rig.profile.max_speed, rig.profile.max_turn),
        )
        self._perform(self._machine.release_locally(now.mono), now)

    def step(self, number: int, world: World, now: Instant) -> None:
        """Navigate, drive, sense."""
        into_run = number * STEP_S
        free = self._machine.may_drive
        wish = self._rig.wish(into_run, world) if free else REST
        self._perform(self._machine.wish(wish, now.mono), now)
        if self.faults.deaf and free:
            self._rig.drive(wish)
        self._rig.move(STEP_S)
        moved = self._rig.odometry()
        self._perform(self._machine.odometry(moved.pose, moved.twist, now.mono), now)
        now = self._dated(now)
        self._uplink.send(moved, now)
        if number % _LOOK_EVERY == 1:
            self._uplink.send(self._rig.look(into_run, world), now)
        if number % _NAVIGATION_EVERY == 0:
            self._uplink.send(self._rig.navigation(), now)

    def _dated(self, now: Instant) -> Instant:
        """What its own clocks show."""
        return Instant(now.mono, now.wall + self.faults.clock_offset_s)

    def listen(self, topic: str, payload: bytes, now: Instant) -> None:
        """Hear iVeg's feedback to a robot of the fleet."""
        feedback = codec.read_feedback(payload)
        self._echo.take(feedback.origin)
        self._perform(self._machine.feedback(topic, feedback, now.mono), now)

    def _perform(self, effects: Sequence[Effect], now: Instant) -> None:
        for effect in effects:
            match effect:
                case Drive(twist):
                    self._rig.drive(twist)
                case Report(report):
                    seq, (_, message) = self._uplink.report(report, self._dated(now))
                    self._machine.reported(seq, now.mono)
                    self._say(message.topic, message.payload)

    def _say(self, topic: str, payload: bytes) -> None:
        if not self.faults.mute:
            self._hear(topic, payload)


class Stage:
    """One scenario that is played, and what iVeg says of it.

    Args:
        scenario: Its name.
        robots: Of the fleet.
        profile: Of the detector; ``seed`` of people and noise.
    """

    def __init__(
        self,
        scenario: str,
        robots: tuple[str, ...] = ("AGI", "AGII"),
        profile: str = "perfect",
        seed: int = 3,
    ) -> None:
        greenhouse = load_greenhouse(scenario_named(scenario).greenhouse)
        layout = lay_out(scenario_named(scenario), robots, greenhouse)
        self._world = World(
            greenhouse, layout, DETECTORS[layout.detector or profile], seed
        )
        self._incidents = [(one.at_s, one.order) for one in layout.incidents]
        self._desk = Desk(robots, greenhouse)
        self._views = Views(
            self._desk.evaluator,
            self._desk.commander,
            self._desk.event_log,
            self._desk.health_monitor,
            Counter,
        )
        self._robots = {
            robot_id: Robot(rig, self.now, self._hear)
            for robot_id, rig in self._world.rigs.items()
        }
        self._delivered = 0
        self._steps = 0

    # --- time -------------------------------------------------------------------------

    @property
    def now(self) -> Instant:
        return self._desk.clock()

    async def until(
        self, probe: Callable[[], T], what: str, within_s: float = 90.0
    ) -> T:
        """Play on until something is there: not None, not empty, not false."""
        for _ in range(round(within_s / STEP_S)):
            found = probe()
            if found:
                return found
            await self.step()
        raise AssertionError(f"not within {within_s:g} s: {what}")

    async def first(self, found: Callable[[], Sequence[T]], what: str) -> T:
        """The first of what is empty for a while."""
        return (await self.until(found, what))[0]

    async def step(self) -> None:
        """Let a twentieth of a second pass for everybody."""
        desk, number = self._desk, self._steps
        self._steps += 1
        desk.clock.now = round(self._steps * STEP_S, 6)
        for at_s, order in self._incidents:
            if number == round(at_s / STEP_S):
                self.happen(order)
        self._world.walk(STEP_S)
        for robot in self._robots.values():
            robot.step(number, self._world, self.now)
        desk.loop.step(desk.ingest.drain(), self.now)
        self._deliver()
        await settle()

    def happen(self, order: FaultOrder) -> None:
        """Something goes wrong with a robot, or is well again."""
        faults = self._robots[order.robot].faults
        faults.clock_offset_s = order.clock_offset_s or faults.clock_offset_s
        faults.mute = faults.mute if order.mute is None else order.mute
        faults.deaf = faults.deaf if order.deaf is None else order.deaf

    def _hear(self, topic: str, payload: bytes) -> None:
        reading = codec.read_measure(topic.split("/")[2], payload)
        assert reading.problems == ()
        for observation in reading.observations:
            self._desk.ingest.offer(Received(observation, self.now, "direct"))

    def _deliver(self) -> None:
        """Every robot listens to what is told to any."""
        told = self._desk.fleet.told[self._delivered :]
        self._delivered += len(told)
        for feedback in told:
            payload = codec.write_feedback(feedback)
            for robot in self._robots.values():
                robot.listen(feedback.robot_id, payload, self.now)

    # --- what iVeg says ---------------------------------------------------------------

    def robot(self, robot_id: str) -> Json:
        return self._views.robot(robot_id, self.now).model_dump()

    def speed(self, robot_id: str) -> float:
        """What its odometry says (m/s), whichever way it drives; 0 before the first."""
        twist = self.robot(robot_id)["twist"]
        return abs(float(twist["linear"])) if twist else 0.0

    def people(self) -> list[Json]:
        return [one.model_dump() for one in self._views.people(self.now)]

    def look(self, robot_id: str) -> dict[str, Json]:
        """What a robot sees now, by class."""
        frame = self._views.frame(robot_id, self.now)
        items = [] if frame is None else frame.items
        return {one.class_id: one.model_dump() for one in items}

    def decisions(self, robot_id: str, reason: str) -> list[DecisionRecord]:
        """What slowed a robot, oldest first, each as it stands now."""
        records = self._desk.records(DecisionRecord)
        newest = {one.decision_id: one for one in records if one.reason == reason}
        return [one for one in newest.values() if one.robot_id == robot_id]

    def detections(self, robot_id: str, class_: str) -> list[DetectionRecord]:
        """What a robot has seen, oldest first."""
        records = self._desk.records(DetectionRecord)
        return [
            one for one in records if (one.robot_id, one.class_) == (robot_id, class_)
        ]

    def alerts(self) -> list[Json]:
        return [one.model_dump() for one in self._views.alerts()]

    def safety(self) -> Json:
        """How soon robots obeyed, as the Fleet page tells it."""
        return self._views.safety(self.now).model_dump()

    def log(self, robot_id: str | None, key: str) -> list[Json]:
        """Lines whose key begins so, oldest first; of one robot or of all."""
        told = self._views.log(list(self._desk.event_log.lines))
        lines: list[Json] = [one.model_dump() for one in told]
        return [
            line
            for line in lines
            if line["key"].startswith(key) and robot_id in (None, line["robot_id"])
        ]


def links_of(decision: DecisionRecord) -> dict[str, str]:
    """The verdict on each link of a decision's chain."""
    return {one["link"]: one["verdict"] for one in orjson.loads(decision.links)}
