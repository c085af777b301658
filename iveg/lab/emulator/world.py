"""Simulated world: robots and people, each robot's sensor values, and the truth."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import REST, Pose2D, Twist2D
from iveg.domain.goals import Goal
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.kinds import SENSED
from iveg.domain.observations import (
    UNKNOWN_ORIGIN,
    Battery,
    DetectionFrame,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    Origin,
)
from iveg.lab.emulator.camera import (
    DetectorModel,
    EmulatedDetector,
    Target,
    person_target,
    robot_target,
)
from iveg.lab.emulator.greenhouse import Body, Disc, LaserModel, Scenery, sweep
from iveg.lab.emulator.layout import Layout
from iveg.lab.emulator.navigation import Navigator, Odometer, Vehicle
from iveg.lab.emulator.scenarios import RobotScript, SimulatedPerson

_BATTERY_LASTS_S = 8 * 3600.0
_BATTERY_FULL, _BATTERY_SWAPPED = 0.95, 0.30


def battery_after(driven_s: float) -> Battery:
    """A battery that drains while driving and is swapped before it is low."""
    usable = _BATTERY_FULL - _BATTERY_SWAPPED
    level = _BATTERY_FULL - (driven_s / _BATTERY_LASTS_S) % usable
    return Battery("", UNKNOWN_ORIGIN, round(level, 3), charging=False, voltage=25.6)


EMULATED: Mapping[type[Observation], Callable[[float], Observation]] = {
    Battery: battery_after,
}
"""The observation after a time of driving (s), by kind."""


@dataclass(slots=True)
class EmulatedSensors:
    """The small sensors of one robot, each at its own rate."""

    _sent_at: dict[str, float] = field(default_factory=dict)

    def due(self, now: float) -> Iterator[Observation]:
        """Readings to be sent ``now`` (s of the run)."""
        for kind in SENSED:
            every_s = kind.sensor.every_s if kind.sensor else 0.0
            if now - self._sent_at.get(kind.name, -every_s) >= every_s:
                self._sent_at[kind.name] = now
                yield EMULATED[kind.type_](now)


_LASER = LaserModel()


class RobotHardware:
    """Hardware and navigation of one robot; the safety node sits in between.

    Attributes:
        command: Last command of the drive.
        detector: Camera and detector.
    """

    def __init__(
        self,
        robot_id: str,
        profile: RobotProfile,
        script: RobotScript,
        detector: DetectorModel,
        rng: np.random.Generator,
    ) -> None:
        self.robot_id = robot_id
        self.profile = profile
        self.command = REST
        self._rng = rng
        self._odometer = Odometer(rng)
        self.detector = EmulatedDetector(profile, detector, rng)
        self.vehicle = Vehicle(self.profile, script.start)
        self._believed = script.start
        self._navigator = Navigator(profile, script)

    def drive(self, command: Twist2D) -> None:
        """Set the command of the drive; it holds until the next."""
        self.command = command

    def move(self, dt: float) -> None:
        """Move the wheels for ``dt`` seconds."""
        self.vehicle.step(self.command, dt)
        truth, twist = self.vehicle.pose, self.vehicle.twist
        self._believed = self._odometer.measure(truth, twist, dt)

    def requested_twist(self, now: float, around: "SimulatedWorld") -> Twist2D:
        """Twist that navigation requests; ``now`` in seconds into the run."""
        discs = around.discs()
        for body in around.bodies_but(self.robot_id):
            discs.extend(body.discs())
        return self._navigator.requested_twist(self.vehicle.pose, now, discs)

    def pursue(self, goal: Goal | None, around: "SimulatedWorld") -> bool:
        """Drive to a goal, or give it up; returns whether a way there is known."""
        return self._navigator.pursue(goal, self.vehicle.pose, around.scenery)

    # --- sensors ------------------------------------------------------------------

    def odometry(self) -> Odometry:
        """Estimated pose, measured speeds."""
        return Odometry(self.robot_id, Origin(), self._believed, self.vehicle.twist)

    def scan(self, around: "SimulatedWorld") -> LaserScan:
        """One turn of the laser."""
        ranges = sweep(
            self.vehicle.pose.compose(self.profile.laser),
            _LASER,
            around.scenery,
            around.discs(),
            around.bodies_but(self.robot_id),
            self._rng,
        )
        return LaserScan(
            self.robot_id,
            Origin(),
            -math.pi,
            _LASER.angle_increment,
            _LASER.range_min,
            _LASER.range_max,
            self.profile.laser,
            ranges,
        )

    def detect(self, now: float, around: "SimulatedWorld") -> DetectionFrame:
        """One frame of camera and detector; empty when nothing is seen."""
        pose, targets = self.vehicle.pose, around.targets_for(self.robot_id)
        boxes = self.detector.detect(now, pose, targets, around.scenery)
        return DetectionFrame(self.robot_id, Origin(), boxes, (), self.detector.name)

    def navigation(self) -> Navigation:
        """The intent: task, goal and path."""
        return self._navigator.intent(self.robot_id)


class SimulatedWorld:
    """Scenery, robots and people.

    Args:
        greenhouse: The greenhouse.
        layout: Robots and people with their routes.
        detector: Error model of the robots' detectors.
        seed: The same seed gives the same people and the same noise.
    """

    def __init__(
        self,
        greenhouse: Greenhouse,
        layout: Layout,
        detector: DetectorModel,
        seed: int,
    ) -> None:
        streams = np.random.SeedSequence(seed).spawn(
            len(layout.robots) + len(layout.people) + 1
        )
        generators = [np.random.default_rng(stream) for stream in streams]
        self.scenery = Scenery.from_greenhouse(greenhouse, generators.pop())
        self.rigs: Mapping[str, RobotHardware] = {
            robot_id: RobotHardware(
                robot_id,
                layout.profiles[robot_id],
                script,
                detector,
                rng,
            )
            for (robot_id, script), rng in zip(
                layout.robots.items(), generators, strict=False
            )
        }
        self.people = [
            SimulatedPerson(round_, rng)
            for round_, rng in zip(
                layout.people, generators[len(layout.robots) :], strict=True
            )
        ]

    def walk(self, dt: float) -> None:
        """Move the people for ``dt`` seconds."""
        bodies = self.bodies()
        for person in self.people:
            person.step(dt, bodies, self.scenery)

    def bodies(self) -> list[Body]:
        """Footprints of all robots."""
        return [rig.vehicle.body(rig.robot_id) for rig in self.rigs.values()]

    def bodies_but(self, robot_id: str) -> list[Body]:
        """The other robots, as obstacles for one of them."""
        return [body for body in self.bodies() if body.robot_id != robot_id]

    def discs(self) -> list[Disc]:
        """Footprints of all people."""
        return [person.disc for person in self.people]

    def targets_for(self, robot_id: str) -> list[Target]:
        """Possible targets of a robot's camera."""
        people = [person_target(n, disc) for n, disc in enumerate(self.discs())]
        return people + [robot_target(body) for body in self.bodies_but(robot_id)]


