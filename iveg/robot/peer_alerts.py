"""Alerts of peers as last received, and which of them count for a robot."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from iveg.domain.feedback import (
    FULL_SPEED,
    HALF_SPEED,
    UNSUPERVISED,
    Feedback,
    FeedbackAlert,
    SpeedLimit,
)
from iveg.domain.geometry import Pose2D
from iveg.domain.limits import LIMITS, grown_radius
from iveg.domain.motion import MotionTrack
from iveg.domain.parameters import Class
from iveg.robot.gate import FREE, Ahead, Cap, known_reason

MOVED_ON_S = 1.0

AlertKey = tuple[str, str | None, str | None, int]
"""Decision, observer, class, and which of those that share them."""


@dataclass(frozen=True, slots=True)
class KeptAlert:
    """One alert as last received.

    Attributes:
        missing_since: Time of the topic's first message without it; None: present.
        myself: The alert describes this robot.
    """

    alert: FeedbackAlert
    at: float
    missing_since: float | None = None
    myself: bool = False


@dataclass(frozen=True, slots=True)
class Neighbour:
    """A person or robot in ``map``, with the radii of its body and its zone (m)."""

    kind: Class
    name: str
    x: float
    y: float
    body_m: float
    zone_m: float


PERSON_M, PEER_M = 0.35, 0.75
"""Radii of bodies."""


@dataclass(frozen=True, slots=True)
class PeerObserver:
    """The observer of a topic at the pose that iVeg reports.

    Attributes:
        stamp: As received; while it stays the same, the pose grows old.
        at: When this stamp was first received (monotonic, s).
        speed: Along the pose's heading (m/s).
    """

    pose: Pose2D
    speed: float
    stands: bool
    stamp: str | None
    at: float

    def cap(
        self, name: str, own: Pose2D, radius_m: float, beyond: float, now: float
    ) -> Cap:
        """Cap that the peer requires of a robot at ``own``.

        Args:
            name: The peer's topic.
            own: In ``map``.
            radius_m: Zone of a peer whose pose is fresh (m).
            beyond: How much farther it counts, of a robot that is slow already (m).
            now: Monotonic (s).
        """
        age = now - self.at
        if age > LIMITS.zone_lasts_s or (self.stands and age <= LIMITS.silence_s):
            return FREE
        zone_m = grown_radius(radius_m, age) + beyond
        near = own.distance_to(self.pose.x, self.pose.y) <= zone_m
        return Cap(HALF_SPEED, "robot", name) if near else FREE

    def ahead(self, name: str, radius_m: float, now: float) -> Iterator[Ahead]:
        """Its zone as it goes on, while its pose is young."""
        age, pose = now - self.at, self.pose
        if age <= LIMITS.silence_s:
            goes = self.speed * math.cos(pose.yaw), self.speed * math.sin(pose.yaw)
            row = pose.x, pose.y, *goes, age, radius_m
            yield row, Cap(HALF_SPEED, "robot", name)


class RuleRadii:
    """Radii of the rule as iVeg sent them: of each class the largest of the last 10 s.

    So a robot that is told a smaller radius keeps the greater one for as long as a
    sighting that was made under it has a zone.
    """

    def __init__(self) -> None:
        self._values: dict[Class, list[tuple[float, float]]] = {}
        """By class: when each came (monotonic, s), and its value (m); largest first."""

    def note(self, radii: Mapping[Class, float], now: float) -> None:
        """Note the values of a message."""
        for class_, radius_m in radii.items():
            values = self._values.get(class_, [])
            larger = [
                earlier
                for earlier in values
                if earlier[1] > radius_m and _counts(earlier, now)
            ]
            self._values[class_] = [*larger, (now, radius_m)]

    @property
    def is_known(self) -> bool:
        """Whether iVeg sent any."""
        return bool(self._values)

    def fresh_m(self, class_: Class, now: float) -> float:
        """Radius of a fresh zone of this class (m); by default that of the paper.

        The newest value counts until another comes, however old it is.
        """
        values = self._values.get(class_)
        if not values:
            return LIMITS.zone_default_m
        return next(
            (earlier[1] for earlier in values if _counts(earlier, now)), values[-1][1]
        )


def _counts(value: tuple[float, float], now: float) -> bool:
    return now - value[0] <= LIMITS.zone_lasts_s


@dataclass(slots=True)
class PeerTopic:
    """Newest state of one topic; ``at`` is when it came (monotonic, s)."""

    at: float
    seq: int = -1
    peer: PeerObserver | None = None
    speed_limit: SpeedLimit = UNSUPERVISED
    alerts: dict[AlertKey, KeptAlert] = field(default_factory=dict)
    foresight: bool = False
    track: MotionTrack = field(default_factory=MotionTrack)


def is_alive(kept: KeptAlert, topic: PeerTopic, now: float) -> bool:
    """Whether an alert still counts: recent, and not superseded on its topic."""
    missing = kept.missing_since
    moved_on = missing is not None and topic.at - missing >= MOVED_ON_S
    return not moved_on and now - kept.at <= LIMITS.zone_lasts_s


def alerts_of(feedback: Feedback) -> dict[AlertKey, FeedbackAlert]:
    """People and robots of one message; the newest is usually in the list too."""
    alerts = list(feedback.alerts)
    if feedback.alert is not None and feedback.alert not in alerts:
        alerts.append(feedback.alert)
    found: dict[AlertKey, FeedbackAlert] = {}
    counts = Counter[tuple[str, str | None, str]]()
    for alert in alerts:
        if alert.class_ is not None:
            shared = alert.decision_id, alert.observer, alert.class_
            found[*shared, counts[shared]] = alert
            counts[shared] += 1
    return found


def limited_free(speed_limit: SpeedLimit, alert: FeedbackAlert) -> bool:
    """Whether iVeg itself says that this alert limits nothing."""
    return (
        alert.decision_id != ""
        and speed_limit.decision_id == alert.decision_id
        and speed_limit.speed_factor >= FULL_SPEED
    )


def zone_radius(
    alert: FeedbackAlert, radii: RuleRadii, silence: float, now: float
) -> float:
    """The radius of an alert after so long a silence, at least the rule's (m)."""
    told_m = radii.fresh_m(alert.class_ or "person", now)
    if alert.radius_m is not None:
        told_m = max(alert.radius_m, told_m) if radii.is_known else alert.radius_m
    return grown_radius(told_m, silence)


