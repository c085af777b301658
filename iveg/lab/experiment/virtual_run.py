"""One run on the virtual clock, which gives all counts.

Real programs depend on the scheduling of the processor; this run does not, so that two
runs of one seed give the same counts on any machine.
"""

import asyncio
from collections.abc import Iterator
from dataclasses import dataclass, field

from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.greenhouses import load_greenhouse
from iveg.app.virtual import VirtualPipeline
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.records import DecisionRecord
from iveg.domain.rule.zones import zones_of
from iveg.lab.emulator.camera import DETECTORS
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.truth import in_view
from iveg.lab.emulator.world import RobotHardware, SimulatedWorld
from iveg.lab.experiment.beliefs import Belief, belief_of
from iveg.lab.experiment.plan import ROBOTS, PlannedRun
from iveg.lab.experiment.scoring import Pair, Picture, SeenObject
from iveg.lab.experiment.stage import STEP_S, Stage
from iveg.pipeline.mapping import Mapper
from iveg.web.views import Views

_SCAN_EVERY, _BELIEVE_EVERY, _REST_EVERY = 6, 20, 20
"""Steps between two sweeps, two looks into a costmap, and two rests for others."""


@dataclass(slots=True)
class VirtualRunResult:
    """Result of a run.

    Attributes:
        pairs: Each detection frame, true and as iVeg reported it.
        beliefs: At some moments (s), the content of a robot's costmap.
        decisions: All decisions in their final state.
        touched: Moments at which a robot touched a person.
        lost: Robots that were not live at the end.
    """

    pairs: list[Pair] = field(default_factory=list)
    beliefs: list[tuple[float, Belief]] = field(default_factory=list)
    decisions: list[DecisionRecord] = field(default_factory=list)
    touched: int = 0
    lost: int = 0

    @property
    def completed(self) -> bool:
        """Whether it completed: all robots live, no collision."""
        return bool(self.pairs) and not self.touched and not self.lost


class VirtualRun:
    """One scenario in a pipeline of its own.

    Args:
        watched: Robot whose costmap is examined.
    """

    def __init__(
        self, step: PlannedRun, profile: str, rule: DetectionRule, watched: str
    ) -> None:
        scenario = scenario_named(step.family)
        greenhouse = load_greenhouse(scenario.greenhouse)
        layout = lay_out(scenario, ROBOTS, greenhouse)
        self._watched = watched
        self._result = VirtualRunResult()
        self._detections: list[Picture] = []
        self._iveg = iveg = VirtualPipeline(load_fleet(words=ROBOTS), greenhouse, rule)
        self._mapper = Mapper(iveg.parts.world, greenhouse.bounds)
        self._views = Views(iveg.parts)
        detector = DETECTORS[layout.detector or profile]
        self._world = SimulatedWorld(greenhouse, layout, detector, step.seed)
        self._stage = Stage(
            self._world,
            layout.incidents,
            iveg.parts.ingest,
            iveg.parts.loop,
            iveg.feedback,
            iveg.move,
            iveg.hear,
            looked=self._looked,
            scan_every=_SCAN_EVERY,
        )

    async def play(self, seconds: float) -> VirtualRunResult:
        """Run from the start; yields to other tasks once a virtual second."""
        for number in range(round(seconds / STEP_S)):
            self._stage.step()
            self._mapper.tick(self._iveg.now)
            self._result.pairs += self._reported()
            if number % _BELIEVE_EVERY == 1:
                self._believe()
            self._result.touched += self._touches()
            if number % _REST_EVERY == 0:
                await asyncio.sleep(0)
        self._result.decisions = list(self._iveg.decisions.values())
        live = (self._views.robot(one, self._iveg.now).link for one in ROBOTS)
        self._result.lost = sum(link != "LIVE" for link in live)
        return self._result

    def _looked(self, rig: RobotHardware) -> None:
        """Targets in view at the moment of the picture."""
        seen = (
            SeenObject(one.key, one.class_id, one.body.pose.x, one.body.pose.y)
            for one, _ in in_view(rig, self._world)
        )
        self._detections.append(Picture(rig.robot_id, self._iveg.now.mono, tuple(seen)))

    def _reported(self) -> Iterator[Pair]:
        """Detections that iVeg reports for the frames of this step."""
        looks, self._detections = self._detections, []
        for real in looks:
            frame = self._views.frame(real.robot_id, self._iveg.now)
            items = [] if frame is None else frame.items
            seen = (
                SeenObject(
                    str(place),
                    one.class_id,
                    one.position.x,
                    one.position.y,
                    one.probability,
                )
                for place, one in enumerate(items)
            )
            yield real, Picture(real.robot_id, real.at, tuple(seen))

    def _believe(self) -> None:
        evaluator, now = self._iveg.parts.evaluator, self._iveg.now
        zones = zones_of(evaluator.world, evaluator.people, evaluator.rule, now)
        own = self._mapper.of(self._watched, (), now)
        shared = self._mapper.of(self._watched, zones, now)
        if own is not None and shared is not None:
            self._result.beliefs.append((now.mono, belief_of(own, shared)))

    def _touches(self) -> int:
        people = self._world.discs()
        return sum(
            body.gap_to(one.x, one.y)[0] < one.radius
            for body in self._world.bodies()
            for one in people
        )
