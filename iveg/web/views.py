"""What is known, in the shapes of ``schemas``: built when somebody asks, never kept."""

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from iveg.domain.echoes import echoes_of
from iveg.domain.geometry import Pose2D
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.limits import LIMITS
from iveg.domain.margins import LeastMargins, least, margins_of
from iveg.domain.observations import Instant, LaserScan, Odometry
from iveg.domain.records import LogRecord
from iveg.domain.stop import Command, StopMachine
from iveg.domain.tracking.person import Person
from iveg.domain.world import RobotState, World
from iveg.ngsi.codec import format_stamp
from iveg.pipeline.assess import Assessor
from iveg.pipeline.command import Commander
from iveg.web import schemas, shapes


class Views:
    """Reads the pipeline's state for browsers and integrators."""

    def __init__(self, assessor: Assessor, commander: Commander) -> None:
        self._assessor = assessor
        self._commander = commander

    @property
    def _world(self) -> World:
        return self._assessor.world

    @property
    def greenhouse(self) -> Greenhouse:
        """The house that is shown."""
        return self._assessor.greenhouse

    # --- robots -------------------------------------------------------------------

    def robots(self, now: Instant) -> list[schemas.RobotJson]:
        """The whole fleet."""
        return [self.robot(robot_id, now) for robot_id in self._world.robots]

    def margins(self, now: Instant) -> LeastMargins:
        """Of all live robots and all people, for who asks for many at once."""
        return LeastMargins(self._fleet(), self._people(), now)

    def robot(
        self, robot_id: str, now: Instant, margins: LeastMargins | None = None
    ) -> schemas.RobotJson:
        """One robot. Raises UnknownRobotError."""
        robot = self._world.robot(robot_id)
        machine = self._commander.machine(robot_id)
        odometry, safety = robot.odometry, robot.safety
        mandate = self._assessor.mandates[robot_id]
        age = robot.age_s(now)
        received = robot.odometry_received
        return {
            "robot_id": robot_id,
            "link": robot.link(now),
            "mode": self._mode(robot, machine, now),
            "pose": None
            if odometry is None
            else {
                "x": odometry.pose.x,
                "y": odometry.pose.y,
                "yaw": odometry.pose.yaw,
            },
            "twist": None
            if odometry is None
            else {
                "linear": odometry.twist.linear_x,
                "angular": odometry.twist.angular_z,
            },
            "stamp": None if odometry is None else odometry.origin.stamp,
            "received_at": shapes.moment(received),
            "age_s": None if age is None else round(age, 3),
            "age_estimated": robot.estimated_since is not None,
            "speed_factor": None if safety is None else safety.speed_factor,
            "applied": self._applied(robot, now),
            "mandate": {
                "speed_factor": mandate.speed_factor,
                "reason": mandate.reason,
                "cause": mandate.cause,
                "distance_m": shapes.rounded(mandate.distance_m),
                "decision_id": mandate.decision_id,
            },
            "holds": []
            if safety is None
            else [
                {"id": hold.id, "source": hold.source, "ack": hold.ack}
                for hold in safety.holds
            ],
            "stop": None if machine.stop is None else self.command(machine.stop, now),
            "stop_state": machine.state,
            "navigation": shapes.navigation(robot),
            "replay": robot.is_replay,
            "clock_offset_s": shapes.rounded(robot.clock.offset_s(now)),
            "road": robot.frame_road,
            "transport": self._world.feeds.of(robot_id).transport(now.mono),
            "profile": shapes.profile(robot.profile),
            "margin": shapes.margin(
                margins.of_robot(robot_id)
                if margins is not None and not robot.is_replay
                else least(margins_of([robot], self._people(), now))
            ),
            "cmd_status": robot.command_status,
        }

    def _mode(
        self, robot: RobotState, machine: StopMachine, now: Instant
    ) -> Literal["RUNNING", "SLOW", "STOPPED"]:
        """What the robot has just said; while it says nothing, what it was told.

        That a STOP is wanted is in ``stop_state``: here a robot stands by its own word
        alone, and not by an old one.
        """
        factor = self._assessor.mandates[robot.robot_id].speed_factor
        report, received = robot.safety, robot.safety_received
        is_fresh = (
            received is not None and now.mono - received.mono <= LIMITS.report_stale_s
        )
        if report is not None and is_fresh:
            factor = 0.0 if report.holds else report.speed_factor
        if factor <= 0.0 or machine.state == "STANDING":
            return "STOPPED"
        return "SLOW" if factor < 1.0 else "RUNNING"

    def _applied(self, robot: RobotState, now: Instant) -> schemas.AppliedJson | None:
        if robot.safety is None or robot.safety_received is None:
            return None
        return {
            "reason": robot.safety.reason,
            "cause": robot.safety.cause,
            "age_s": round(now.mono - robot.safety_received.mono, 3),
            "feedback_age_s": robot.safety.feedback_age_s,
            "faults": [
                {"code": one.code, "about": one.about, "for_s": one.for_s}
                for one in robot.safety.faults
            ],
        }

    def motion(
        self, robot_id: str, now: Instant
    ) -> tuple[Odometry | None, float | None]:
        """A robot's newest odometry and its age (s)."""
        robot = self._world.robot(robot_id)
        return robot.odometry, robot.age_s(now)

    def scan(self, robot_id: str) -> tuple[LaserScan, NDArray[np.float32]] | None:
        """A robot's newest sweep and its points in ``map``, shape (n, 2), (m)."""
        robot = self._world.robot(robot_id)
        if robot.scan is None or robot.scan_pose is None:
            return None
        return robot.scan, robot.scan.points(robot.scan_pose)

    def sweep(self, robot_id: str) -> tuple[LaserScan, Pose2D] | None:
        """A robot's newest sweep and the pose of its sensor in ``map``."""
        robot = self._world.robot(robot_id)
        if robot.scan is None or robot.scan_pose is None:
            return None
        return robot.scan, robot.scan_pose.compose(robot.scan.mount)

    def scan_age_s(self, robot_id: str, now: Instant) -> float | None:
        """Seconds since the newest sweep arrived."""
        received = self._world.robot(robot_id).scan_received
        return None if received is None else round(now.mono - received.mono, 3)

    # --- people and looks ---------------------------------------------------------

    def people(
        self, now: Instant, margins: LeastMargins | None = None
    ) -> list[schemas.PersonJson]:
        """Everyone who is known."""
        margins = margins or self.margins(now)
        return [
            self._person(one, margins, now)
            for one in self._assessor.people.known.values()
        ]

    def _person(
        self, person: Person, margins: LeastMargins, now: Instant
    ) -> schemas.PersonJson:
        newest, age = person.newest, person.age_s(now)
        crossings = [
            one
            for one in self._assessor.crossings
            if one.hazard.cause == person.person_id
        ]
        rule = self._assessor.rule
        return {
            "person_id": person.person_id,
            "class": person.class_,
            "class_id": newest.class_id,
            "stage": person.stage(now),
            "position": {"x": newest.x, "y": newest.y, "z": newest.z},
            "radius_m": max(
                (radius for _, radius in person.rings(rule, now)), default=None
            ),
            "confidence": newest.confidence,
            "first_seen": format_stamp(person.first_seen.wall),
            "last_seen": format_stamp(newest.at.wall),
            "age_s": round(age, 3),
            "observers": person.observers(now),
            "possible": newest.possible,
            "doubtful": newest.reach_m > 0.0,
            "decision_id": max((one.decision_id for one in crossings), default=None),
            "lane": self.greenhouse.lane_at(newest.x, newest.y),
            "acting": [
                {
                    "robot_id": one.robot_id,
                    "distance_m": round(one.distance_m, 3),
                    "in_sight": one.in_sight,
                }
                for one in crossings
            ],
            "margin": shapes.margin(margins.of_person(person.person_id)),
        }

    def _people(self) -> list[Person]:
        return list(self._assessor.people.known.values())

    def _fleet(self) -> list[RobotState]:
        return list(self._world.live_robots())

    def frame(self, robot_id: str, now: Instant) -> schemas.FrameJson | None:
        """One robot's newest look, faint detections included."""
        robot = self._world.robot(robot_id)
        if robot.frame is None or robot.detections_at is None:
            return None
        stamp, road = robot.frame.origin.stamp, robot.frame_road
        return {
            "robot_id": robot_id,
            "stamp": stamp,
            "road": road,
            "age_s": round(now.mono - robot.detections_at, 3),
            "items": [
                shapes.detection(one, robot_id, stamp, road)
                for one in self._assessor.placed.get(robot_id, [])
            ],
        }

    # --- commands, alerts, log ----------------------------------------------------

    def command(self, command: Command, now: Instant) -> schemas.CommandJson:
        """One command with the robot's last word."""
        return shapes.command(command, self._commander.machine(command.robot_id), now)

    def find_command(self, command_id: str, now: Instant) -> schemas.CommandJson | None:
        """A command of this run; older ones are in the history."""
        command = self._commander.commands.get(command_id)
        return None if command is None else self.command(command, now)

    def open_commands(self, now: Instant) -> list[schemas.CommandJson]:
        """Every command that still goes on."""
        return [
            self.command(command, now)
            for machine in self._commander.machines.values()
            for command in (machine.stop, machine.once)
            if command is not None
        ]

    def alerts(self) -> list[schemas.AlertJson]:
        """All that is for people to see now, gravest first."""
        waiting = self._assessor.alarms.waiting
        waiting.sort(key=lambda one: (one.priority, -one.last.raised.wall))
        return [shapes.alert(one) for one in waiting]

    def flood(self) -> schemas.FloodJson:
        """How fast alarms come."""
        return shapes.flood(self._assessor.alarms.flood)

    def log(self, lines: list[LogRecord]) -> list[schemas.LogJson]:
        """Log lines."""
        return [shapes.log_line(line) for line in lines]

    def safety(self, now: Instant) -> schemas.SafetyJson:
        """How soon the fleet obeys, and how close it comes to people."""
        echoes = echoes_of(self._assessor.live_decisions(), now)
        return shapes.safety(echoes, self._assessor.exposure, now)

    def climate(self, now: Instant) -> schemas.ClimateJson | None:
        """The newest reading of the air."""
        climate, received = self._world.climate, self._world.climate_received
        if climate is None or received is None:
            return None
        return {
            "temperature": climate.temperature,
            "relative_humidity": climate.relative_humidity,
            "co2": climate.co2,
            "received_at": format_stamp(received.wall),
            "age_s": round(now.mono - received.mono, 3),
        }

    def map(self) -> dict[str, Any]:
        """The greenhouse as the page draws it."""
        return shapes.house(self.greenhouse)

    def rule(self) -> schemas.RuleJson:
        """The version of the rule that is in force."""
        return shapes.rule(self._assessor.rule)
