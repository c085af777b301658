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
from iveg.domain.rule.paths import MovingZone
from iveg.robot.gate import FREE, Cap, CappedZone, known_reason

MOVED_ON_S = 1.0
"""An alert that the messages of its topic lack counts this much longer (s)."""

AlertKey = tuple[str, str | None, str | None, int]
"""Decision, observer, class, and number among the alerts that share all three."""


@dataclass(frozen=True, slots=True)
class KeptAlert:
    """One alert as last received.

    Attributes:
        at: When it was received (monotonic, s).
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
"""Radii of bodies as navigation and RViz get them (m)."""


@dataclass(frozen=True, slots=True)
class PeerObserver:
    """The observer of a topic at the pose that iVeg reports.

    Attributes:
        stamp: Stamp of the pose; while it does not change, the pose grows old.
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
            beyond: Added to the zone for a robot that is slow already (m).
            now: Monotonic (s).
        """
        age = now - self.at
        # A peer that stood a second ago may have started since.
        if age > LIMITS.zone_lasts_s or (self.stands and age <= LIMITS.silence_s):
            return FREE
        zone_m = grown_radius(radius_m, age) + beyond
        near = own.distance_to(self.pose.x, self.pose.y) <= zone_m
        return Cap(HALF_SPEED, "robot", name) if near else FREE

    def zone(self, name: str, radius_m: float, now: float) -> Iterator[CappedZone]:
        """Its moving zone, while its pose is fresh."""
        age, pose = now - self.at, self.pose
        if age <= LIMITS.silence_s:
            vx, vy = self.speed * math.cos(pose.yaw), self.speed * math.sin(pose.yaw)
            zone = MovingZone(pose.x, pose.y, vx, vy, age, radius_m)
            yield zone, Cap(HALF_SPEED, "robot", name)


class RuleRadii:
    """Radii of the rule as iVeg sent them: of each class the largest of the last 10 s.

    After a change to a smaller radius the larger one stays for as long as a sighting
    that was made under it has a zone.
    """

    def __init__(self) -> None:
        self._values: dict[Class, list[tuple[float, float]]] = {}
        """Time of arrival (monotonic, s) and radius (m) by class, largest first."""

    def note(self, radii: Mapping[Class, float], now: float) -> None:
        """Note the values of a message."""
        for class_, radius_m in radii.items():
            values = self._values.get(class_, [])
            larger = [
                entry for entry in values if entry[1] > radius_m and _counts(entry, now)
            ]
            self._values[class_] = [*larger, (now, radius_m)]

    @property
    def is_known(self) -> bool:
        """Whether iVeg sent any."""
        return bool(self._values)

    def fresh_m(self, class_: Class, now: float) -> float:
        """Radius of a fresh zone of this class (m); the paper's until iVeg sends one.

        The newest value counts until another comes, however old it is.
        """
        values = self._values.get(class_)
        if not values:
            return LIMITS.zone_default_m
        return next(
            (entry[1] for entry in values if _counts(entry, now)), values[-1][1]
        )


def _counts(entry: tuple[float, float], now: float) -> bool:
    return now - entry[0] <= LIMITS.zone_lasts_s


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
    since = kept.missing_since
    # Against the topic's newest message, so that silence ends no alert early.
    moved_on = since is not None and topic.at - since >= MOVED_ON_S
    return not moved_on and now - kept.at <= LIMITS.zone_lasts_s


def alerts_of(feedback: Feedback) -> dict[AlertKey, FeedbackAlert]:
    """People and robots of one message; the newest is usually in the list too."""
    alerts = list(feedback.alerts)
    if feedback.alert is not None and feedback.alert not in alerts:
        alerts.append(feedback.alert)
    by_key: dict[AlertKey, FeedbackAlert] = {}
    counts = Counter[tuple[str, str | None, str]]()
    for alert in alerts:
        if alert.class_ is not None:
            shared = alert.decision_id, alert.observer, alert.class_
            by_key[*shared, counts[shared]] = alert
            counts[shared] += 1
    return by_key


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
    """Radius of an alert's zone (m) after ``silence`` (s); at least the rule's."""
    fresh_m = radii.fresh_m(alert.class_ or "person", now)
    if alert.radius_m is not None:
        # The paper's default is no lower bound: a rule may ask for less.
        fresh_m = max(alert.radius_m, fresh_m) if radii.is_known else alert.radius_m
    return grown_radius(fresh_m, silence)


def is_inside(
    alert: FeedbackAlert,
    observer: PeerObserver | None,
    own: Pose2D | None,
    zone_m: float,
) -> bool:
    """Whether ``own`` is in the zone around the alert's place, else its observer's."""
    if alert.position is not None:
        place = alert.position[:2]
    elif observer is not None:
        place = (observer.pose.x, observer.pose.y)
    else:
        return True
    # Without either place nobody knows that the robot is outside.
    return own is None or own.distance_to(*place) <= zone_m


def alert_zone(kept: KeptAlert, radii: RuleRadii, now: float) -> Iterator[CappedZone]:
    """Moving zone of an alert; nothing without a place or velocity."""
    alert = kept.alert
    if alert.position is not None and alert.velocity is not None:
        # Not grown: after a second of silence the topic has no forecast at all.
        radius_m = zone_radius(alert, radii, 0.0, now)
        (x, y, _), (vx, vy) = alert.position, alert.velocity
        yield MovingZone(x, y, vx, vy, now - kept.at, radius_m), alert_cap(alert)


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


def alert_cap(alert: FeedbackAlert, *, waits: bool = True) -> Cap:
    """The cap that an alert asks for."""
    reason = known_reason(alert.class_ or "stale")
    return Cap(HALF_SPEED, reason, None, alert.decision_id or None, waits)
