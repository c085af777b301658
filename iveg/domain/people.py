"""Who is in the greenhouse: sightings of robots become people, and people age.

::

    seen (<= 1 s) ──> remembered (<= 10 s, ring grows) ──> last seen (<= 600 s, no ring)
      ^________________________|____________________________|            └──> gone

Several sightings are one person for the eye; for safety each robot's own sighting
keeps its own circle, so a wrong merge never deletes protection (safety.md §3.4).
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from iveg.domain.alerts import Class, Rule
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.observations import Detection, DetectionFrame, Instant
from iveg.domain.profiles import profile_of
from iveg.domain.suspicions import POSSIBLE_FROM, Suspicions
from iveg.domain.world import RobotState, World

Stage = Literal["seen", "remembered", "last_seen", "gone"]

SEEN_S, RING_S, LAST_SEEN_S = 1.0, 10.0, 600.0
_GATE_M, _GATE_SPEED, _GATE_CAP_M = 1.0, 1.6, 2.0
_PEER_GATE_M = 1.0
_MAX_PEOPLE = 256
_BEYOND_WALL_M = 2.0


@dataclass(frozen=True, slots=True)
class Sighting:
    """One robot's newest look at one person, in ``map``.

    Attributes:
        at: Source moment on our clocks.
        possible: It was below the threshold, but seen again and again.
        reach_m: Where the position is doubtful, x and y are the observer's own, and
            this is how far its camera reaches (m); else 0.
    """

    observer: str
    x: float
    y: float
    z: float
    at: Instant
    class_id: str
    confidence: float
    possible: bool = False
    reach_m: float = 0.0

    def age_s(self, now: Instant) -> float:
        """Seconds since the look."""
        return max(0.0, now.mono - self.at.mono)


@dataclass(frozen=True, slots=True)
class Person:
    """A person (or a robot that is none of ours) with everyone who saw them.

    Attributes:
        sightings: By observer, the newest of each.
    """

    person_id: str
    class_: Class
    decision_id: str
    first_seen: Instant
    newest: Sighting
    sightings: dict[str, Sighting] = field(default_factory=dict)

    def age_s(self, now: Instant) -> float:
        """Seconds since the last look of any robot."""
        return self.newest.age_s(now)

    def stage(self, now: Instant) -> Stage:
        """Where in the life of a sighting this person stands."""
        age = self.age_s(now)
        if age <= SEEN_S:
            return "seen"
        if age <= RING_S:
            return "remembered"
        return "last_seen" if age <= LAST_SEEN_S else "gone"

    def rings(self, rule: Rule, now: Instant) -> Iterable[tuple[Sighting, float]]:
        """Every circle that protects this person, with its radius now (m)."""
        for sighting in self.sightings.values():
            age = sighting.age_s(now)
            if age <= RING_S:
                yield sighting, max(sighting.reach_m, rule.radius_at(age))


@dataclass(frozen=True, slots=True)
class Placed:
    """A detection in ``map`` with what became of it.

    Attributes:
        person: The person it belongs to; None when faint, another class, or a peer.
        peer: The fleet member that it is a sighting of.
        peer_residual_m: How far from that member's own odometry (m).
        appeared: Whether it made a new person.
        possible: Below the threshold, but seen again and again.
        doubtful: Outside the greenhouse, so nobody knows where it is: where its
            observer stood, and how far that one sees (m).
    """

    detection: Detection
    position: tuple[float, float, float]
    kind: Literal["alert", "faint", "other"]
    class_: Class | None
    person: Person | None = None
    peer: str | None = None
    peer_residual_m: float | None = None
    appeared: bool = False
    possible: bool = False
    doubtful: tuple[Pose2D, float] | None = None


class People:
    """Everyone who is known, in the order of their appearance.

    Args:
        bounds: The outer wall; what is seen beyond it is of doubtful position.
    """

    def __init__(self, bounds: Rectangle | None = None) -> None:
        self._bounds = bounds
        self._suspicions = Suspicions()
        self.known: dict[str, Person] = {}
        self._count = 0
        self._faint: dict[str, list[Placed]] = {}

    def sight(
        self,
        frame: DetectionFrame,
        world: World,
        rule: Rule,
        at: Instant,
        new_id: str,
    ) -> list[Placed]:
        """Take one look of one robot in.

        ``at`` is the look's source moment on our clocks; ``new_id`` begins the
        decision ids of whoever appears.

        Returns:
            Every detection that could be placed, judged and, if confident, assigned.
        """
        observer = world.robot(frame.robot_id)
        placed = [
            judged
            for detection in frame.detections
            if (judged := _place(detection, frame, observer, rule)) is not None
        ]
        if rule.possible_people:
            placed = self._suspect(placed, frame.robot_id, at)
        placed = [_match_peer(one, observer, world, at) for one in placed]
        placed = [self._doubt(one, frame, observer) for one in placed]
        self._faint[frame.robot_id] = [one for one in placed if one.kind == "faint"]
        return self._assign(placed, frame.robot_id, at, new_id)

    def _suspect(
        self, placed: Sequence[Placed], observer: str, at: Instant
    ) -> list[Placed]:
        """Raise faint people who are seen again and again to possible ones."""
        spots = [one.position[:2] for one in placed if _is_suspect(one)]
        again = set(self._suspicions.seen_again(spots, observer, at))
        return [
            replace(one, kind="alert", possible=True)
            if one.kind == "faint" and _is_suspect(one) and one.position[:2] in again
            else one
            for one in placed
        ]

    def _doubt(
        self, one: Placed, frame: DetectionFrame, observer: RobotState
    ) -> Placed:
        """Mark what cannot be where it was said to be (safety.md §3.4)."""
        x, y, _ = one.position
        if self._bounds is None or self._bounds.contains(x, y, _BEYOND_WALL_M):
            return one
        pose = observer.pose_at_stamp(frame.origin.stamp_s)
        if one.kind != "alert" or one.peer is not None or pose is None:
            return one
        return replace(one, doubtful=(pose, profile_of(observer.robot_id).camera_range))

    def _assign(
        self, placed: Sequence[Placed], observer: str, at: Instant, new_id: str
    ) -> list[Placed]:
        """Gated nearest neighbour, each person once a look, closest pairs first."""
        out = list(placed)
        wanting = [
            index
            for index, one in enumerate(out)
            if one.kind == "alert" and one.peer is None
        ]
        pairs = sorted(
            (distance, index, person_id)
            for index in wanting
            for person_id, person in self.known.items()
            if person.class_ == out[index].class_
            and (distance := _distance(person, out[index], observer, at)) < math.inf
        )
        taken: set[str] = set()
        for _, index, person_id in pairs:
            if index in wanting and person_id not in taken:
                wanting.remove(index)
                taken.add(person_id)
                out[index] = self._seen_again(person_id, out[index], observer, at)
        for index in wanting:
            if len(self.known) < _MAX_PEOPLE:
                out[index] = self._appear(out[index], observer, at, f"{new_id}-{index}")
        return out

    def _seen_again(
        self, person_id: str, one: Placed, observer: str, at: Instant
    ) -> Placed:
        person, sighting = self.known[person_id], _sighting(one, observer, at)
        older = person.sightings.get(observer)
        if older is not None and older.at.mono > at.mono:
            return replace(one, person=person)
        newest = max(person.newest, sighting, key=lambda look: look.at.mono)
        person = replace(
            person,
            newest=newest,
            sightings={**person.sightings, observer: sighting},
        )
        self.known[person_id] = person
        return replace(one, person=person)

    def _appear(
        self, one: Placed, observer: str, at: Instant, decision_id: str
    ) -> Placed:
        self._count += 1
        sighting = _sighting(one, observer, at)
        person = Person(
            f"{'P' if one.class_ == 'person' else 'R'}{self._count}",
            one.class_ or "person",
            decision_id,
            first_seen=at,
            newest=sighting,
            sightings={observer: sighting},
        )
        self.known[person.person_id] = person
        return replace(one, person=person, appeared=True)

    def drop_sighting(self, person_id: str, sighting: Sighting) -> Person:
        """Somebody has looked there in vain: this look protects nobody any more."""
        person = self.known[person_id]
        left = {
            name: look for name, look in person.sightings.items() if look != sighting
        }
        self.known[person_id] = replace(person, sightings=left)
        return self.known[person_id]

    def is_suspected(self, person: Person, x: float, y: float, observer: str) -> bool:
        """Whether a robot's newest look holds a faint one of the kind near a spot."""
        return any(
            one.class_ == person.class_
            and math.hypot(one.position[0] - x, one.position[1] - y) <= _GATE_M
            for one in self._faint.get(observer, ())
        )

    def forget(self, now: Instant) -> list[Person]:
        """Drop who has not been seen for ten minutes; returns them."""
        gone = [one for one in self.known.values() if one.stage(now) == "gone"]
        for person in gone:
            del self.known[person.person_id]
        return gone


