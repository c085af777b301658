"""Stages of an experiment: robots and iVeg on a virtual clock, and their records."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from typing import Final

from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.greenhouses import load_greenhouse
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import Feedback
from iveg.domain.geometry import REST, Pose2D
from iveg.domain.laser import Plan
from iveg.domain.observations import Instant
from iveg.domain.records import Json
from iveg.lab.emulator.camera import DETECTORS
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.world import RobotHardware, SimulatedWorld, true_picture
from iveg.lab.experiment.messages import MessageTimes
from iveg.lab.experiment.plan import ROBOTS, PlannedRun
from iveg.lab.experiment.scoring import Picture, SeenObject
from iveg.lab.experiment.virtual import VirtualPipeline
from iveg.ngsi import codec
from iveg.pipeline import Pipeline
from iveg.robot.holds import HoldSet
from iveg.robot.judgement import Limits
from iveg.robot.safety import Drive, Effect, Report, SafetyMachine, SendAnswer
from iveg.robot.uplink import Sender, Uplink
from iveg.web.views import Views

Row = Json


@dataclass(slots=True)
class VirtualRecording:
    """The half on the virtual clock.

    Attributes:
        truth: The emulator's rows, one a picture (``emulator.world.true_picture``).
        reported: Detections of each of these pictures, as iVeg shows them.
        encounters: Encounters with people as iVeg published them at each picture
            (``protection.moments_of``).
    """

    truth: list[Row] = field(default_factory=list)
    reported: list[Picture] = field(default_factory=list)
    encounters: list[Row] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class TimedRecording:
    """The half in real time, through all programs.

    Attributes:
        began, ended: When it was measured (Unix s).
        times: Each message between them.
        completed: Whether all robots were live at both ends.
    """

    began: float
    ended: float
    times: Sequence[MessageTimes]
    completed: bool


def picture_of_truth(row: Row) -> Picture:
    """One true picture, in the robot's frame."""
    pose = Pose2D(**row["pose"])
    targets = []
    for target in row["visible"]:
        x, y = pose.inverse(target["x"], target["y"])
        targets.append(SeenObject(target["key"], target["class"], x, y))
    return Picture(row["robot"], row["at"], tuple(targets))


def picture_of(frame: Row, at: float) -> Picture:
    """One detection frame as iVeg shows it, taken at this time (s).

    Emulated detectors give every box in ``base_link``.
    """
    boxes = []
    for number, item in enumerate(frame["items"]):
        box, confidence = item["box"], item["probability"]
        x, y = (box["xmin"] + box["xmax"]) / 2, (box["ymin"] + box["ymax"]) / 2
        boxes.append(SeenObject(str(number), item["class_id"], x, y, confidence))
    return Picture(frame["robot_id"], at, tuple(boxes))


STEP_S: Final = 0.05


_LOOK_EVERY, _NAVIGATION_EVERY = 2, 20
"""Steps between two camera frames, the first once all odometry was sent, and between
two messages of navigation."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensing:
    """Senses of staged robots, beside cameras.

    Attributes:
        scan_every: Steps between two sweeps of a laser; 0: none.
        own_laser: A robot's own software reads its laser, too.
        plan: Drawn objects of the greenhouse, which a laser need not report.
        looked: Called when a camera has taken a picture.
    """

    scan_every: int = 0
    own_laser: bool = True
    plan: Plan | None = None
    looked: Callable[[RobotHardware], None] | None = None


CAMERAS_ALONE: Final = Sensing()


class StagedRobot:
    """One rig with its safety machine, whose effects are executed at once.

    Args:
        publish: Called with the topic and payload of its messages.
        sensing: Its senses.

    Attributes:
        wanted: Speed that its navigation asks for (m/s); 0 while it is held.
    """

    def __init__(
        self,
        rig: RobotHardware,
        now: Instant,
        publish: Callable[[str, bytes], None],
        sensing: Sensing,
    ) -> None:
        texts = count(1)
        self._rig, self._publish, self._sensing = rig, publish, sensing
        self.wanted = 0.0
        self._machine = SafetyMachine(
            rig.robot_id,
            "b1",
            now.mono,
            stored=HoldSet(),
            fresh=lambda: f"{rig.robot_id}-{next(texts)}",
            limits=Limits(rig.profile, plan=sensing.plan),
        )
        sender, authors = Sender(rig.robot_id, "iveg", "b1"), self._machine.authors
        self._uplink = Uplink(sender, publish, authors.echoes)
        self._perform(self._machine.release_locally(now.mono), now)

    def step(self, number: int, world: SimulatedWorld, now: Instant) -> None:
        """Navigate, drive, sense."""
        into_run, sensing = number * STEP_S, self._sensing
        requested = REST
        if self._machine.may_drive:
            requested = self._rig.requested_twist(into_run, world)
        self.wanted = abs(requested.linear_x)
        self._perform(self._machine.request_twist(requested, now.mono), now)
        self._rig.move(STEP_S)
        moved = self._rig.odometry()
        self._perform(self._machine.odometry(moved.pose, moved.twist, now.mono), now)
        self._uplink.send(moved, now)
        if sensing.scan_every and number % sensing.scan_every == 0:
            scan = self._rig.scan(world)
            if sensing.own_laser:
                self._perform(self._machine.scan(scan, now.mono), now)
            self._uplink.send(scan, now)
        if number % _LOOK_EVERY == 1:
            self._uplink.send(self._rig.detect(into_run, world), now)
            if sensing.looked is not None:
                sensing.looked(self._rig)
        if number % _NAVIGATION_EVERY == 0:
            intent = self._rig.navigation()
            self._machine.note_path(intent.path, now.mono)
            self._uplink.send(intent, now)

    def listen(self, topic: str, payload: bytes, now: Instant) -> None:
        """Take iVeg's feedback to a robot of the fleet."""
        feedback = codec.read_feedback(payload)
        self._perform(self._machine.feedback(topic, feedback, now.mono), now)

    def order(self, payload: bytes, now: Instant) -> None:
        """Take an order that iVeg sends to this robot."""
        self._perform(self._machine.command(payload, now.mono), now)

    @property
    def speed(self) -> float:
        """True speed (m/s)."""
        return abs(self._rig.vehicle.twist.linear_x)

    @property
    def factor(self) -> float:
        """Greatest share of the wanted speed that its safety machine allows now."""
        return self._machine.cap.factor if self._machine.may_drive else 0.0

    def _perform(self, effects: Sequence[Effect], now: Instant) -> None:
        for effect in effects:
            match effect:
                case Drive(twist):
                    self._rig.drive(twist)
                case Report(report):
                    seq, (_, message) = self._uplink.report(report, now)
                    self._machine.reported(seq, now.mono)
                    self._publish(*message)
                case SendAnswer(answer):
                    message = self._uplink.answer(answer, now)
                    self._publish(*message)


