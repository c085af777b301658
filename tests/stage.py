"""A scenario on the experiment's virtual clock, and what iVeg says of it."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from iveg.adapters.greenhouses import load_greenhouse
from iveg.domain.observations import Instant
from iveg.domain.records import DecisionRecord, DetectionRecord
from iveg.lab.emulator.camera import DETECTORS
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.experiment import stage as staging
from iveg.lab.experiment.stage import STEP_S
from iveg.lab.experiment.virtual import read_direct
from iveg.models.history import LogEntry
from iveg.pipeline import Pipeline
from iveg.vital.operators import ThingMarks
from iveg.web.views import Views
from tests.faulty_world import FaultyWorld
from tests.unit.vital.desk import Desk, settle

Json = dict[str, Any]
T = TypeVar("T")


class Stage:
    """One scenario that is played, and what iVeg says of it.

    Args:
        scenario: Its name.
        robots: Of the fleet.
        profile: Of the detector; ``seed`` of people and noise.
        foresight: Robots slow before they reach a ring.

    Attributes:
        desk: The pipeline.
    """

    def __init__(
        self,
        scenario: str,
        robots: tuple[str, ...] = ("AGI", "AGII"),
        profile: str = "perfect",
        seed: int = 3,
        *,
        foresight: bool = True,
    ) -> None:
        greenhouse = load_greenhouse(scenario_named(scenario).greenhouse)
        layout = lay_out(scenario_named(scenario), robots, greenhouse)
        self._world = FaultyWorld(greenhouse, layout, DETECTORS[profile], seed)
        self.desk = desk = Desk(robots, greenhouse)
        desk.evaluator.rule = replace(desk.evaluator.rule, foresight=foresight)
        self._views = Views(desk.parts)
        self._stage = staging.Stage(
            self._world,
            desk.parts,
            desk.fleet.told,
            self._move,
            self._hear,
        )
        self.happen = self._world.happen

    def _move(self, seconds: float) -> Instant:
        self.desk.clock.now = seconds
        return self.now

    def _hear(self, topic: str, payload: bytes) -> None:
        sent = self._world.sent(topic, payload)
        if sent is not None:
            for received in read_direct(topic, sent, self.now):
                self.desk.ingest.enqueue(received)

    @property
    def parts(self) -> Pipeline:
        return self.desk.parts

    # --- time -------------------------------------------------------------------------

    @property
    def now(self) -> Instant:
        return self.desk.clock()

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
        self._stage.step()
        await settle()

    def mark(self, person_id: str) -> None:
        """An operator says that somebody is no person, for the rest of the day."""
        marks = ThingMarks(self.parts.core)
        marks.mark(person_id, "ana", self.now.wall + 3600.0, self.now)

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
        records = self.desk.records(DecisionRecord)
        newest = {one.decision_id: one for one in records if one.reason == reason}
        return [one for one in newest.values() if one.robot_id == robot_id]

    def detections(self, robot_id: str, class_: str) -> list[DetectionRecord]:
        """What a robot has seen, oldest first."""
        records = self.desk.records(DetectionRecord)
        return [
            one for one in records if (one.robot_id, one.class_) == (robot_id, class_)
        ]

    def alerts(self) -> list[Json]:
        return [one.model_dump() for one in self._views.alerts()]

    def log(self, robot_id: str | None, key: str) -> list[Json]:
        """Lines whose key begins so, oldest first; of one robot or of all."""
        told = map(LogEntry.from_record, self.desk.event_log.lines)
        lines: list[Json] = [one.model_dump() for one in told]
        return [
            line
            for line in lines
            if line["key"].startswith(key) and robot_id in (None, line["robot_id"])
        ]


def links_of(decision: DecisionRecord) -> dict[str, str]:
    """The verdict on each link of a decision's chain."""
    return {one["link"]: one["verdict"] for one in decision.links}
