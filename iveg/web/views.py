"""What is known, in the shapes of ``schemas``: built when somebody asks, never kept."""

import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from iveg.domain.alarms import Alarm
from iveg.domain.alerts import WALKING_SPEED, Rule
from iveg.domain.feedback import HALF_SPEED
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.margins import UNCERTAINTY_M, Margin, least, margin_of
from iveg.domain.observations import Instant, LaserScan
from iveg.domain.people import Person, Placed
from iveg.domain.profiles import profile_of
from iveg.domain.records import LogRecord
from iveg.domain.stop import FRESH_S, Command, StopMachine
from iveg.domain.world import RobotState, World
from iveg.ngsi.codec import format_stamp
from iveg.pipeline.assess import Assessor
from iveg.pipeline.command import Commander
from iveg.web import schemas


def iso(wall: float | None) -> str | None:
    """Unix seconds as ISO-8601 UTC with milliseconds."""
    return None if wall is None else format_stamp(wall)


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

    def robot(self, robot_id: str, now: Instant) -> schemas.RobotJson:
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
            "mode": self._mode(robot, machine),
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
            "received_at": None if received is None else iso(received.wall),
            "age_s": None if age is None else round(age, 3),
            "speed_factor": None if safety is None else safety.speed_factor,
            "applied": self._applied(robot, now),
            "mandate": {
                "speed_factor": mandate.speed_factor,
                "reason": mandate.reason,
                "cause": mandate.cause,
                "distance_m": _round(mandate.distance_m),
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
            "navigation": _navigation(robot),
            "replay": robot.is_replay,
            "clock_offset_s": _round(robot.clock.offset_s),
            "road": robot.frame_road,
            "profile": _profile(robot_id),
            "margin": _margin(least(self._margins([robot], now))),
            "cmd_status": robot.command_status,
        }

    def _mode(
        self, robot: RobotState, machine: StopMachine
    ) -> Literal["RUNNING", "SLOW", "STOPPED"]:
        """What the robot says; while it says nothing, what it was told."""
        if machine.wants_stop or (robot.safety is not None and robot.safety.holds):
            return "STOPPED"
        factor = self._assessor.mandates[robot.robot_id].speed_factor
        if robot.safety is not None:
            factor = robot.safety.speed_factor
        if factor <= 0.0:
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
        }

    def scan(self, robot_id: str) -> tuple[LaserScan, NDArray[np.float32]] | None:
        """A robot's newest sweep and its points in ``map``, shape (n, 2), (m)."""
        robot = self._world.robot(robot_id)
        if robot.scan is None or robot.scan_pose is None:
            return None
        return robot.scan, robot.scan.points(robot.scan_pose)

    def scan_age_s(self, robot_id: str, now: Instant) -> float | None:
        """Seconds since the newest sweep arrived."""
        received = self._world.robot(robot_id).scan_received
        return None if received is None else round(now.mono - received.mono, 3)

    # --- people and looks ---------------------------------------------------------

    def people(self, now: Instant) -> list[schemas.PersonJson]:
        """Everyone who is known."""
        return [self._person(one, now) for one in self._assessor.people.known.values()]

    def _person(self, person: Person, now: Instant) -> schemas.PersonJson:
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
            "observers": [
                name
                for name, look in person.sightings.items()
                if look.age_s(now) <= 1.0
            ],
            "possible": newest.possible,
            "doubtful": newest.reach_m > 0.0,
            "decision_id": person.decision_id,
            "lane": self.greenhouse.lane_at(newest.x, newest.y),
            "acting": [
                {
                    "robot_id": one.robot_id,
                    "distance_m": round(one.distance_m, 3),
                    "in_sight": one.in_sight,
                }
                for one in crossings
            ],
            "margin": _margin(least(self._margins(self._fleet(), now, [person]))),
        }

    def _fleet(self) -> list[RobotState]:
        return list(self._world.live_robots())

    def _margins(
        self,
        robots: Iterable[RobotState],
        now: Instant,
        people: Iterable[Person] | None = None,
    ) -> Iterator[Margin]:
        """Of every robot with every person, as far as they are known."""
        among = self._assessor.people.known.values() if people is None else people
        for robot in robots:
            for person in among:
                margin = margin_of(robot, person, now)
                if margin is not None:
                    yield margin

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
                _detection(one, robot_id, stamp, road)
                for one in self._assessor.placed.get(robot_id, [])
            ],
        }

    # --- commands, alerts, log ----------------------------------------------------

    def command(self, command: Command, now: Instant) -> schemas.CommandJson:
        """One command with the robot's last word."""
        machine = self._commander.machine(command.robot_id)
        report, report_at = machine.report, machine.report_at
        report_age = None if report_at is None else now.mono - report_at.mono
        times = command.times
        return {
            "command_id": command.command_id,
            "robot_id": command.robot_id,
            "kind": command.kind,
            "drill": command.drill,
            "state": command.state,
            "requested_by": command.requesters[0],
            "requesters": list(command.requesters),
            "times": {
                "pressed": None
                if times.pressed is None
                else format_stamp(times.pressed),
                "requested": format_stamp(times.requested.wall),
                "sent_fiware": _moment(times.sent_fiware),
                "sent_direct": _moment(times.sent_direct),
                "answer_fiware": _moment(times.answer_fiware),
                "answer_direct": _moment(times.answer_direct),
                "standing": _moment(times.standing),
            },
            "pressed_doubted": times.pressed_doubted,
            "standstill_ms": _round(command.standstill_ms),
            "age_s": round(now.mono - times.requested.mono, 3),
            "tries": command.tries,
            "reason": command.reason,
            "roads": dict(command.roads.items()),
            "robot": {
                "v": 0.0 if report is None else report.linear,
                "report_age_s": _round(report_age),
                "moved_m": round(machine.moved_m(now), 2),
            },
            "challenge_fresh": report_age is not None and report_age <= FRESH_S,
        }

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
        """All that is wrong now, gravest first."""
        active = self._assessor.alarms.active
        active.sort(key=lambda one: (one.condition.priority, -one.raised.wall))
        return [alert(one) for one in active]

    def log(self, lines: list[LogRecord]) -> list[schemas.LogJson]:
        """Log lines."""
        return [log_line(line) for line in lines]

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
        house = self.greenhouse
        return {
            "name": house.name,
            "bounds": asdict(house.bounds),
            "lanes": [
                {"label": lane.label, **asdict(lane.area)} for lane in house.lanes
            ],
            "rows": [asdict(row) for row in house.rows],
            "posts": [asdict(post) for post in house.posts],
            "obstacles": [
                {"kind": one.kind, **asdict(one.area)} for one in house.obstacles
            ],
        }

    def rule(self) -> schemas.RuleJson:
        """The version of the rule that is in force."""
        return rule_of(self._assessor.rule)


