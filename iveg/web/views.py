"""The state of the pipeline as models, built on request."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable
from itertools import islice, takewhile

from iveg.comfort.situations import Situations, fresh_report
from iveg.domain import margins as margins_
from iveg.domain.margins import LeastMargins
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.zones import ZoneEntry
from iveg.domain.stamps import format_stamp
from iveg.domain.stop import FollowedCommand, StopMachine
from iveg.domain.tracking.tracker import TrackedPerson
from iveg.models.base import GreenhouseMap, Pose, Position, Scan, Twist, stamp
from iveg.models.command import Command as CommandModel
from iveg.models.health import Health
from iveg.models.health import HopHealth as HopModel
from iveg.models.history import Alert, LogEntry
from iveg.models.people import Acting, Detection, DetectionFrame, Evidence
from iveg.models.people import Person as PersonModel
from iveg.models.robot import (
    Applied,
    Detector,
    Encounter,
    Goal,
    Hold,
    Margin,
    MissingPremise,
    Mode,
    Navigation,
    Profile,
    Robot,
    Situation,
    SpeedLimit,
)
from iveg.models.rule import Rule
from iveg.models.snapshot import Climate, Tile
from iveg.pipeline import Pipeline

_FIRST_LINES = 200


class Views:
    """Reads the pipeline's state for browsers and integrators.

    Args:
        parts: The pipeline with the state.
        counters: All counters; by default those of the pipeline.
    """

    def __init__(
        self, parts: Pipeline, counters: Callable[[], Counter[str]] | None = None
    ) -> None:
        self._evaluator, self._commander = parts.evaluator, parts.commander
        self._goals = parts.goals
        self._situations = Situations(parts.evaluator)
        self.reject = parts.ingest.reject
        self._world, self._people = parts.core.world, parts.core.people
        self._greenhouse = parts.evaluator.greenhouse
        self._event_log = parts.core.event_log
        self._health_monitor = parts.core.health_monitor
        self._equipment = parts.equipment.equipment
        self._counters = counters or parts.counters

    # --- robots -------------------------------------------------------------------

    @property
    def robot_ids(self) -> Iterable[str]:
        """The fleet, in its order."""
        return self._world.robots

    def robots(self, now: Instant) -> list[Robot]:
        """The whole fleet."""
        return [self.robot(robot_id, now) for robot_id in self._world.robots]

    def margins(self, now: Instant) -> LeastMargins:
        """Margins of all live robots and people, computed together for many robots."""
        return LeastMargins(self._world.live_robots(), self._people.known.values(), now)

    def robot(
        self, robot_id: str, now: Instant, margins: LeastMargins | None = None
    ) -> Robot:
        """One robot. Raises UnknownRobotError."""
        robot = self._world.robot(robot_id)
        machine = self._commander.machine(robot_id)
        odometry, safety, age = robot.odometry, robot.safety, robot.age_s(now)
        goal = self._goals.newest(robot_id, now)
        pose = None if odometry is None else odometry.pose
        return Robot(
            robot_id=robot_id,
            link=robot.link(now),
            situation=Situation.from_value(
                self._situations.situation(robot, machine, now)
            ),
            mode=self._mode(robot, machine, now),
            pose=None if pose is None else Pose.from_value(pose),
            lane=None if pose is None else self._greenhouse.lane_at(pose.x, pose.y),
            twist=None if odometry is None else Twist.from_twist(odometry.twist),
            stamp=None if odometry is None else odometry.origin.stamp,
            received_at=stamp(robot.odometry_received),
            age_s=age,
            age_estimated=robot.estimated_since is not None,
            speed_factor=None if safety is None else safety.speed_factor,
            applied=Applied.from_robot(robot, now),
            speed_limit=SpeedLimit.from_value(self._evaluator.speed_limits[robot_id]),
            encounters=[
                Encounter.from_encounter(encounter, now)
                for encounter in self._evaluator.encounters(robot_id, now)
            ],
            missing=[
                MissingPremise(premise=unmet.reason, robot_id=unmet.robot_id)
                for unmet in self._evaluator.unmet(robot_id)
            ],
            detector=Detector.from_robot(robot, now),
            refused=robot.refused,
            holds=[]
            if safety is None
            else [Hold.from_value(hold) for hold in safety.holds],
            stop=None if machine.stop is None else self.command(machine.stop, now),
            stop_state=machine.state,
            navigation=Navigation.from_robot(robot),
            goal=None if goal is None else Goal.from_goal(goal),
            replay=robot.is_replay,
            clock_offset_s=robot.clock.offset_s(now),
            transport=robot.odometry_transport,
            profile=Profile.from_value(robot.profile),
            margin=Margin.from_margin(self._margin(robot, margins, now)),
            cmd_status=robot.command_status,
            **Robot.sensed(robot, now),
        )

    def _margin(
        self, robot: RobotState, margins: LeastMargins | None, now: Instant
    ) -> margins_.SafetyMargin | None:
        # The fleet's margins are of live robots alone; a replay has its own.
        if margins is None or robot.is_replay:
            margins = LeastMargins([robot], self._people.known.values(), now)
        return margins.of_robot(robot.robot_id)

    def _mode(self, robot: RobotState, machine: StopMachine, now: Instant) -> Mode:
        """The mode by the robot's newest report; without one, by its speed limit.

        A wanted STOP shows in ``stop_state``: here a robot stands by its own report
        alone, and not by an old one.
        """
        factor = self._evaluator.speed_limits[robot.robot_id].speed_factor
        report = fresh_report(robot, now)
        if report is not None:
            factor = 0.0 if report.holds else report.speed_factor
        if factor <= 0.0 or machine.state == "STANDING":
            return "STOPPED"
        return "SLOW" if factor < 1.0 else "RUNNING"

    def robot_state(self, robot_id: str) -> RobotState:
        """One robot as the world has it, for encoders of poses and sweeps."""
        return self._world.robot(robot_id)

    def scan_age_s(self, robot_id: str, now: Instant) -> float | None:
        """Seconds since the newest sweep arrived."""
        received = self._world.robot(robot_id).scan_received
        return None if received is None else round(now.mono - received.mono, 3)

    def scan(self, robot_id: str) -> Scan:
        """The newest sweep of one robot, as points in ``map``."""
        robot = self._world.robot(robot_id)
        scan = robot.scan
        if scan is None or robot.scan_pose is None:
            return Scan(robot_id=robot_id, stamp=None, points=[])
        swept = scan.points(robot.scan_pose).tolist()
        points = [(round(x, 3), round(y, 3)) for x, y in swept]
        return Scan(robot_id=robot_id, stamp=scan.origin.stamp, points=points)

    # --- people and looks ---------------------------------------------------------

    def people(self, now: Instant) -> list[PersonModel]:
        """Every known person."""
        entries = defaultdict[str, list[ZoneEntry]](list)
        for entry in self._evaluator.entries:
            entries[entry.zone.cause].append(entry)
        return [
            self._person(person, entries[person.person_id], now)
            for person in self._people.known.values()
        ]

    def _person(
        self,
        person: TrackedPerson,
        entries: Iterable[ZoneEntry],
        now: Instant,
    ) -> PersonModel:
        newest, rule = person.newest, self._evaluator.rule
        x, y = newest.x, newest.y
        zones = self._people.zone_radii(person, rule, now)
        thing = self._people.things.explain(person, now)
        return PersonModel(
            person_id=person.person_id,
            class_=person.class_,
            class_id=newest.class_id,
            stage=person.stage(now),
            position=Position(x=x, y=y, z=newest.z),
            radius_m=max((radius for _, radius in zones), default=None),
            confidence=newest.confidence,
            first_seen=format_stamp(person.first_seen.wall),
            last_seen=format_stamp(newest.at.wall),
            age_s=person.age_s(now),
            observers=person.observers(now),
            possible=newest.possible or newest.laser,
            evidence=Evidence.from_looks(newest.looks),
            # With a reach the place is the observer's: its box lay beyond the walls.
            doubtful=newest.reach_m > 0.0,
            decision_id=max((entry.decision_id for entry in entries), default=None),
            lane=self._greenhouse.lane_at(x, y),
            acting=[Acting.from_value(entry) for entry in entries],
            thing_id=None if thing is None else thing.thing_id,
        )

    def frame(self, robot_id: str, now: Instant) -> DetectionFrame | None:
        """One robot's newest detection frame, faint detections included."""
        robot = self._world.robot(robot_id)
        if robot.frame is None or robot.detections_at is None:
            return None
        stamp, transport = robot.frame.origin.stamp, robot.frame_transport
        return DetectionFrame(
            robot_id=robot_id,
            stamp=stamp,
            transport=transport,
            age_s=now.mono - robot.detections_at,
            items=[
                Detection.from_placed(placed, robot_id, stamp, transport)
                for placed in self._evaluator.tracking.placed.get(robot_id, [])
            ],
        )

    def frames(self, now: Instant) -> dict[str, DetectionFrame]:
        """The newest detection frame of each robot that has one."""
        frames = ((name, self.frame(name, now)) for name in self._world.robots)
        return {name: frame for name, frame in frames if frame is not None}

    # --- commands, alerts, log ----------------------------------------------------

    def command(self, command: FollowedCommand, now: Instant) -> CommandModel:
        """One command with the robot's newest report."""
        return CommandModel.from_command(
            command, self._commander.machine(command.robot_id), now
        )

    def find_command(self, command_id: str, now: Instant) -> CommandModel | None:
        """A command of this run; older ones are in the history."""
        command = self._commander.commands.get(command_id)
        return None if command is None else self.command(command, now)

    def open_commands(self, now: Instant) -> list[CommandModel]:
        """Every command without an end."""
        return [
            self.command(command, now)
            for machine in self._commander.machines.values()
            for command in machine.commands
        ]

    def alerts(self) -> list[Alert]:
        """All alerts that people should see now, gravest first."""
        waiting = self._evaluator.alerts.waiting
        waiting.sort(key=lambda alert: (alert.priority, -alert.last.raised.wall))
        return [Alert.from_alert(alert) for alert in waiting]

    def log_since(self, line_id: int = -1) -> list[LogEntry]:
        """Lines with a higher id, oldest first; the newest where there are many."""
        newest = islice(reversed(self._event_log.lines), _FIRST_LINES)
        later = takewhile(lambda line: line.id > line_id, newest)
        return [LogEntry.from_record(line) for line in later][::-1]

    def health(self, now: Instant) -> Health:
        """Every hop with its state and age, all counters."""
        hops = [
            HopModel.from_value(
                hop, hop=hop.name.value, key=f"health.{hop.name.label}.{hop.state}"
            )
            for hop in self._health_monitor.hops(now)
        ]
        return Health(
            ok=all(hop.state == "ok" for hop in hops),
            hops=hops,
            counters=dict(sorted(self._counters().items())),
            earlier=self._health_monitor.earlier(now),
        )

    def climate(self, now: Instant) -> Climate | None:
        """The newest reading of the air."""
        climate, received = self._world.climate, self._world.climate_received
        if climate is None or received is None:
            return None
        return Climate.from_climate(climate, received, now)

    def equipment(self, now: Instant) -> list[Tile]:
        """Every tile of other equipment, in the order of its file."""
        known = self._equipment
        return [
            Tile.from_tile(tile, known.status(tile), known.state(tile, now), now)
            for tile in known.tiles
        ]

    def map(self) -> GreenhouseMap:
        """The greenhouse as the page draws it."""
        return GreenhouseMap.from_greenhouse(self._greenhouse)

    def rule(self) -> Rule:
        """The version of the rule that is in force."""
        return Rule.from_rule(self._evaluator.rule)
