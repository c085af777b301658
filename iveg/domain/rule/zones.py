"""Circles that slow robots, and which of them each robot is near.

Few circles are compared with every robot one by one; of many only those that may be
near by now (``neighbours``).
"""

import math
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Literal

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant, Odometry
from iveg.domain.obstacle import Obstacle
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.neighbours import NOT_FAR_M, Neighbours
from iveg.domain.tracking.people import People
from iveg.domain.tracking.person import Sighting, TrackedPerson
from iveg.domain.world import World

_FEW_PAIRS = 150
"""Robots times circles; beyond, arrays are quicker."""
_ROUNDING_S = 1e-6


@dataclass(frozen=True, slots=True)
class Zone:
    """A circle that slows every robot inside it.

    Attributes:
        cause: The person, robot or obstacle at its centre.
        observer: Who saw it; the peer itself for a peer's own odometry.
        x: Centre in ``map`` (m); ``y`` likewise.
        sighting: What was seen; None for a peer's own odometry.
        recording: The map frame of the recording that saw it, which slows recordings
            of that frame alone; None: a live robot saw it.
        alert_id: Of the alert that robots hear of it.
        obstacle: What the observer's laser saw, where that is all.
    """

    reason: Literal["person", "robot", "obstacle"]
    cause: str
    observer: str
    x: float
    y: float
    radius_m: float
    sighting: Sighting | None = None
    recording: str | None = None
    alert_id: str | None = None
    obstacle: Obstacle | None = None


def zones_of(
    world: World, people: People, rule: DetectionRule, now: Instant
) -> Iterator[Zone]:
    """Every circle that slows robots now."""
    for person in people.known.values():
        yield from _zones_of(person, people, world, rule, now)
    for peer in world.robots.values():
        yield from _circle_of(peer, rule, now)


def _zones_of(
    person: TrackedPerson,
    people: People,
    world: World,
    rule: DetectionRule,
    now: Instant,
    before: Sequence[Zone] = (),
) -> Iterator[Zone]:
    """The circles round somebody; where one made ``before`` is the same, that one."""
    reason, alert_id, made = person.class_, person.decision_id, iter(before)
    for sighting, radius in people.rings(person, rule, now):
        recording = world.robots[sighting.observer].recording
        same = next(made, None)
        if (
            same is not None
            and same.sighting is sighting
            and same.radius_m == radius
            and same.recording == recording
            and same.alert_id == alert_id
            and same.reason == reason
        ):
            yield same
            continue
        yield Zone(
            reason,
            person.person_id,
            sighting.observer,
            *sighting.place,
            radius,
            sighting,
            recording,
            alert_id,
        )


Found = dict[str, tuple[float, float, Zone]]
"""Cause → the deepest of its circles: how far outside (m), distance (m), the circle."""


def deepest(robot: RobotState, zones: Iterable[Zone], mine: Container[str]) -> Found:
    """The deepest circle of each cause: how far outside (m), distance (m), the circle.

    Causes that the robot is far from and was not near to are left out.
    """
    nearest: Found = {}
    if robot.odometry is None:
        return nearest
    pose, robot_id, recording = robot.odometry.pose, robot.robot_id, robot.recording
    x, y = pose.x, pose.y
    for zone in zones:
        cause, reach = zone.cause, zone.radius_m + NOT_FAR_M
        dx, dy = zone.x - x, zone.y - y
        if dx * dx + dy * dy > reach * reach and cause not in mine:
            continue
        if cause == robot_id or zone.recording not in (None, recording):
            continue
        distance = math.hypot(dx, dy)
        depth = distance - zone.radius_m
        if cause not in nearest or depth < nearest[cause][0]:
            nearest[cause] = depth, distance, zone
    return nearest


def _circle_of(
    peer: RobotState, rule: DetectionRule, now: Instant, before: Sequence[Zone] = ()
) -> Iterator[Zone]:
    """The circle of a peer, if one gives way to it; the one ``before``, if the same."""
    since = peer.likely_pose_at()
    # A recording cannot yield, and nobody yields to it.
    if peer.odometry is None or since is None or peer.is_replay:
        return
    age = max(0.0, now.mono - since)
    known = peer.age_s(now)
    at_rest = peer.stands and known is not None and known <= LIMITS.silence_s
    if at_rest or age > LIMITS.ring_lasts_s:
        return
    pose, name, radius = peer.odometry.pose, peer.robot_id, rule.radius_at(age)
    for same in before:
        if (same.x, same.y, same.radius_m) == (pose.x, pose.y, radius):
            yield same
            return
    yield Zone("robot", name, name, pose.x, pose.y, radius)


Near = Callable[[RobotState], Iterable[Zone]]
"""A robot → every circle that it is in or was in, and perhaps others; in order."""


