"""Stages of an experiment: robots and iVeg on a virtual clock, and what is recorded."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from typing import Final

from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.greenhouses import load_greenhouse
from iveg.app.virtual import VirtualPipeline
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import Feedback
from iveg.domain.geometry import REST, Pose2D
from iveg.domain.observations import FeedbackRef, Instant
from iveg.domain.records import Json
from iveg.domain.witness import Outline, Plan
from iveg.lab.emulator.camera import DETECTORS
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.orders import FaultOrder
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.world import Driving, RobotHardware, SimulatedWorld, true_picture
from iveg.lab.experiment.messages import MessageTimes
from iveg.lab.experiment.plan import ROBOTS, PlannedRun
from iveg.lab.experiment.scoring import Picture, SeenObject
from iveg.ngsi import codec
from iveg.robot.holds import HoldSet
from iveg.robot.judgement import Limits
from iveg.robot.orders import Drive, Effect, Report, SendAnswer
from iveg.robot.safety import SafetyMachine
from iveg.robot.uplink import Origins, Uplink
from iveg.vital.ingest import Ingest
from iveg.vital.loop import RuleLoop
from iveg.web.views import Views

Row = Json


@dataclass(slots=True)
class VirtualRecording:
    """The half on the virtual clock.

    Attributes:
        truth: The emulator's rows, one a picture (``emulator.world.true_picture``).
        reported: Detections of each of these pictures, as iVeg shows them.
        foretold: Encounters with people as iVeg published them at each picture
            (``protection.moments_of``).
    """

    truth: list[Row] = field(default_factory=list)
    reported: list[Picture] = field(default_factory=list)
    foretold: list[Row] = field(default_factory=list)


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
    seen = []
    for target in row["visible"]:
        x, y = pose.inverse(target["x"], target["y"])
        seen.append(SeenObject(target["key"], target["class"], x, y))
    return Picture(row["robot"], row["at"], tuple(seen))


def picture_of(frame: Row, at: float) -> Picture:
    """One detection frame as iVeg shows it, taken at this time (s).

    Emulated detectors give every box in ``base_link``.
    """
    seen = []
    for number, item in enumerate(frame["items"]):
        box, confidence = item["box"], item["probability"]
        x, y = (box["xmin"] + box["xmax"]) / 2, (box["ymin"] + box["ymax"]) / 2
        seen.append(SeenObject(str(number), item["class_id"], x, y, confidence))
    return Picture(frame["robot_id"], at, tuple(seen))


STEP_S: Final = 0.05


_LOOK_EVERY, _NAVIGATION_EVERY = 2, 20
"""Steps between two camera frames, the first once all odometry was sent, and between
two messages of navigation."""


Looked = Callable[[RobotHardware], None]


class StagedRobot:
    """One rig with its safety machine, whose effects are executed at once.

    Args:
        publish: Called with the topic and payload of its messages.
        looked: Called when its camera has taken a picture.
        scan_every: Steps between two sweeps of its laser; 0: none.
        plan: What stands in the greenhouse.
        is_witness: Its own software reads its laser, too.
    """

    def __init__(
        self,
        rig: RobotHardware,
        now: Instant,
        publish: Callable[[str, bytes], None],
        looked: Looked = lambda _: None,
        scan_every: int = 0,
        plan: Plan | None = None,
        *,
        is_witness: bool = True,
    ) -> None:
        texts = count(1)
        self._rig = rig
        self._publish = publish
        self._looked = looked
        self._scan_every = scan_every
        self._is_witness = is_witness
        self._wanted = 0.0
        self._echoes: tuple[FeedbackRef, ...] = ()
        origins = Origins("b1", echoes=lambda: self._echoes)
        self._uplink = Uplink(rig.robot_id, "iveg", origins, self._say)
        self._machine = SafetyMachine(
            rig.robot_id,
            "b1",
            now.mono,
            stored=HoldSet(),
            fresh=lambda: f"{rig.robot_id}-{next(texts)}",
            limits=Limits(
                rig.profile.max_speed,
                rig.profile.max_turn,
                outline=Outline(rig.profile.length, rig.profile.width),
                plan=plan,
                braking=rig.profile.braking,
            ),
        )
        self._perform(self._machine.release_locally(now.mono), now)

    def step(self, number: int, world: SimulatedWorld, now: Instant) -> None:
        """Navigate, drive, sense."""
        into_run = number * STEP_S
        free = self._machine.may_drive
        requested = self._rig.requested_twist(into_run, world) if free else REST
        self._wanted = abs(requested.linear_x)
        self._perform(self._machine.request_twist(requested, now.mono), now)
        if self._rig.faults.deaf and free:
            self._rig.drive(requested)
        self._rig.move(STEP_S)
        moved = self._rig.odometry()
        self._perform(self._machine.odometry(moved.pose, moved.twist, now.mono), now)
        now = self._dated(now)
        self._uplink.send(moved, now)
        if self._scan_every and number % self._scan_every == 0:
            scan = self._rig.scan(world)
            if self._is_witness:
                self._perform(self._machine.scan(scan, now.mono), now)
            self._uplink.send(scan, now)
        if number % _LOOK_EVERY == 1:
            self._uplink.send(self._rig.detect(into_run, world), now)
            self._looked(self._rig)
        if number % _NAVIGATION_EVERY == 0:
            intent = self._rig.navigation()
            self._machine.note_path(intent.path, now.mono)
            self._uplink.send(intent, now)

    def _dated(self, now: Instant) -> Instant:
        """Readings of its own clocks."""
        return Instant(now.mono, now.wall + (self._rig.faults.clock_offset_s or 0.0))

    def obey(self, order: FaultOrder) -> None:
        """Take faults of camera and navigation, ``mute``, ``deaf``, ``clock_offset_s``.

        A mute robot's messages do not arrive; a deaf one ignores iVeg's speed limits,
        but not holds.
        """
        self._rig.obey(order)

    def listen(self, topic: str, payload: bytes, now: Instant) -> None:
        """Take iVeg's feedback to a robot of the fleet."""
        feedback = codec.read_feedback(payload)
        effects = self._machine.feedback(topic, feedback, now.mono)
        self._echoes = self._machine.authors.echoes(now.mono)
        self._perform(effects, now)

    def order(self, payload: bytes, now: Instant) -> None:
        """Take an order that iVeg sends to this robot."""
        self._perform(self._machine.command(payload, now.mono), now)

    @property
    def speed(self) -> float:
        """True speed (m/s)."""
        return abs(self._rig.vehicle.twist.linear_x)

    @property
    def driving(self) -> Driving:
        """Speed that it may drive now."""
        factor = self._machine.cap.factor if self._machine.may_drive else 0.0
        return Driving(self._wanted, factor)

    def _perform(self, effects: Sequence[Effect], now: Instant) -> None:
        for effect in effects:
            match effect:
                case Drive(twist):
                    self._rig.drive(twist)
                case Report(report):
                    seq, (_, message) = self._uplink.report(report, self._dated(now))
                    self._machine.reported(seq, now.mono)
                    self._say(*message)
                case SendAnswer(answer):
                    message = self._uplink.answer(answer, self._dated(now))
                    self._say(*message)

    def _say(self, topic: str, payload: bytes) -> None:
        if not self._rig.faults.mute:
            self._publish(topic, payload)


