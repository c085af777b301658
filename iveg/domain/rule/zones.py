"""Zones round people and peers, which slow robots, and robots' entries into them."""

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
from iveg.domain.tracking.tracker import Sighting, TrackedPerson
from iveg.domain.world import World

_ROUNDING_M = 0.01
"""Bound of the rounding error (m): a robot farther outside a zone is not in it."""


class Zone(NamedTuple):
    """The surroundings of a person or peer, which slow every robot inside.

    Attributes:
        cause: The person or robot at its centre.
        observer: The robot that saw the cause; the peer itself by its own odometry.
        x: Centre in ``map`` (m); ``y`` likewise.
        sighting: The sighting that made it; None: the peer's own odometry did.
        recording: Map frame of the recording that saw the cause; the zone then slows
            recordings of that frame alone.  None: a live robot saw it.
        alert_id: Id of the alert in feedback; None of a peer.
        is_grown: Whether its person was last seen so long ago that nobody knows where
            in the zone they are.
    """

    reason: Literal["person", "robot"]
    cause: str
    observer: str
    x: float
    y: float
    radius_m: float
    sighting: Sighting | None = None
    recording: str | None = None
    alert_id: str | None = None
    is_grown: bool = False


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
    for sighting, radius in people.zone_radii(person, rule, now):
        yield Zone(
            person.class_,
            person.person_id,
            sighting.observer,
            sighting.x,
            sighting.y,
            radius,
            sighting,
            world.robots[sighting.observer].recording,
            person.decision_id,
            sighting.age_s(now) > LIMITS.seen_s,
        )


def _zone_of_peer(
    peer: RobotState, rule: DetectionRule, now: Instant
) -> Iterator[Zone]:
    """Zone of a peer that moves, or may have started unseen."""
    since = peer.likely_pose_at()
    # A recording cannot yield, and nobody yields to it.
    if peer.odometry is None or since is None or peer.is_replay:
        return
    age = max(0.0, now.mono - since)
    known = peer.age_s(now)
    # A peer at rest is an obstacle like any other; a silent peer may have started.
    at_rest = peer.stands and known is not None and known <= LIMITS.silence_s
    if at_rest or age > LIMITS.zone_lasts_s:
        return
    pose, name = peer.odometry.pose, peer.robot_id
    radius_m = grown_radius(rule.radius_m.for_class("robot"), age)
    yield Zone("robot", name, name, pose.x, pose.y, radius_m)


class Distance(NamedTuple):
    """Distance of a robot from a zone's border, positive outside, and centre (m)."""

    outside_m: float
    centre_m: float
    zone: Zone


Distances = dict[str, Distance]
"""Cause → distance to the zone of this cause in which the robot is deepest."""


def distances_to_zones(
    robots: Iterable[RobotState],
    zones: Sequence[Zone],
    entries: Mapping[str, Iterable[str]],
) -> Iterator[tuple[RobotState, Distances]]:
    """Distances of each robot to the causes whose zones it is in, or has entered.

    One comparison of all robots with all zones finds the few pairs that are near.
    """
    placed = [robot for robot in robots if robot.odometry is not None]
    table = np.array([(zone.x, zone.y, zone.radius_m) for zone in zones]).reshape(-1, 3)
    poses = np.array([_place(robot) for robot in placed]).reshape(-1, 2, 1)
    x, y, radius_m = table.T
    outside_m = np.hypot(x - poses[:, 0], y - poses[:, 1]) - radius_m
    by_cause: dict[str, list[int]] = defaultdict(list)
    for column, zone in enumerate(zones):
        by_cause[zone.cause].append(column)
    for robot, is_near in zip(placed, outside_m <= _ROUNDING_M, strict=True):
        # An entry ends by distance, so its zones count however far they are.
        entered = [by_cause[cause] for cause in entries.get(robot.robot_id, ())]
        near = {*np.flatnonzero(is_near).tolist()}.union(*entered)
        yield robot, _distances(robot, [zones[column] for column in sorted(near)])


def _place(robot: RobotState) -> tuple[float, float]:
    assert robot.odometry is not None  # noqa: S101 - only robots with a pose get here
    return robot.odometry.pose.x, robot.odometry.pose.y


def _distances(robot: RobotState, zones: Iterable[Zone]) -> Distances:
    """Deepest zone of each cause, without the robot's own and those of other maps."""
    nearest: Distances = {}
    (x, y), recording = _place(robot), robot.recording
    for zone in zones:
        if zone.cause == robot.robot_id or zone.recording not in (None, recording):
            continue
        centre_m = math.hypot(zone.x - x, zone.y - y)
        distance = Distance(centre_m - zone.radius_m, centre_m, zone)
        known = nearest.get(zone.cause)
        if known is None or distance.outside_m < known.outside_m:
            nearest[zone.cause] = distance
    return nearest


class ZoneEntry(NamedTuple):
    """One robot inside one zone, from trigger to release.

    Attributes:
        zone: The deepest zone of the cause at the trigger.
        entered_m: Distance from the zone's centre at the trigger (m).
        speed_before: Speed at the trigger (m/s).
        in_sight: Whether the robot saw the cause itself, or had a line of sight to the
            centre, at the trigger.
        distance_m: Distance from the centre now (m).
        outside_since: Start of its time beyond the release distance (monotonic, s), or
            None.
        foretold_s: Forecast time to the zone at the trigger (s); None: it was inside.
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
        """The entry at a new distance outside the zone and from its centre (m)."""
        # A smaller distance outside is noise, and the time outside begins anew.
        since = None
        if outside_m > LIMITS.release_beyond_m:
            since = now.mono if self.outside_since is None else self.outside_since
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
    """An entry that begins now; ``foretold_s``: forecast time to the zone (s)."""
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
        # A robot's own detection proves sight, whatever crop the plan has in between.
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
