"""Zones round people and peers, which slow robots, and entries of robots into them."""

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.limits import LIMITS, grown_radius
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.people import People
from iveg.domain.tracking.person import Sighting, TrackedPerson
from iveg.domain.world import World

_ROUNDING_M = 0.01
"""Rounding moves no robot that is farther outside a zone into it."""


class Zone(NamedTuple):
    """The surroundings of a person or peer, which slow every robot inside.

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
    if at_rest or age > LIMITS.zone_lasts_s:
        return
    pose, name, fresh_m = peer.odometry.pose, peer.robot_id, rule.radius_m.of("robot")
    yield Zone("robot", name, name, pose.x, pose.y, grown_radius(fresh_m, age), fresh_m)


class Distance(NamedTuple):
    """Distance of a robot from a zone: outside its border (m), from its centre (m)."""

    outside_m: float
    centre_m: float
    zone: Zone


Distances = dict[str, Distance]
"""Cause → distance to that of its zones in which the robot is deepest."""


def distances_to_zones(
    robots: Iterable[RobotState],
    zones: Sequence[Zone],
    entries: Mapping[str, Iterable[str]],
) -> Iterator[tuple[RobotState, Distances]]:
    """Each robot with the causes in whose zones it is, or has an entry.

    One comparison of all robots with all zones finds the few pairs that are near.
    """
    placed = [robot for robot in robots if robot.odometry is not None]
    centres = np.array([(one.x, one.y, one.radius_m) for one in zones]).reshape(-1, 3)
    poses = np.array([_place(robot) for robot in placed]).reshape(-1, 2, 1)
    x, y, radius_m = centres.T
    outside_m = np.hypot(x - poses[:, 0], y - poses[:, 1]) - radius_m
    inside: dict[int, set[int]] = defaultdict(set)
    for row, column in np.argwhere(outside_m <= _ROUNDING_M).tolist():
        inside[row].add(column)
    of_cause: dict[str, list[int]] = defaultdict(list)
    for column, zone in enumerate(zones):
        of_cause[zone.cause].append(column)
    for row, robot in enumerate(placed):
        entered = entries.get(robot.robot_id, ())
        near = inside[row].union(*(of_cause[cause] for cause in entered))
        yield robot, _distances(robot, [zones[column] for column in sorted(near)])


def _place(robot: RobotState) -> tuple[float, float]:
    assert robot.odometry is not None  # noqa: S101 - asked of no other
    return robot.odometry.pose.x, robot.odometry.pose.y


def _distances(robot: RobotState, zones: Iterable[Zone]) -> Distances:
    """The deepest zone of each cause, without its own and those of other maps."""
    nearest: Distances = {}
    (x, y), recording = _place(robot), robot.recording
    for zone in zones:
        if zone.cause == robot.robot_id:
            continue
        if zone.recording not in (None, recording):
            continue
        centre_m = math.hypot(zone.x - x, zone.y - y)
        found = Distance(centre_m - zone.radius_m, centre_m, zone)
        known = nearest.get(zone.cause)
        if known is None or found.outside_m < known.outside_m:
            nearest[zone.cause] = found
    return nearest


class ZoneEntry(NamedTuple):
    """One robot inside one zone, from trigger to release.

    Attributes:
        zone: The nearest zone of the cause at trigger.
        distance_m: Now; ``entered_m`` at the trigger.
        outside_since: When it was first found outside (monotonic, s).
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
    outside_since: float | None = None
    foretold_s: float | None = None

    def moved(self, outside_m: float, distance_m: float, now: Instant) -> "ZoneEntry":
        """The entry with the robot so far outside the zone and from its centre (m)."""
        since = None
        if outside_m > LIMITS.release_beyond_m:
            since = self.outside_since or now.mono
        return self._replace(distance_m=distance_m, outside_since=since)

    def is_over(self, now: Instant) -> bool:
        """Whether the robot has been outside for long enough."""
        since = self.outside_since
        return since is not None and now.mono - since >= LIMITS.release_after_s


def enter(
    robot: RobotState,
    near: Distance,
    greenhouse: Greenhouse,
    foretold_s: float | None,
    now: Instant,
    decision_id: str,
) -> ZoneEntry:
    """An entry that begins now; ``foretold_s``: in so long the robot reaches it (s)."""
    odometry, zone = robot.odometry, near.zone
    assert odometry is not None  # noqa: S101 - nothing is near without it
    pose, speed = odometry.pose, robot.motion(now).speed
    return ZoneEntry(
        decision_id,
        robot.robot_id,
        zone,
        entered=now,
        entered_m=near.centre_m,
        speed_before=speed,
        # It sees what its own detector found, whatever leaves the plan knows of.
        in_sight=zone.observer == robot.robot_id
        or greenhouse.in_sight(pose.x, pose.y, zone.x, zone.y),
        distance_m=near.centre_m,
        foretold_s=foretold_s,
    )


@dataclass(frozen=True, slots=True)
class LimitChange:
    """An entry that began or ended."""

    entry: ZoneEntry
    began: bool