class Stage:
    """One scenario in steps of a twentieth of a second.

    Args:
        feedback: Feedback that iVeg has published; it grows.
        move_clock: Advances the clock by seconds; returns the time.
        publish: Called with each message of a robot, from its creation on.
        looked, scan_every, plan, is_witness: As for ``StagedRobot``.

    Attributes:
        robots: Its robots, by id.
    """

    def __init__(
        self,
        world: SimulatedWorld,
        ingest: Ingest,
        loop: RuleLoop,
        feedback: Sequence[Feedback],
        move_clock: Callable[[float], Instant],
        publish: Callable[[str, bytes], None],
        *,
        looked: Looked = lambda _: None,
        scan_every: int = 0,
        plan: Plan | None = None,
        is_witness: bool = True,
    ) -> None:
        self._world = world
        self._ingest, self._loop, self._feedback = ingest, loop, feedback
        self._move_clock = move_clock
        self.now = move_clock(0.0)
        self.robots = {
            robot_id: StagedRobot(
                rig, self.now, publish, looked, scan_every, plan, is_witness=is_witness
            )
            for robot_id, rig in world.rigs.items()
        }
        self._delivered = 0
        self._steps = 0

    def step(self) -> None:
        """Advance everything by a twentieth of a second."""
        number = self._steps
        self._steps += 1
        self.now = self._move_clock(round(self._steps * STEP_S, 6))
        self._world.walk(STEP_S)
        for robot in self.robots.values():
            robot.step(number, self._world, self.now)
        self._loop.step(self._ingest.drain(), self.now)
        self._deliver()

    def happen(self, order: FaultOrder) -> None:
        """Inject a fault into a robot, or end it."""
        self.robots[order.robot].obey(order)

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
        rule: The rule as it stands; that of a run by the paper's rule is made of it.
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
            iveg.parts.ingest,
            iveg.parts.loop,
            iveg.feedback,
            iveg.move,
            iveg.hear,
            looked=self._looked,
            scan_every=0 if by_paper else _SCAN_EVERY,
            plan=Plan.of(greenhouse),
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
        driving = self._stage.robots[rig.robot_id].driving
        now = self._iveg.now.mono
        self._result.truth.append(true_picture(rig, self._world, now, driving))

    def _report(self) -> None:
        """Keep what iVeg reports for the pictures of this step, beside the truth."""
        for row in self._result.truth[len(self._result.reported) :]:
            frame = self._views.frame(row["robot"], self._iveg.now)
            self._result.foretold.append(foretold_row(self._iveg, row))
            self._result.reported.append(
                picture_of(frame.model_dump(mode="json"), row["at"])
                if frame is not None
                else Picture(row["robot"], row["at"], ())
            )


def foretold_row(iveg: VirtualPipeline, truth: Row) -> Row:
    """Encounters with people that iVeg publishes now of the robot of a true picture."""
    people = [
        {"x": round(encounter.zone.x, 3), "y": round(encounter.zone.y, 3)}
        for encounter in iveg.parts.evaluator.encounters(truth["robot"], iveg.now)
        if encounter.zone.reason == "person"
    ]
    return {"robot": truth["robot"], "at": truth["at"], "people": people}
