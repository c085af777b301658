"""Alerts of peers as last received, and which of them count for a robot."""

import math
from collections.abc import Iterator
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
from iveg.domain.limits import LIMITS, ring_radius
from iveg.domain.observations import Origin
from iveg.robot.caps import FREE, Cap, known_reason
from iveg.robot.lookahead import Ahead

MOVED_ON_S = 1.0
_MAX_BOOTS = 32

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
class PeerObserver:
    """The observer of a topic at the pose that iVeg reports.

    Attributes:
        stamp: As received; while it stays the same, the pose grows old.
        at: When this stamp was first received (monotonic, s).
        speed: Forwards (m/s).
    """

    pose: Pose2D
    stands: bool
    stamp: str | None
    at: float
    speed: float = 0.0

    def cap(self, name: str, own: Pose2D, beyond: float, now: float) -> Cap:
        """Cap that the peer requires of a robot at ``own``."""
        age = now - self.at
        if age > LIMITS.ring_lasts_s or (self.stands and age <= LIMITS.silence_s):
            return FREE
        ring = ring_radius(LIMITS.ring_default_m, age) + beyond
        near = own.distance_to(self.pose.x, self.pose.y) <= ring
        return Cap(HALF_SPEED, "robot", name) if near else FREE

    def ahead(self, name: str, now: float) -> Iterator[Ahead]:
        """Its circle as it goes on, while its pose is young."""
        age, pose = now - self.at, self.pose
        if age <= LIMITS.silence_s:
            goes = self.speed * math.cos(pose.yaw), self.speed * math.sin(pose.yaw)
            row = pose.x, pose.y, *goes, age, LIMITS.ring_default_m
            yield row, Cap(HALF_SPEED, "robot", name)


@dataclass(slots=True)
class PeerTopic:
    """Newest state of one topic; ``boots`` are all seen so far, newest last."""

    origin: Origin
    at: float
    boots: list[str | None]
    peer: PeerObserver | None = None
    speed_limit: SpeedLimit = UNSUPERVISED
    alerts: dict[AlertKey, KeptAlert] = field(default_factory=dict)
    foresight: bool = False


def is_alive(kept: KeptAlert, topic: PeerTopic, now: float) -> bool:
    """Whether an alert still counts: recent, and not superseded on its topic."""
    missing = kept.missing_since
    moved_on = missing is not None and topic.at - missing >= MOVED_ON_S
    return not moved_on and now - kept.at <= LIMITS.ring_lasts_s


def is_newer(origin: Origin, topic: PeerTopic) -> bool:
    """Whether a message counts: of an unknown boot, or with a higher ``seq``."""
    if origin.boot != topic.origin.boot:
        if origin.boot in topic.boots:
            return False
        topic.boots = [*topic.boots, origin.boot][-_MAX_BOOTS:]
        return True
    if origin.seq is None or topic.origin.seq is None:
        return True
    return origin.seq > topic.origin.seq


def alerts_of(feedback: Feedback) -> dict[AlertKey, FeedbackAlert]:
    """People and robots of one message; the newest is usually in the list too."""
    alerts = list(feedback.alerts)
    if feedback.alert is not None and feedback.alert not in alerts:
        alerts.append(feedback.alert)
    found: dict[AlertKey, FeedbackAlert] = {}
    for alert in alerts:
        if alert.class_ is None:
            continue
        number = 0
        while (key := (*_whose(alert), number)) in found:
            number += 1
        found[key] = alert
    return found


def _whose(alert: FeedbackAlert) -> tuple[str, str | None, str | None]:
    return alert.decision_id, alert.observer, alert.class_


def limited_free(speed_limit: SpeedLimit, alert: FeedbackAlert) -> bool:
    """Whether iVeg itself says that this alert limits nothing."""
    return (
        alert.decision_id != ""
        and speed_limit.decision_id == alert.decision_id
        and speed_limit.speed_factor >= FULL_SPEED
    )


def ring_of(alert: FeedbackAlert, silence: float) -> float:
    """The radius of an alert after so long a silence (m)."""
    radius_m = LIMITS.ring_default_m if alert.radius_m is None else alert.radius_m
    return ring_radius(radius_m, silence)


def is_inside(
    alert: FeedbackAlert, observer: PeerObserver | None, own: Pose2D | None, ring: float
) -> bool:
    """Whether ``own`` is inside the radius, about the observer if no place is known."""
    if alert.position is not None:
        place = alert.position[:2]
    elif observer is not None:
        place = (observer.pose.x, observer.pose.y)
    else:
        return True
    return own is None or own.distance_to(*place) <= ring


def alert_ahead(kept: KeptAlert, now: float) -> Iterator[Ahead]:
    """The alert as something that the robot may drive into; nothing without a place."""
    alert = kept.alert
    if alert.position is not None and alert.velocity is not None:
        (x, y, _), goes = alert.position, alert.velocity
        yield (x, y, *goes, now - kept.at, ring_of(alert, 0.0)), alerted(alert)


def alerted(alert: FeedbackAlert, *, waits: bool = True) -> Cap:
    """The cap that an alert asks for."""
    reason = known_reason(alert.class_ or "stale")
    return Cap(HALF_SPEED, reason, None, alert.decision_id or None, waits)