class Stage:
    """One scenario in steps of a twentieth of a second.

    Args:
        parts: iVeg.
        feedback: Feedback that iVeg has published; it grows.
        move_clock: Sets the clock to seconds after the start; returns the time.
        publish: Called with each message of a robot, from its creation on.
        sensing: Senses of all robots.

    Attributes:
        robots: Its robots, by id.
    """

    def __init__(
        self,
        world: SimulatedWorld,
        parts: Pipeline,
        feedback: Sequence[Feedback],
        move_clock: Callable[[float], Instant],
        publish: Callable[[str, bytes], None],
        sensing: Sensing = CAMERAS_ALONE,
    ) -> None:
        self._world, self._parts = world, parts
        self._feedback, self._move_clock = feedback, move_clock
        self.now = move_clock(0.0)
        self.robots = {
            robot_id: StagedRobot(rig, self.now, publish, sensing)
            for robot_id, rig in world.rigs.items()
        }
        self._delivered = self._steps = 0

    def step(self) -> None:
        """Advance everything by a twentieth of a second."""
        number = self._steps
        self._steps += 1
        self.now = self._move_clock(round(self._steps * STEP_S, 6))
        self._world.walk(STEP_S)
        for robot in self.robots.values():
            robot.step(number, self._world, self.now)
        self._parts.loop.step(self._parts.ingest.drain(), self.now)
        self._deliver()

    def _deliver(self) -> None:
        """Deliver new feedback to every robot."""
        new = self._feedback[self._delivered :]
        self._delivered += len(new)
        for feedback in new:
            payload = codec.write_feedback(feedback)
            for robot in self.robots.values():
                robot.listen(feedback.robot_id, payload, self.now)


_SCAN_EVERY, _REST_EVERY = 2, 20
"""Steps between two sweeps, and two rests for other tasks."""


class VirtualRun:
    """One scenario in a pipeline of its own.

    Args:
        step: The run.
        rule: The rule in force; a run by the paper's rule uses a part of it.
    """

    def __init__(self, step: PlannedRun, rule: DetectionRule) -> None:
        scenario = scenario_named(step.family)
        greenhouse = load_greenhouse(scenario.greenhouse)
        layout = lay_out(scenario, ROBOTS, greenhouse)
        self._result = VirtualRecording()
        by_paper = step.rule == "paper"
        if by_paper:
            rule = replace(rule, possible_people=False, foresight=False)
        self._iveg = iveg = VirtualPipeline(load_fleet(words=ROBOTS), greenhouse, rule)
        self._views = Views(iveg.parts)
        detector = DETECTORS[step.profile]
        self._world = SimulatedWorld(greenhouse, layout, detector, step.seed)
        self._stage = Stage(
            self._world,
            iveg.parts,
            iveg.feedback,
            iveg.move,
            iveg.hear,
            Sensing(
                scan_every=0 if by_paper else _SCAN_EVERY,
                plan=Plan.from_greenhouse(greenhouse),
                looked=self._looked,
            ),
        )

    async def play(self, seconds: float) -> VirtualRecording:
        """Run from the start; yields to other tasks once a virtual second."""
        for number in range(round(seconds / STEP_S)):
            self._stage.step()
            self._report()
            if number % _REST_EVERY == 0:
                await asyncio.sleep(0)
        return self._result

    def _looked(self, rig: RobotHardware) -> None:
        """Keep the truth at the moment of the picture."""
        robot, now = self._stage.robots[rig.robot_id], self._iveg.now.mono
        truth = true_picture(rig, self._world, now, robot.wanted, robot.factor)
        self._result.truth.append(truth)

    def _report(self) -> None:
        """Keep what iVeg reports for the pictures of this step, beside the truth."""
        for row in self._result.truth[len(self._result.reported) :]:
            frame = self._views.frame(row["robot"], self._iveg.now)
            self._result.encounters.append(encounter_row(self._iveg, row))
            self._result.reported.append(
                picture_of(frame.model_dump(mode="json"), row["at"])
                if frame is not None
                else Picture(row["robot"], row["at"], ())
            )


def encounter_row(iveg: VirtualPipeline, truth: Row) -> Row:
    """Encounters with people that iVeg publishes now for a robot of the truth."""
    people = [
        {"x": round(encounter.zone.x, 3), "y": round(encounter.zone.y, 3)}
        for encounter in iveg.parts.evaluator.encounters(truth["robot"], iveg.now)
        if encounter.zone.reason == "person"
    ]
    return {"robot": truth["robot"], "at": truth["at"], "people": people}