def _place(
    detection: Detection, frame: DetectionFrame, observer: RobotState, rule: Rule
) -> Placed | None:
    x, y, z = detection.box.centre
    if detection.frame_id == "base_link":
        pose = observer.pose_at_stamp(frame.origin.stamp_s)
        if pose is None:
            return None
        x, y = pose.transform(x, y)
    verdict = rule.judge(detection.class_id, detection.probability)
    return Placed(detection, (x, y, z), verdict.kind, verdict.class_)


def _match_peer(one: Placed, observer: RobotState, world: World, at: Instant) -> Placed:
    """Recognise a sighted robot as the fleet member that stands there by odometry."""
    if one.class_ != "robot":
        return one
    nearest: tuple[float, str] | None = None
    for peer in world.robots.values():
        since = peer.likely_pose_at()
        if peer is observer or peer.odometry is None or since is None:
            continue
        reach = _PEER_GATE_M + profile_of(peer.robot_id).length / 2
        reach += _GATE_SPEED * min(1.0, max(0.0, at.mono - since))
        residual = peer.odometry.pose.distance_to(one.position[0], one.position[1])
        if residual <= reach and (nearest is None or residual < nearest[0]):
            nearest = (residual, peer.robot_id)
    if nearest is None:
        return one
    return replace(one, peer=nearest[1], peer_residual_m=nearest[0])


