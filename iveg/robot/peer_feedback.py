"""Feedback of every peer topic, kept with its age: the robot's view of others.

Algorithm 3 of the paper, judged against the robot's own pose.  It differs in four
ways: a person missing from a message ages out instead of being dropped, a radius grows
while its topic is silent (docs/safety.md), a peer known to stand slows nobody,
and an alert about the robot itself is ignored, or it would slow down for ever.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

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
from iveg.robot.caps import FREE, Cap, known_reason, quantised
from iveg.robot.lookahead import Ahead

MOVED_ON_S = 1.0
MYSELF_WITHIN_M = 1.0
_MAX_TOPICS, _MAX_ALERTS, _MAX_BOOTS = 64, 512, 32

_Key = tuple[str, str | None, str | None, int]
"""Decision, observer, class, and which of those that share them."""


@dataclass(frozen=True, slots=True)
class _Kept:
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
class _Peer:
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
class _Topic:
    """Newest state of one topic; ``boots`` are all seen so far, newest last."""

    origin: Origin
    at: float
    boots: list[str | None]
    peer: _Peer | None = None
    speed_limit: SpeedLimit = UNSUPERVISED
    alerts: dict[_Key, _Kept] = field(default_factory=dict)
    foresight: bool = False


class PeerFeedback:
    """All feedback that one robot received.

    Args:
        robot_id: Whose speed limits count.
    """

    def __init__(self, robot_id: str) -> None:
        self._me = robot_id
        self._topics: dict[str, _Topic] = {}

    def apply(
        self, topic: str, feedback: Feedback, own: Pose2D | None, now: float
    ) -> bool:
        """Apply a message of ``topic``; messages older than the newest are dropped.

        Returns:
            Whether it was accepted.
        """
        memory = self._topics.get(topic)
        if memory is None:
            memory = _Topic(feedback.origin, now, [feedback.origin.boot])
            self._make_room()
            self._topics[topic] = memory
        elif not _newer(feedback.origin, memory):
            return False
        memory.origin, memory.at = feedback.origin, now
        memory.peer = self._peer(memory.peer, feedback, now)
        memory.speed_limit = feedback.speed_limits.get(self._me, UNSUPERVISED)
        memory.foresight = feedback.foresight
        self._remember(memory, feedback, own, now)
        return True

    def peers(self, now: float) -> Iterator[Pose2D]:
        """Where every peer is that was heard of within a second."""
        for topic in self._topics.values():
            if topic.peer is not None and now - topic.peer.at <= LIMITS.silence_s:
                yield topic.peer.pose

    def caps(self, own: Pose2D | None, slowed: bool, now: float) -> Iterator[Cap]:
        """All caps on this robot at pose ``own`` in ``map``.

        Args:
            own: None while the robot is not localised.
            slowed: The robot is already slow for a person or peer: release is delayed.
            now: Monotonic (s).
        """
        beyond = LIMITS.release_beyond_m if slowed else 0.0
        for name, topic in self._topics.items():
            silence = now - topic.at
            if silence > LIMITS.ring_lasts_s:
                continue
            yield _mandated(topic.speed_limit)
            for kept in topic.alerts.values():
                if kept.myself or not _alive(kept, topic, now):
                    continue
                ring = _ring(kept.alert, silence) + beyond
                if _inside(kept.alert, topic.peer, own, ring):
                    # One that is missing has been kept for its second already.
                    yield _alerted(kept.alert, waits=kept.missing_since is None)
            if topic.peer is not None and own is not None:
                yield topic.peer.cap(name, own, beyond, now)

    def ahead(self, now: float) -> Iterator[Ahead]:
        """Circles whose motion is known, where the rule looks ahead."""
        for name, topic in self._topics.items():
            if not topic.foresight or now - topic.at > LIMITS.silence_s:
                continue
            for kept in topic.alerts.values():
                if not kept.myself and kept.missing_since is None:
                    yield from _alert_ahead(kept, now)
            peer = topic.peer
            if peer is not None and not peer.stands:
                yield from peer.ahead(name, now)

    def _peer(
        self, before: _Peer | None, feedback: Feedback, now: float
    ) -> _Peer | None:
        if feedback.robot_id == self._me or feedback.pose is None:
            return None
        twist, stamp = feedback.twist, feedback.pose_stamp
        stands = (
            twist is not None
            and max(abs(twist.linear_x), abs(twist.angular_z)) < LIMITS.standing_speed
        )
        repeated = before is not None and stamp is not None and before.stamp == stamp
        at = before.at if before is not None and repeated else now
        speed = 0.0 if twist is None else twist.linear_x
        return _Peer(feedback.pose, stands, stamp, at, speed)

    def _make_room(self) -> None:
        if len(self._topics) >= _MAX_TOPICS:
            del self._topics[min(self._topics, key=lambda name: self._topics[name].at)]

    def _remember(
        self, topic: _Topic, feedback: Feedback, own: Pose2D | None, now: float
    ) -> None:
        received = _alerts_of(feedback)
        kept = {
            key: one for key, one in topic.alerts.items() if _alive(one, topic, now)
        }
        for key, one in kept.items():
            if key not in received and one.missing_since is None:
                kept[key] = replace(one, missing_since=now)
        for key, alert in received.items():
            myself = self._is_me(alert, topic, own, kept.get(key))
            kept[key] = _Kept(alert, now, None, myself)
        topic.alerts = dict(list(kept.items())[-_MAX_ALERTS:])

    def _is_me(
        self,
        alert: FeedbackAlert,
        topic: _Topic,
        own: Pose2D | None,
        before: _Kept | None,
    ) -> bool:
        # The robot's own detections never show itself.
        if alert.class_ != "robot" or alert.observer == self._me:
            return False
        if alert.class_id == self._me or _limited_free(topic.speed_limit, alert):
            return True
        if alert.position is None or own is None:
            return False
        near = own.distance_to(*alert.position[:2]) <= MYSELF_WITHIN_M
        # The robot moves on; the place where it was seen still belongs to it.
        same_spot = before is not None and before.alert.position == alert.position
        return near or (same_spot and before is not None and before.myself)


def _alive(kept: _Kept, topic: _Topic, now: float) -> bool:
    """Whether an alert still counts: recent, and not superseded on its topic."""
    missing = kept.missing_since
    moved_on = missing is not None and topic.at - missing >= MOVED_ON_S
    return not moved_on and now - kept.at <= LIMITS.ring_lasts_s


def _newer(origin: Origin, topic: _Topic) -> bool:
    """Whether a message counts: of an unknown boot, or with a higher ``seq``."""
    if origin.boot != topic.origin.boot:
        if origin.boot in topic.boots:
            return False
        topic.boots = [*topic.boots, origin.boot][-_MAX_BOOTS:]
        return True
    if origin.seq is None or topic.origin.seq is None:
        return True
    return origin.seq > topic.origin.seq


def _alerts_of(feedback: Feedback) -> dict[_Key, FeedbackAlert]:
    """People and robots of one message; the newest is usually in the list too."""
    alerts = list(feedback.alerts)
    if feedback.alert is not None and feedback.alert not in alerts:
        alerts.append(feedback.alert)
    found: dict[_Key, FeedbackAlert] = {}
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


def _mandated(speed_limit: SpeedLimit) -> Cap:
    factor = quantised(speed_limit.speed_factor)
    if factor == FULL_SPEED:
        return FREE
    reason, decision_id = known_reason(speed_limit.reason), speed_limit.decision_id
    return Cap(factor, reason, speed_limit.cause, decision_id, not speed_limit.over)


def _limited_free(speed_limit: SpeedLimit, alert: FeedbackAlert) -> bool:
    return (
        alert.decision_id != ""
        and speed_limit.decision_id == alert.decision_id
        and speed_limit.speed_factor >= FULL_SPEED
    )


def _ring(alert: FeedbackAlert, silence: float) -> float:
    radius_m = LIMITS.ring_default_m if alert.radius_m is None else alert.radius_m
    return ring_radius(radius_m, silence)


def _inside(
    alert: FeedbackAlert, observer: _Peer | None, own: Pose2D | None, ring: float
) -> bool:
    """Whether ``own`` is inside the radius, about the observer if no place is known."""
    if alert.position is not None:
        place = alert.position[:2]
    elif observer is not None:
        place = (observer.pose.x, observer.pose.y)
    else:
        return True
    return own is None or own.distance_to(*place) <= ring


def _alert_ahead(kept: _Kept, now: float) -> Iterator[Ahead]:
    alert = kept.alert
    if alert.position is not None and alert.velocity is not None:
        (x, y, _), goes = alert.position, alert.velocity
        yield (x, y, *goes, now - kept.at, _ring(alert, 0.0)), _alerted(alert)


def _alerted(alert: FeedbackAlert, *, waits: bool = True) -> Cap:
    reason = known_reason(alert.class_ or "stale")
    return Cap(HALF_SPEED, reason, None, alert.decision_id or None, waits)
