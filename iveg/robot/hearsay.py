"""What a robot knows from others: feedback of every peer topic, kept and aged.

Algorithm 3 of the paper, judged against the robot's own pose.  It differs in three
ways: a person who is missing from a message ages out instead of vanishing, a ring grows
while its topic is silent (safety.md §3.4), and an alert about the robot itself is
ignored, or it would slow for ever.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from iveg.domain.feedback import CLEAR, HALF_SPEED, Feedback, FeedbackAlert, Mandate
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import Origin
from iveg.robot.caps import RELEASE_BEYOND_M, Cap, known_reason, quantised

RING_M = 2.0
KEPT_S = 10.0
MOVED_ON_S = 1.0
MYSELF_WITHIN_M = 1.0
WALK_M_S, FRESH_S, WIDEST_RING_M = 1.6, 0.32, 6.0
_MAX_TOPICS, _MAX_ALERTS, _MAX_BOOTS = 64, 512, 32

_Key = tuple[str, str | None, str | None, tuple[float, float, float] | None]


@dataclass(frozen=True, slots=True)
class _Kept:
    """One alert as last told.

    Attributes:
        missing_since: First message of the topic that was without it; None: present.
        myself: It describes this robot.
    """

    alert: FeedbackAlert
    at: float
    missing_since: float | None = None
    myself: bool = False


@dataclass(slots=True)
class _Topic:
    """What one topic said last; ``boots`` are all it ever had, newest last."""

    origin: Origin
    at: float
    boots: list[str | None]
    pose: Pose2D | None = None
    mandate: Mandate = CLEAR
    alerts: dict[_Key, _Kept] = field(default_factory=dict)


class Hearsay:
    """Everything that feedback told one robot.

    Args:
        robot_id: Whose mandates count.
    """

    def __init__(self, robot_id: str) -> None:
        self._me = robot_id
        self._topics: dict[str, _Topic] = {}

    def take(
        self, topic: str, feedback: Feedback, own: Pose2D | None, now: float
    ) -> bool:
        """Take a message of ``topic``; older ones than it already gave are dropped.

        Returns:
            Whether it counted.
        """
        memory = self._topics.get(topic)
        if memory is None:
            memory = _Topic(feedback.origin, now, [feedback.origin.boot])
            self._make_room()
            self._topics[topic] = memory
        elif not _newer(feedback.origin, memory):
            return False
        memory.origin, memory.at = feedback.origin, now
        memory.pose = None if feedback.robot_id == self._me else feedback.pose
        memory.mandate = feedback.mandates.get(self._me, CLEAR)
        self._remember(memory, feedback, own, now)
        return True

    def caps(self, own: Pose2D | None, slowed: bool, now: float) -> Iterator[Cap]:
        """Everything that asks this robot to be slow, at pose ``own`` in ``map``.

        Args:
            own: None while the robot does not know where it is.
            slowed: The robot is slow for a person or peer: rings let go later.
            now: Monotonic (s).
        """
        beyond = RELEASE_BEYOND_M if slowed else 0.0
        for name, topic in self._topics.items():
            silence = now - topic.at
            if silence > KEPT_S:
                continue
            yield _mandated(topic.mandate)
            growth = WALK_M_S * max(0.0, silence - FRESH_S)
            for kept in self._alive(topic, now):
                ring = _ring(kept.alert, growth) + beyond
                if not kept.myself and _inside(kept.alert, topic.pose, own, ring):
                    yield _alerted(kept.alert)
            if topic.pose is not None and own is not None:
                ring = min(WIDEST_RING_M, RING_M + growth) + beyond
                if own.distance_to(topic.pose.x, topic.pose.y) <= ring:
                    yield Cap(HALF_SPEED, "robot", name)

    def _make_room(self) -> None:
        if len(self._topics) >= _MAX_TOPICS:
            del self._topics[min(self._topics, key=lambda name: self._topics[name].at)]

    def _remember(
        self, topic: _Topic, feedback: Feedback, own: Pose2D | None, now: float
    ) -> None:
        told = {
            _key(alert): alert
            for alert in (*feedback.alerts, feedback.alert)
            if alert is not None and alert.class_ is not None
        }
        kept = {_key(one.alert): one for one in self._alive(topic, now)}
        for key, one in kept.items():
            if key not in told and one.missing_since is None:
                kept[key] = replace(one, missing_since=now)
        for key, alert in told.items():
            myself = self._is_me(alert, topic, own, kept.get(key))
            kept[key] = _Kept(alert, now, None, myself)
        topic.alerts = dict(list(kept.items())[-_MAX_ALERTS:])

    def _alive(self, topic: _Topic, now: float) -> Iterator[_Kept]:
        for kept in topic.alerts.values():
            missing = kept.missing_since
            moved_on = missing is not None and topic.at - missing >= MOVED_ON_S
            if not moved_on and now - kept.at <= KEPT_S:
                yield kept

    def _is_me(
        self,
        alert: FeedbackAlert,
        topic: _Topic,
        own: Pose2D | None,
        before: _Kept | None,
    ) -> bool:
        # What I see myself is never me.
        if alert.class_ != "robot" or alert.observer == self._me:
            return False
        if alert.class_id == self._me or _mandated_free(topic.mandate, alert):
            return True
        if alert.position is None or own is None:
            return False
        near = own.distance_to(*alert.position[:2]) <= MYSELF_WITHIN_M
        # I drive on; the spot where I was seen stays behind and is still about me.
        same_spot = before is not None and before.alert.position == alert.position
        return near or (same_spot and before is not None and before.myself)


def _newer(origin: Origin, topic: _Topic) -> bool:
    """Whether a message counts: a boot not met before, or further in the count."""
    if origin.boot != topic.origin.boot:
        if origin.boot in topic.boots:
            return False
        topic.boots = [*topic.boots, origin.boot][-_MAX_BOOTS:]
        return True
    if origin.seq is None or topic.origin.seq is None:
        return True
    return origin.seq > topic.origin.seq


def _key(alert: FeedbackAlert) -> _Key:
    place = None if alert.decision_id else alert.position
    return alert.decision_id, alert.observer, alert.class_, place


def _mandated(mandate: Mandate) -> Cap:
    factor = quantised(mandate.speed_factor)
    reason = "clear" if factor == 1.0 else known_reason(mandate.reason)
    return Cap(factor, reason, mandate.cause, mandate.decision_id)


def _mandated_free(mandate: Mandate, alert: FeedbackAlert) -> bool:
    return (
        alert.decision_id != ""
        and mandate.decision_id == alert.decision_id
        and mandate.speed_factor >= 1.0
    )


def _ring(alert: FeedbackAlert, growth: float) -> float:
    told = RING_M if alert.radius_m is None else alert.radius_m
    return max(told, min(WIDEST_RING_M, told + growth))


def _inside(
    alert: FeedbackAlert, observer: Pose2D | None, own: Pose2D | None, ring: float
) -> bool:
    """Whether I am in the ring; somebody of unknown place is where the observer is."""
    if alert.position is not None:
        place = alert.position[:2]
    elif observer is not None:
        place = (observer.x, observer.y)
    else:
        return True
    return own is None or own.distance_to(*place) <= ring


def _alerted(alert: FeedbackAlert) -> Cap:
    reason = known_reason(alert.class_ or "stale")
    return Cap(HALF_SPEED, reason, None, alert.decision_id or None)