def is_inside(
    alert: FeedbackAlert,
    observer: PeerObserver | None,
    own: Pose2D | None,
    zone_m: float,
) -> bool:
    """Whether ``own`` is inside the radius, about the observer if no place is known."""
    if alert.position is not None:
        place = alert.position[:2]
    elif observer is not None:
        place = (observer.pose.x, observer.pose.y)
    else:
        return True
    return own is None or own.distance_to(*place) <= zone_m


def alert_ahead(kept: KeptAlert, radii: RuleRadii, now: float) -> Iterator[Ahead]:
    """The alert as something that the robot may drive into; nothing without a place."""
    alert = kept.alert
    if alert.position is not None and alert.velocity is not None:
        (x, y, _), goes = alert.position, alert.velocity
        radius_m = zone_radius(alert, radii, 0.0, now)
        yield (x, y, *goes, now - kept.at, radius_m), alerted(alert)


def neighbour_of(
    alert: FeedbackAlert, radii: RuleRadii, now: float
) -> Iterator[Neighbour]:
    """The person or robot of an alert; nothing without a place."""
    if alert.position is not None and alert.class_ is not None:
        x, y, _ = alert.position
        body_m = PERSON_M if alert.class_ == "person" else PEER_M
        zone_m = zone_radius(alert, radii, 0.0, now)
        name = alert.class_id or alert.class_
        yield Neighbour(alert.class_, name, x, y, body_m, zone_m)


def alerted(alert: FeedbackAlert, *, waits: bool = True) -> Cap:
    """The cap that an alert asks for."""
    reason = known_reason(alert.class_ or "stale")
    return Cap(HALF_SPEED, reason, None, alert.decision_id or None, waits)