def _sighting(one: Placed, observer: str, at: Instant) -> Sighting:
    x, y, z = one.position
    reach = 0.0
    if one.doubtful is not None:
        pose, reach = one.doubtful
        x, y = pose.x, pose.y
    said = one.detection
    return Sighting(
        observer, x, y, z, at, said.class_id, said.probability, one.possible, reach
    )


def _distance(person: Person, one: Placed, observer: str, at: Instant) -> float:
    """To the nearest look that the detection may continue (m); inf when to none.

    Beside the newest look every fresh one counts: where two robots see one person with
    noise, a detection that lies far from the one look seldom lies far from both.
    A doubtful position continues only the same robot's doubtful one.
    """
    if one.doubtful is not None:
        same = person.newest.reach_m > 0.0 and person.newest.observer == observer
        return 0.0 if same else math.inf
    x, y, _ = one.position
    return min(
        (
            distance
            for look in (person.newest, *person.sightings.values())
            if look.reach_m == 0.0
            and (look is person.newest or look.age_s(at) <= SEEN_S)
            and (distance := math.hypot(look.x - x, look.y - y)) <= _gate(look, at)
        ),
        default=math.inf,
    )


def _gate(look: Sighting, at: Instant) -> float:
    """How far one may have walked since a look (m, capped)."""
    return min(_GATE_CAP_M, _GATE_M + _GATE_SPEED * abs(at.mono - look.at.mono))


def _is_suspect(one: Placed) -> bool:
    return one.class_ == "person" and one.detection.probability >= POSSIBLE_FROM