def rule_of(rule: Rule) -> schemas.RuleJson:
    """One version of the rule."""
    return {
        "id": rule.id,
        "version": rule.version,
        "confidence_threshold": rule.threshold,
        "class_thresholds": {str(k): v for k, v in rule.class_thresholds.items()},
        "radius_m": rule.radius_m,
        "factor": HALF_SPEED,
        "aliases": {name: str(class_) for name, class_ in rule.aliases.items()},
        "possible_people": rule.possible_people,
        "author": rule.author,
        "since": iso(rule.since),
    }


def alert(alarm: Alarm) -> schemas.AlertJson:
    """One alarm."""
    condition = alarm.condition
    return {
        "alert_id": alarm.alert_id,
        "priority": condition.priority,
        "key": condition.key,
        "slots": dict(condition.slots),
        "robot_id": condition.robot_id,
        "raised_at": format_stamp(alarm.raised.wall),
        "cleared_at": _moment(alarm.cleared),
        "acknowledged_at": _moment(alarm.acknowledged),
        "acknowledged_by": alarm.acknowledged_by,
        "note": alarm.note or None,
        "count": alarm.count,
    }


def log_line(line: LogRecord) -> schemas.LogJson:
    """One log line."""
    return {
        "id": line.id,
        "at": format_stamp(line.at),
        "kind": line.kind,
        "robot_id": line.robot_id,
        "key": line.key,
        "slots": json.loads(line.slots),
        "class": line.class_,
        "decision_id": line.decision_id,
    }


def _detection(
    one: Placed, robot_id: str, stamp: str | None, road: str
) -> schemas.DetectionJson:
    x, y, z = one.position
    detection = one.detection
    return {
        "robot_id": robot_id,
        "stamp": stamp,
        "class": one.class_,
        "class_id": detection.class_id,
        "probability": detection.probability,
        "position": {"x": x, "y": y, "z": z},
        "box": {**asdict(detection.box), "frame_id": detection.frame_id},
        "confident": one.kind != "faint",
        "person_id": None if one.person is None else one.person.person_id,
        "peer": one.peer,
        "road": road,
    }


def _navigation(robot: RobotState) -> schemas.NavigationJson | None:
    navigation = robot.navigation
    if navigation is None:
        return None
    goal = navigation.goal
    return {
        "task": navigation.task,
        "goal": None if goal is None else {"x": goal[0], "y": goal[1]},
        "path": [[x, y] for x, y in navigation.path],
    }


def _profile(robot_id: str) -> schemas.ProfileJson:
    profile = profile_of(robot_id)
    return {
        "drive": profile.drive,
        "length": profile.length,
        "width": profile.width,
        "max_speed": profile.max_speed,
        "turning_radius": profile.turning_radius,
    }


def _margin(margin: Margin | None) -> schemas.MarginJson | None:
    if margin is None:
        return None
    return {
        "robot_id": margin.robot_id,
        "person_id": margin.person_id,
        "gap_m": round(margin.gap_m, 2),
        "needs_m": round(margin.needs_m, 2),
        "margin_m": round(margin.margin_m, 2),
        "band": margin.band,
        "parts": {
            "person_walks_m": round(margin.walks_m, 2),
            "reaction_m": round(margin.reaction_m, 2),
            "braking_m": round(margin.braking_m, 2),
            "uncertainty_m": UNCERTAINTY_M,
        },
        "age_s": round(margin.age_s, 3),
        "braking": margin.braking,
        "walking_speed": WALKING_SPEED,
    }


def _moment(at: Instant | None) -> str | None:
    return None if at is None else format_stamp(at.wall)


def _round(value: float | None) -> float | None:
    return None if value is None else round(value, 3)