def in_view(
    rig: RobotHardware, world: SimulatedWorld
) -> Iterator[tuple[Target, float]]:
    """Targets in view of a robot's camera, with the visible share (0 to 1)."""
    camera = rig.vehicle.pose.compose(rig.profile.camera)
    for target in world.targets_for(rig.robot_id):
        part = rig.detector.part_in_view(camera, target.body, world.scenery)
        if part > 0.0:
            yield target, part


def true_picture(
    rig: RobotHardware, world: SimulatedWorld, at: float, wanted: float, factor: float
) -> dict[str, object]:
    """The truth of one picture.

    ``{"robot", "at": Unix s, "pose": {"x", "y", "yaw"}, "speed", "wanted", "factor",
    "visible": [{"key", "class", "x", "y", "part"}], "people": [{"key", "x", "y"}]}``:
    the robot's true pose in ``map`` (m, rad) and speed (m/s), its speed limits, all
    targets with their part (0 to 1) in its view, and every person in the greenhouse, by
    their true positions, independent of the detector.

    Args:
        rig: The robot that took the picture.
        world: All robots and people.
        at: When the picture was taken (Unix s, by the robot's own clock).
        wanted: Speed that its navigation asks for (m/s); 0 while it is held.
        factor: Greatest share of it that its own safety machine allows (0 to 1).
    """
    pose = rig.vehicle.pose
    return {
        "robot": rig.robot_id,
        "at": at,
        "pose": {**_place(pose), "yaw": round(pose.yaw, 4)},
        "speed": round(rig.vehicle.twist.linear_x, 3),
        "wanted": round(wanted, 3),
        "factor": factor,
        "visible": [
            {
                "key": target.key,
                "class": target.class_id,
                **_place(target.body.pose),
                "part": round(part, 2),
            }
            for target, part in in_view(rig, world)
        ],
        "people": [
            {
                "key": f"person-{number}",
                **_place(disc),
            }
            for number, disc in enumerate(world.discs())
        ],
    }


def _place(point: Pose2D | Disc) -> dict[str, float]:
    return {"x": round(point.x, 3), "y": round(point.y, 3)}
