"""Zones round people and peers, which slow robots, and entries of robots into them."""

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import HALF_SPEED
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.people import People
from iveg.domain.tracking.person import Sighting, TrackedPerson
from iveg.domain.world import World

_ROUNDING_M = 0.01
"""So far outside a zone nobody can be inside, whatever rounding does."""


@dataclass(frozen=True, slots=True)
class Zone:
    """The circle round a person or peer that slows every robot inside it.

    Attributes:
        cause: The person or robot at its centre.
        observer: Who saw it; the peer itself for a peer's own odometry.
        x: Centre in ``map`` (m); ``y`` likewise.
        fresh_m: Radius while what made it is fresh (m).
        sighting: What was seen; None for a peer's own odometry.
        recording: The map frame of the recording that saw it, which slows recordings
            of that frame alone; None: a live robot saw it.
        alert_id: Of the alert that robots hear of it.
    """

    reason: Literal["person", "robot"]
    cause: str
    observer: str
    x: float
    y: float
    radius_m: float
    fresh_m: float
    sighting: Sighting | None = None
    recording: str | None = None
    alert_id: str | None = None

    @property
    def is_grown(self) -> bool:
        """Whether it is wider than while what made it was fresh."""
        return self.radius_m > self.fresh_m


def zones_of(
    world: World, people: People, rule: DetectionRule, now: Instant
) -> Iterator[Zone]:
    """Every zone that slows robots now."""
    for person in people.known.values():
        yield from _zones_of(person, people, world, rule, now)
    for peer in world.robots.values():
        yield from _zone_of_peer(peer, rule, now)


def _zones_of(
    person: TrackedPerson,
    people: People,
    world: World,
    rule: DetectionRule,
    now: Instant,
) -> Iterator[Zone]:
    fresh_m = rule.radius_m.of(person.class_)
    for sighting, radius in people.zone_radii(person, rule, now):
        yield Zone(
            person.class_,
            person.person_id,
            sighting.observer,
            sighting.x,
            sighting.y,
            radius,
            fresh_m + sighting.beyond_m,
            sighting,
            world.robots[sighting.observer].recording,
            person.decision_id,
        )


def _zone_of_peer(
    peer: RobotState, rule: DetectionRule, now: Instant
) -> Iterator[Zone]:
    """Zone of a peer that others give way to."""
    since = peer.likely_pose_at()
    # A recording cannot yield, and nobody yields to it.
    if peer.odometry is None or since is None or peer.is_replay:
        return
    age = max(0.0, now.mono - since)
    known = peer.age_s(now)
    at_rest = peer.stands and known is not None and known <= LIMITS.silence_s
    if at_rest or age > LIMITS.ring_lasts_s:
        return
    pose, name, radius = peer.odometry.pose, peer.robot_id, rule.radius_at(age, "robot")
    fresh_m = rule.radius_m.of("robot")
    yield Zone("robot", name, name, pose.x, pose.y, radius, fresh_m)


Distances = dict[str, tuple[float, float, Zone]]
"""Cause → how far outside its nearest zone (m), from its centre (m), and the zone."""


def near_zones(
    robots: Sequence[RobotState],
    zones: Sequence[Zone],
    entries: Mapping[str, Iterable[str]],
) -> Iterator[tuple[RobotState, list[Zone]]]:
    """Each robot with the zones that it is in or was in: all against all, as arrays."""
    x, y = np.array([one.x for one in zones]), np.array([one.y for one in zones])
    radius = np.array([one.radius_m for one in zones])
    of_cause = defaultdict[str, list[int]](list)
    for number, zone in enumerate(zones):
        of_cause[zone.cause].append(number)
    for robot in robots:
        if robot.odometry is None:
            continue
        pose = robot.odometry.pose
        inside = np.hypot(x - pose.x, y - pose.y) - radius <= _ROUNDING_M
        near = set(np.flatnonzero(inside).tolist())
        for cause in entries.get(robot.robot_id, ()):
            near.update(of_cause.get(cause, ()))
        yield robot, [zones[number] for number in sorted(near)]


