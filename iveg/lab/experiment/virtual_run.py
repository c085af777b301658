"""One run on the virtual clock, which gives all counts.

Real programs depend on the scheduling of the processor; this run does not, so that two
runs of one seed give the same counts on any machine.
"""

import asyncio
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace

from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.greenhouses import load_greenhouse
from iveg.app.virtual import VirtualPipeline
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.witness import Outline, Plan
from iveg.lab.emulator.detector_model import DETECTORS
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.scripts import Incident
from iveg.lab.emulator.truth import true_picture
from iveg.lab.emulator.world import RobotHardware, SimulatedWorld
from iveg.lab.experiment.beliefs import belief_of
from iveg.lab.experiment.failures import FAILURES, LINK_LOST_S, drawn
from iveg.lab.experiment.moments import moments_of
from iveg.lab.experiment.plan import ROBOTS, WATCHED, PlannedRun
from iveg.lab.experiment.protection_scoring import protection_of
from iveg.lab.experiment.recording import Row, RunRecording, picture_of
from iveg.lab.experiment.scoring import Picture
from iveg.lab.experiment.stage import Stage
from iveg.lab.experiment.staged_robot import STEP_S
from iveg.pipeline.mapping import Mapper
from iveg.robot.costmap import FleetCostmap
from iveg.web.views import Views

_SCAN_EVERY, _BELIEVE_EVERY, _REST_EVERY = 2, 20, 20
"""Steps between two sweeps, two looks into a costmap, and two rests for others."""


@dataclass(slots=True)
class VirtualRunResult(RunRecording):
    """Result of a run; its clock begins at 0.

    Attributes:
        touched: Moments at which a robot touched a person.
        unheard_s: Longest time in which iVeg did not hear a robot that it had heard.
    """

    touched: int = 0
    unheard_s: float = 0.0


class VirtualRun:
    """One scenario in a pipeline of its own.

    Args:
        step: The run.
        rule: The rule as it stands; that of a run by the paper's rule is made of it.
    """

    def __init__(self, step: PlannedRun, rule: DetectionRule) -> None:
        scenario = scenario_named(step.family)
        greenhouse = load_greenhouse(scenario.greenhouse)
        layout = lay_out(scenario, ROBOTS, greenhouse)
        self._result = VirtualRunResult()
        self._looks: list[Row] = []
        self._heard_at: dict[str, float] = {}
        by_paper = step.rule == "paper"
        if by_paper:
            rule = replace(rule, possible_people=False, foresight=False)
        self._iveg = iveg = VirtualPipeline(load_fleet(words=ROBOTS), greenhouse, rule)
        self._mapper = Mapper(iveg.parts.world, greenhouse.bounds)
        self._views = Views(iveg.parts)
        detector = DETECTORS[layout.detector or step.profile]
        self._world = SimulatedWorld(greenhouse, layout, detector, step.seed)
        self._stage = Stage(
            self._world,
            (*layout.incidents, *_failures(step)),
            iveg.parts.ingest,
            iveg.parts.loop,
            iveg.feedback,
            iveg.move,
            iveg.hear,
            looked=self._looked,
            scan_every=0 if by_paper else _SCAN_EVERY,
            plan=Plan.of(greenhouse),
            peer_scans=iveg.peer_scans,
        )
        self._watched = self._stage.robots[WATCHED]
        self.happen = self._stage.happen
        body = self._world.rigs[WATCHED].profile
        outline = Outline(body.length, body.width)
        self._watched.costmap = FleetCostmap(WATCHED, outline, greenhouse.bounds)

    async def play(self, seconds: float) -> VirtualRunResult:
        """Run from the start; yields to other tasks once a virtual second."""
        for number in range(round(seconds / STEP_S)):
            self._stage.step()
            self._mapper.tick(self._iveg.now)
            self._iveg.parts.peer_scans.tick(self._iveg.now)
            self._report()
            if number % _BELIEVE_EVERY == 1:
                self._believe()
            self._result.touched += self._touches()
            self._listen()
            if number % _REST_EVERY == 0:
                await asyncio.sleep(0)
        self._result.decisions = [asdict(one) for one in self._iveg.decisions.values()]
        result = self._result
        result.failures = [*self._failed()]
        result.completed = bool(result.reported) and not result.failures
        return result

    def _failed(self) -> Iterator[str]:
        """Why the run is none that was completed."""
        result, robots = self._result, self._iveg.parts.world.robots
        if any(rig.is_stuck for rig in self._world.rigs.values()):
            yield "navigation"
        ends_live = all(robots[one].link(self._iveg.now) == "LIVE" for one in ROBOTS)
        if not ends_live or result.unheard_s > LINK_LOST_S:
            yield "link"
        if result.touched:
            yield "touched"
        met = protection_of(moments_of(result.truth)).delays_s
        if None in met:
            yield "missed"

    def _listen(self) -> None:
        """How long robots are not heard."""
        now = self._iveg.now
        for robot_id in ROBOTS:
            if self._iveg.parts.world.robots[robot_id].link(now) == "LIVE":
                self._heard_at[robot_id] = now.mono
            unheard_s = now.mono - self._heard_at.get(robot_id, now.mono)
            self._result.unheard_s = max(self._result.unheard_s, unheard_s)

    def _looked(self, rig: RobotHardware) -> None:
        """The truth at the moment of the picture."""
        driving = self._stage.robots[rig.robot_id].driving
        now = self._iveg.now.mono
        self._looks.append(true_picture(rig, self._world, now, driving))

    def _report(self) -> None:
        """Keep what iVeg reports for the frames of this step, beside the truth."""
        looks, self._looks = self._looks, []
        for row in looks:
            frame = self._views.frame(row["robot"], self._iveg.now)
            document = {} if frame is None else frame.model_dump(mode="json")
            picture = picture_of(document, row["at"]) if document else None
            self._result.truth.append(row)
            self._result.foretold.append(foretold_row(self._iveg, row))
            self._result.reported.append(
                picture or Picture(row["robot"], row["at"], ())
            )

    def _believe(self) -> None:
        """Look into the watched robot's own costmap, beside what its laser found."""
        now = self._iveg.now
        own, with_peers = self._mapper.of(WATCHED, (), now), self._watched.believe(now)
        if own is not None and with_peers is not None:
            self._result.beliefs.append((now.mono, belief_of(own, with_peers)))

    def _touches(self) -> int:
        people = self._world.discs()
        return sum(
            body.gap_to(one.x, one.y)[0] < one.radius
            for body in self._world.bodies()
            for one in people
        )


def _failures(step: PlannedRun) -> tuple[Incident, ...]:
    if not step.fails:
        return ()
    return drawn(FAILURES[step.profile], ROBOTS, step.counted_s, step.seed)


def foretold_row(iveg: VirtualPipeline, truth: Row) -> Row:
    """Encounters with people that iVeg tells now of the robot of a row of the truth."""
    people = [
        {"x": round(one.zone.x, 3), "y": round(one.zone.y, 3)}
        for one in iveg.parts.evaluator.foretold(truth["robot"], iveg.now)
        if one.zone.reason == "person"
    ]
    return {"robot": truth["robot"], "at": truth["at"], "people": people}
