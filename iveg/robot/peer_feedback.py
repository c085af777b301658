"""Feedback of every peer topic, kept with its age: the robot's view of others.

Algorithm 3 of the paper, judged against the robot's own pose.  It differs in four
ways: a person missing from a message ages out instead of being dropped, a radius grows
while its topic is silent (docs/safety.md), a peer known to stand slows nobody,
and an alert about the robot itself is ignored, or it would slow down for ever.
"""

from collections.abc import Iterator
from dataclasses import replace

from iveg.domain.feedback import (
    FULL_SPEED,
    UNSUPERVISED,
    Feedback,
    FeedbackAlert,
    SpeedLimit,
)
from iveg.domain.geometry import Pose2D
from iveg.domain.limits import LIMITS
from iveg.robot.caps import FREE, Cap, known_reason, quantised
from iveg.robot.lookahead import Ahead
from iveg.robot.peer_alerts import (
    KeptAlert,
    PeerObserver,
    PeerTopic,
    alert_ahead,
    alerted,
    alerts_of,
    is_alive,
    is_inside,
    is_newer,
    limited_free,
    ring_of,
)

MYSELF_WITHIN_M = 1.0
_MAX_TOPICS, _MAX_ALERTS = 64, 512


class PeerFeedback:
    """All feedback that one robot received.

    Args:
        robot_id: Whose speed limits count.
    """

    def __init__(self, robot_id: str) -> None:
        self._me = robot_id
        self._topics: dict[str, PeerTopic] = {}

    def apply(
        self, topic: str, feedback: Feedback, own: Pose2D | None, now: float
    ) -> bool:
        """Apply a message of ``topic``; messages older than the newest are dropped.

        Returns:
            Whether it was accepted.
        """
        memory = self._topics.get(topic)
        if memory is None:
            memory = PeerTopic(feedback.origin, now, [feedback.origin.boot])
            self._make_room()
            self._topics[topic] = memory
        elif not is_newer(feedback.origin, memory):
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
                if kept.myself or not is_alive(kept, topic, now):
                    continue
                ring = ring_of(kept.alert, silence) + beyond
                if is_inside(kept.alert, topic.peer, own, ring):
                    # One that is missing has been kept for its second already.
                    yield alerted(kept.alert, waits=kept.missing_since is None)
            if topic.peer is not None and own is not None:
                yield topic.peer.cap(name, own, beyond, now)

    def ahead(self, now: float) -> Iterator[Ahead]:
        """Circles whose motion is known, where the rule looks ahead."""
        for name, topic in self._topics.items():
            if not topic.foresight or now - topic.at > LIMITS.silence_s:
                continue
            for kept in topic.alerts.values():
                if not kept.myself and kept.missing_since is None:
                    yield from alert_ahead(kept, now)
            peer = topic.peer
            if peer is not None and not peer.stands:
                yield from peer.ahead(name, now)

    def _peer(
        self, before: PeerObserver | None, feedback: Feedback, now: float
    ) -> PeerObserver | None:
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
        return PeerObserver(feedback.pose, stands, stamp, at, speed)

    def _make_room(self) -> None:
        if len(self._topics) >= _MAX_TOPICS:
            del self._topics[min(self._topics, key=lambda name: self._topics[name].at)]

    def _remember(
        self, topic: PeerTopic, feedback: Feedback, own: Pose2D | None, now: float
    ) -> None:
        received = alerts_of(feedback)
        kept = {
            key: one for key, one in topic.alerts.items() if is_alive(one, topic, now)
        }
        for key, one in kept.items():
            if key not in received and one.missing_since is None:
                kept[key] = replace(one, missing_since=now)
        for key, alert in received.items():
            myself = self._is_me(alert, topic, own, kept.get(key))
            kept[key] = KeptAlert(alert, now, None, myself)
        topic.alerts = dict(list(kept.items())[-_MAX_ALERTS:])

    def _is_me(
        self,
        alert: FeedbackAlert,
        topic: PeerTopic,
        own: Pose2D | None,
        before: KeptAlert | None,
    ) -> bool:
        # The robot's own detections never show itself.
        if alert.class_ != "robot" or alert.observer == self._me:
            return False
        if alert.class_id == self._me or limited_free(topic.speed_limit, alert):
            return True
        if alert.position is None or own is None:
            return False
        near = own.distance_to(*alert.position[:2]) <= MYSELF_WITHIN_M
        # The robot moves on; the place where it was seen still belongs to it.
        same_spot = before is not None and before.alert.position == alert.position
        return near or (same_spot and before is not None and before.myself)


def _mandated(speed_limit: SpeedLimit) -> Cap:
    factor = quantised(speed_limit.speed_factor)
    if factor == FULL_SPEED:
        return FREE
    reason, decision_id = known_reason(speed_limit.reason), speed_limit.decision_id
    return Cap(factor, reason, speed_limit.cause, decision_id, not speed_limit.over)