def distances(robot: RobotState, zones: Iterable[Zone]) -> Distances:
    """How a robot lies to the deepest zone of each cause."""
    nearest: Distances = {}
    if robot.odometry is None:
        return nearest
    pose, robot_id, recording = robot.odometry.pose, robot.robot_id, robot.recording
    for zone in zones:
        cause = zone.cause
        if cause == robot_id or zone.recording not in (None, recording):
            continue
        distance = math.hypot(zone.x - pose.x, zone.y - pose.y)
        depth = distance - zone.radius_m
        if cause not in nearest or depth < nearest[cause][0]:
            nearest[cause] = depth, distance, zone
    return nearest


@dataclass(frozen=True, slots=True)
class ZoneEntry:
    """One robot inside one zone, from trigger to release.

    Attributes:
        zone: The nearest zone of the cause at trigger.
        distance_m: Now; ``entered_m`` at the trigger.
        outside_since: When it was first found outside (monotonic, s).
        already_slow: It was slowed for something else: no slow-down will be seen.
        told_before: It had judged this very zone itself and said so before.
        foretold_s: When it would reach the zone, at the trigger (s); None: it was
            inside.
        in_sight: Whether the robot saw it itself, or had a line of sight to the centre
            at the trigger.
    """

    decision_id: str
    robot_id: str
    zone: Zone
    entered: Instant
    entered_m: float
    speed_before: float
    in_sight: bool
    distance_m: float
    already_slow: bool = False
    told_before: bool = False
    outside_since: float | None = None
    foretold_s: float | None = None

    def continued(self, depth_m: float, distance_m: float, now: Instant) -> "ZoneEntry":
        """The same, still inside or so far outside by now (m)."""
        since = None
        if depth_m > LIMITS.release_beyond_m:
            since = self.outside_since or now.mono
        if distance_m == self.distance_m and since == self.outside_since:
            return self
        return self.later(distance_m, since)

    def later(self, distance_m: float, outside_since: float | None) -> "ZoneEntry":
        """The same, from another place of the robot or of the zone.

        Spelled out, as ``dataclasses.replace`` takes three times as long, and each
        robot that moves is judged anew.
        """
        return ZoneEntry(
            self.decision_id,
            self.robot_id,
            self.zone,
            self.entered,
            self.entered_m,
            self.speed_before,
            self.in_sight,
            distance_m,
            self.already_slow,
            self.told_before,
            outside_since,
            self.foretold_s,
        )


@dataclass(frozen=True, slots=True)
class LimitChange:
    """An entry that began or ended."""

    entry: ZoneEntry
    began: bool


def leave(
    mine: dict[str, ZoneEntry], near: Mapping[str, object], now: Instant
) -> Iterator[LimitChange]:
    """End the entries of a robot that has been outside for long enough.

    Args:
        mine: Of one robot, by cause; those that end go from it.
        near: Causes whose zones it is near.
        now: This moment.
    """
    for cause, entry in list(mine.items()):
        if cause not in near and entry.outside_since is None:
            entry = entry.later(entry.distance_m, now.mono)
            mine[cause] = entry
        since = entry.outside_since
        if since is not None and now.mono - since >= LIMITS.release_after_s:
            del mine[cause]
            yield LimitChange(entry, began=False)


def is_slow_already(robot: RobotState, zone: Zone, speed: float) -> bool:
    """Whether a robot will show no slow-down, because it drives slowly already.

    A robot judges alerts by its own pose, too, and may report this very zone a few
    milliseconds before it is found here; while it is still fast, its slow-down is yet
    to be seen.
    """
    if robot.safety is None or robot.safety.speed_factor > HALF_SPEED:
        return False
    slow = HALF_SPEED * robot.profile.max_speed
    return not has_told(robot, zone) or speed <= slow


def has_told(robot: RobotState, zone: Zone) -> bool:
    """Whether the robot already reports that it is slow for this very hazard."""
    report = robot.safety
    if report is None or report.speed_factor > HALF_SPEED:
        return False
    # A peer's own zone has no alert, and a robot may name none: that is no match.
    ours = {zone.alert_id, zone.cause} - {None}
    return report.decision_id in ours or report.cause in ours
