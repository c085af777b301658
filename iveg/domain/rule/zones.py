"""Circles that slow robots, and which of them each robot is near.

Few circles are compared with every robot one by one; many are compared as arrays, so
that a circle costs nothing unless a robot is near it.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.limits import LIMITS, ring_radius
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.people import People
from iveg.domain.tracking.person import Person, Sighting
from iveg.domain.tracking.point_index import Floats
from iveg.domain.world import World

NOT_FAR_M = 0.01
"""So far outside a ring nobody can be inside, whatever rounding does."""
_FEW_PAIRS = 150
"""Robots times circles; beyond, arrays are quicker."""


@dataclass(frozen=True, slots=True)
class Zone:
    """A circle that slows every robot inside it.

    Attributes:
        cause: The person or robot at its centre.
        observer: Who saw it; the peer itself for a peer's own odometry.
        x: Centre in ``map`` (m); ``y`` likewise.
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
    sighting: Sighting | None = None
    recording: str | None = None
    alert_id: str | None = None


def zones_of(
    world: World, people: People, rule: DetectionRule, now: Instant
) -> Iterator[Zone]:
    """Every circle that slows robots now."""
    for person in people.known.values():
        yield from _zones_of(person, world, rule, now)
    yield from _peers(world, rule, now)


def _zones_of(
    person: Person, world: World, rule: DetectionRule, now: Instant
) -> Iterator[Zone]:
    for sighting, radius in person.rings(rule, now):
        yield Zone(
            person.class_,
            person.person_id,
            sighting.observer,
            sighting.x,
            sighting.y,
            radius,
            sighting,
            world.robot(sighting.observer).recording,
            person.decision_id,
        )


def _peers(world: World, rule: DetectionRule, now: Instant) -> Iterator[Zone]:
    for peer, age in _moving(world, now):
        yield _circle_of(peer, rule.radius_at(age))


def _moving(world: World, now: Instant) -> Iterator[tuple[RobotState, float]]:
    """Peers that one gives way to, and how old their poses are (s)."""
    for peer in world.robots.values():
        since = peer.likely_pose_at()
        # A recording cannot yield, and nobody yields to it.
        if peer.odometry is None or since is None or peer.is_replay:
            continue
        age = max(0.0, now.mono - since)
        known = peer.age_s(now)
        at_rest = peer.stands and known is not None and known <= LIMITS.silence_s
        if not at_rest and age <= LIMITS.ring_lasts_s:
            yield peer, age


def _circle_of(peer: RobotState, radius_m: float) -> Zone:
    assert peer.odometry is not None  # noqa: S101 - it moves
    pose, name = peer.odometry.pose, peer.robot_id
    return Zone("robot", name, name, pose.x, pose.y, radius_m)


Near = Callable[[RobotState], Iterable[Zone]]
"""A robot → every circle that it is in or was in, and perhaps others; in order."""


def zones_near(
    world: World,
    people: People,
    rule: DetectionRule,
    now: Instant,
    inside: Mapping[str, Mapping[str, Any]],
) -> Near:
    """Find out once which robots are near which circles.

    Args:
        world: The fleet.
        people: Everybody.
        rule: How wide a ring is.
        now: The rings' age is counted from.
        inside: By robot the causes that it is told to be slow for: never left out.
    """
    if len(world.robots) * (len(people.known) + len(world.robots)) <= _FEW_PAIRS:
        everything = list(zones_of(world, people, rule, now))
        return lambda _: everything
    placed = _Placed.of(world)
    near = _people_near(placed, people, rule, now)
    peers = _peers_near(placed, world, rule, now, inside)
    order = {person_id: place for place, person_id in enumerate(people.known)}
    circles: dict[str, list[Zone]] = {}

    def found(robot: RobotState) -> Iterable[Zone]:
        mine, wanted = inside.get(robot.robot_id), near.get(robot.robot_id, set())
        if mine:
            wanted = wanted | (mine.keys() & order.keys())
        for person_id in sorted(wanted, key=order.__getitem__):
            if person_id not in circles:
                person = people.known[person_id]
                circles[person_id] = list(_zones_of(person, world, rule, now))
            yield from circles[person_id]
        yield from peers.get(robot.robot_id, ())

    return found


@dataclass(frozen=True, slots=True)
class _Placed:
    """Robots of which it is known where they are; ``places`` has shape (n, 2) (m)."""

    names: list[str]
    places: Floats

    @classmethod
    def of(cls, world: World) -> "_Placed":
        """As the world knows them now."""
        placed = [
            (robot.robot_id, robot.odometry.pose)
            for robot in world.robots.values()
            if robot.odometry is not None
        ]
        places = np.array([(pose.x, pose.y) for _, pose in placed]).reshape(-1, 2)
        return cls([name for name, _ in placed], places)

    def within(self, x: Floats, y: Floats, limit: Floats) -> Iterator[tuple[str, int]]:
        """Which robots are within ``limit`` (m) of which places."""
        dx, dy = x - self.places[:, :1], y - self.places[:, 1:]
        rows, columns = np.nonzero((dx * dx + dy * dy <= limit * limit) & (limit > 0.0))
        for row, column in zip(rows.tolist(), columns.tolist(), strict=True):
            yield self.names[row], column


def _people_near(
    placed: _Placed, people: People, rule: DetectionRule, now: Instant
) -> dict[str, set[str]]:
    """Robot → the people whom it may be near."""
    spots = people.spots
    x, y, seen_at, reach = spots.columns
    age = np.maximum(0.0, now.mono - seen_at)
    ring = ring_radius(rule.radius_m, age, np.minimum, np.maximum)
    ring = np.maximum(reach, ring) + 2 * NOT_FAR_M
    limit = np.where(age <= LIMITS.ring_lasts_s, ring, -1.0)
    near: dict[str, set[str]] = {}
    for robot_id, column in placed.within(x, y, limit):
        near.setdefault(robot_id, set()).add(spots.owners[column][0])
    return near


def _peers_near(
    placed: _Placed,
    world: World,
    rule: DetectionRule,
    now: Instant,
    inside: Mapping[str, Mapping[str, Any]],
) -> dict[str, list[Zone]]:
    """Robot → the peers that it may be near or is slow for."""
    peers = list(_moving(world, now))
    rows = {name: row for row, name in enumerate(placed.names)}
    places = placed.places[[rows[peer.robot_id] for peer, _ in peers]]
    ages = np.array([age for _, age in peers])
    limit = ring_radius(rule.radius_m, ages, np.minimum, np.maximum) + 2 * NOT_FAR_M
    chosen: dict[str, set[int]] = {}
    for robot_id, column in placed.within(places[:, 0], places[:, 1], limit):
        # A robot is near itself, which does not slow it.
        if peers[column][0].robot_id != robot_id:
            chosen.setdefault(robot_id, set()).add(column)
    place = {peer.robot_id: column for column, (peer, _) in enumerate(peers)}
    for robot_id, causes in inside.items():
        if known := {place[cause] for cause in causes.keys() & place.keys()}:
            chosen[robot_id] = chosen.get(robot_id, set()) | known

    def circle(column: int) -> Zone:
        peer, age = peers[column]
        return _circle_of(peer, rule.radius_at(age))

    return {
        name: [circle(one) for one in sorted(mine)] for name, mine in chosen.items()
    }
