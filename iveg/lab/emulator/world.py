"""The simulated world: robots and people, and each robot's sensor values.

Deterministic for a seed: time is an argument, so an hour is a loop of steps.
``fleet.py`` runs the same world in real time over MQTT.
"""

import math
from collections.abc import Mapping
from typing import Literal

import numpy as np

from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import REST, Twist2D
from iveg.domain.goals import Goal
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import (
    DetectionFrame,
    LaserScan,
    Navigation,
    Odometry,
    Origin,
)
from iveg.lab.emulator.camera import EmulatedDetector, upright_box
from iveg.lab.emulator.detector_model import PERSON, DetectorModel
from iveg.lab.emulator.greenhouse import Body, Disc, Scenery
from iveg.lab.emulator.grounded import GroundedCamera
from iveg.lab.emulator.kinematics import Vehicle
from iveg.lab.emulator.layout import Layout
from iveg.lab.emulator.lidar import LaserModel, sweep
from iveg.lab.emulator.navigation import Navigator
from iveg.lab.emulator.odometer import Odometer
from iveg.lab.emulator.orders import FaultOrder
from iveg.lab.emulator.people import SimulatedPerson
from iveg.lab.emulator.scripts import RobotScript
from iveg.lab.emulator.targets import Target, person_target, robot_target, thing_target

Camera = Literal["boxes", "grounding"]
_LASER = LaserModel()
_FALSE_PERSON_CONFIDENCE = 0.95


class RobotHardware:
    """Hardware and navigation of one robot; the safety node sits in between.

    Attributes:
        command: Last command of the drive.
        false_person: Fault: a position in ``map`` where the camera detects a person.
        thing: Fault: one where it takes a thing for a person when it is in view.
        hides_people: Fault: the camera detects no person.
        is_stuck: Fault: navigation has given up.
    """

    def __init__(
        self,
        robot_id: str,
        profile: RobotProfile,
        script: RobotScript,
        detector: DetectorModel,
        rng: np.random.Generator,
        camera: Camera = "boxes",
        pose_error: float = 1.0,
    ) -> None:
        self.robot_id = robot_id
        self.profile = profile
        self.command = REST
        self.false_person: tuple[float, float] | None = None
        self.thing: tuple[float, float] | None = None
        self.hides_people = False
        self.is_stuck = False
        self._rng = rng
        self._odometer = Odometer(rng, times=pose_error)
        place = None
        if camera == "grounding":
            place = GroundedCamera(profile, rng.spawn(1)[0]).place
        self._detector = EmulatedDetector(profile, detector, rng, place)
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

    def obey(self, order: FaultOrder) -> None:
        """Set the faults of camera and navigation of an order."""
        if order.stuck is not None:
            self.is_stuck = order.stuck
        if order.hide_people is not None:
            self.hides_people = order.hide_people
        if "false_person" in order.model_fields_set:
            place = order.false_person
            self.false_person = None if place is None else (place.x, place.y)
        if "thing" in order.model_fields_set:
            place = order.thing
            self.thing = None if place is None else (place.x, place.y)

    def requested_twist(self, now: float, around: "SimulatedWorld") -> Twist2D:
        """Twist that navigation requests; ``now`` in seconds into the run."""
        if self.is_stuck:
            return REST
        discs = around.discs()
        for body in around.bodies_but(self.robot_id):
            discs.extend(body.discs())
        return self._navigator.requested_twist(self.vehicle.pose, now, discs)

    def pursue(self, goal: Goal | None, around: "SimulatedWorld") -> bool:
        """Drive to a goal, or give it up; whether a way there is known."""
        return self._navigator.pursue(goal, self.vehicle.pose, around.scenery)

    # --- sensors ------------------------------------------------------------------

    def odometry(self) -> Odometry:
        """Estimated pose, measured speeds."""
        return Odometry(self.robot_id, Origin(), self._believed, self.vehicle.twist)

    def scan(self, around: "SimulatedWorld") -> LaserScan:
        """One turn of the laser."""
        sensor = self.vehicle.pose.compose(self.profile.laser)
        others = around.bodies_but(self.robot_id)
        ranges = sweep(
            sensor, _LASER, around.scenery, around.discs(), others, self._rng
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
        pose = self.vehicle.pose
        targets = around.targets_for(self.robot_id)
        if self.hides_people:
            targets = [target for target in targets if target.class_id != PERSON]
        if self.thing is not None:
            targets = [*targets, thing_target(*self.thing)]
        found = self._detector.detect(now, pose, targets, around.scenery)
        if self.false_person is not None:
            x, y = self.false_person
            ghost = upright_box(pose, PERSON, x, y, _FALSE_PERSON_CONFIDENCE)
            found = (*found, ghost)
        lost, name = self._detector.lost, self._detector.name
        return DetectionFrame(self.robot_id, Origin(), found, lost, name)

    def part_seen(self, target: Target, around: "SimulatedWorld") -> float:
        """Visible share of a target from its camera, whatever the detector reports."""
        camera = self.vehicle.pose.compose(self.profile.camera)
        return self._detector.part_seen(camera, target.body, around.scenery)

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
        camera: Source of the boxes: drawn about the truth, or by grounding.
    """

    def __init__(
        self,
        greenhouse: Greenhouse,
        layout: Layout,
        detector: DetectorModel,
        seed: int,
        camera: Camera = "boxes",
    ) -> None:
        streams = np.random.SeedSequence(seed).spawn(
            len(layout.robots) + len(layout.people) + 1
        )
        generators = [np.random.default_rng(stream) for stream in streams]
        errors = layout.errors
        self.scenery = Scenery.of(greenhouse, generators.pop()).moved(errors.plan_off_m)
        self.rigs: Mapping[str, RobotHardware] = {
            robot_id: RobotHardware(
                robot_id,
                layout.profiles[robot_id],
                script,
                detector,
                rng,
                camera,
                errors.pose_error,
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