@dataclass(frozen=True, slots=True)
class _Made:
    """The circles of one cause, as they were made.

    Attributes:
        of: Who or what they are round, by which all but their age is known.
        since: When they were made (monotonic, s); ``until`` then they stay as they are.
    """

    of: TrackedPerson | Odometry | None
    zones: Sequence[Zone]
    since: float
    until: float


class ZoneFinder:
    """Finds the circles near each robot."""

    def __init__(self) -> None:
        self._known: Neighbours | None = None
        self._rule: DetectionRule | None = None
        self._made: dict[str, _Made] = {}
        """The circles of the last judgement, by cause."""

    def near(
        self,
        world: World,
        people: People,
        rule: DetectionRule,
        now: Instant,
        inside: Mapping[str, Mapping[str, object]],
    ) -> Near:
        """Find the robots that are near each circle now.

        Args:
            world: The fleet.
            people: Everybody.
            rule: How wide a ring is.
            now: The rings' age is counted from.
            inside: By robot the causes that it must be slow for: never left out.
        """
        if len(world.robots) * (len(people.known) + len(world.robots)) <= _FEW_PAIRS:
            everything = list(zones_of(world, people, rule, now))
            return lambda _: everything
        known = self._known
        if known is not None and known.hold(world, rule, now):
            known.follow(people, rule, now)
        else:
            known = self._known = Neighbours.of(world, people, rule, now)
        before, self._made = self._made, {}
        if rule is not self._rule:
            self._rule, before = rule, {}
        look = _Look(world, people, rule, now, before, self._made)
        return partial(_near, known, look, inside)


@dataclass(frozen=True, slots=True)
class _Look:
    """One judgement: the world, and the circles that were made by the one before.

    Attributes:
        made: By this one, each once and only if a robot may be near.
    """

    world: World
    people: People
    rule: DetectionRule
    now: Instant
    before: Mapping[str, _Made]
    made: dict[str, _Made]

    def make(self, cause: str) -> _Made:
        """The circles of a cause; while they stay the same, the very same."""
        made = self.made[cause] = self._made_of(cause)
        return made

    def _made_of(self, cause: str) -> _Made:
        before, now = self.before.get(cause), self.now.mono
        person = self.people.known.get(cause)
        peer = self.world.robots.get(cause) if person is None else None
        of = person if peer is None else peer.odometry
        # What an operator marks as a thing has no ring from then on.
        if (
            before is not None
            and before.of is of
            and before.since <= now <= before.until
            and not self.people.things.known
        ):
            return before
        last = () if before is None else before.zones
        if person is not None:
            return self._made_round(person, last)
        if peer is not None:
            zones = tuple(_circle_of(peer, self.rule, self.now, last))
            return _Made(of, zones, now, -math.inf)
        return _Made(None, (), now, -math.inf)

    def _made_round(self, person: TrackedPerson, before: Sequence[Zone]) -> _Made:
        about = person, self.people, self.world, self.rule, self.now, before
        zones = tuple(_zones_of(*about))
        # Whom an operator's mark hides now has a ring again when that is over.
        hidden = bool(self.people.things.known)
        until = -math.inf if hidden else min(map(self._stays, zones), default=math.inf)
        return _Made(person, zones, self.now.mono, until)

    def _stays(self, zone: Zone) -> float:
        """Until when a ring neither grows nor ends nor changes its map (monotonic, s).

        The ring of a sighting grows from its grace on until it is as wide as rings get.
        """
        sighting, observer = zone.sighting, self.world.robots[zone.observer]
        if sighting is None or observer.description.kind == "recording":
            return -math.inf
        is_grown = zone.radius_m >= LIMITS.ring_most_m
        for_s = sighting.lasts_s if is_grown else LIMITS.growth_grace_s
        return sighting.at.mono + for_s - _ROUNDING_S


def _near(
    neighbours: Neighbours,
    look: _Look,
    inside: Mapping[str, Mapping[str, object]],
    robot: RobotState,
) -> Sequence[Zone]:
    """``Near``: people, then peers, each in their order; then what it was in before."""
    name = robot.robot_id
    causes, mine = neighbours.causes.get(name, _NOBODY), inside.get(name, _NOBODY)
    if not (causes or mine):
        return ()
    found, made = list[Zone](), look.made
    is_within = not mine or mine.keys() <= causes.keys()
    more = () if is_within else [one for one in mine if one not in causes]
    # Asked of each robot at each judgement: nearly all are made already.
    for cause in (*causes, *more) if more else causes:
        found += (made.get(cause) or look.make(cause)).zones
    return found


_NOBODY: Mapping[str, None] = MappingProxyType({})
