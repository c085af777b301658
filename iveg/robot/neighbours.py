"""People and robots nearby, as reported by peers."""

from collections.abc import Iterator
from dataclasses import dataclass

from iveg.domain.feedback import Feedback
from iveg.domain.geometry import Pose2D
from iveg.domain.limits import LIMITS

SILENT_S = LIMITS.feedback_stand_s
"""Age from which feedback gives no positions (s)."""
PERSON_M, PEER_M = 0.35, 0.75
_MYSELF_M = 1.0
_MOST = 256


@dataclass(frozen=True, slots=True)
class Neighbour:
    """A person or robot in ``map`` (m).

    Attributes:
        kind: ``person`` or ``robot``.
        radius: Radius of the body (m).
        ring: Radius of the rule (m).
    """

    kind: str
    name: str
    x: float
    y: float
    radius: float
    ring: float


@dataclass(frozen=True, slots=True)
class _Heard:
    """Newest feedback of a topic.

    Attributes:
        at: When it came (monotonic, s).
        posed: When its pose was news: a peer that is gone keeps the stamp of its last.
    """

    feedback: Feedback
    at: float
    posed: float


class Neighbours:
    """Newest feedback of each topic; times are monotonic seconds.

    Args:
        robot_id: This robot, which is left out.
    """

    def __init__(self, robot_id: str) -> None:
        self._me = robot_id
        self._heard: dict[str, _Heard] = {}

    def note(self, peer: str, feedback: Feedback, now: float) -> None:
        """Store the content of ``/{peer}/mqtt_feedback``."""
        before, stamp = self._heard.get(peer), feedback.pose_stamp
        is_old = before is not None and stamp and before.feedback.pose_stamp == stamp
        posed = before.posed if before is not None and is_old else now
        self._heard[peer] = _Heard(feedback, now, posed)
        while len(self._heard) > _MOST:
            del self._heard[next(iter(self._heard))]

    def present(self, own: Pose2D | None, now: float) -> list[Neighbour]:
        """All but this robot; one reported on two topics is listed once.

        A peer whose pose stays the same message for ``ring_lasts_s`` is left out:
        nobody knows any more where it is, or that it is there at all.
        """
        live = [one for one in self._heard.values() if now - one.at <= SILENT_S]
        found: dict[object, Neighbour] = {}
        for heard in live:
            feedback = heard.feedback
            for one in self._people(feedback, own):
                found[one.kind, round(one.x, 1), round(one.y, 1)] = one
            peer = feedback.pose if now - heard.posed <= LIMITS.ring_lasts_s else None
            if feedback.robot_id != self._me and peer is not None:
                name = feedback.robot_id
                found[name] = Neighbour("robot", name, peer.x, peer.y, PEER_M, 2.0)
        return list(found.values())[:_MOST]

    def _people(self, feedback: Feedback, own: Pose2D | None) -> Iterator[Neighbour]:
        for alert in feedback.alerts:
            if alert.position is None or alert.class_ is None:
                continue
            x, y, _ = alert.position
            near = own is not None and own.distance_to(x, y) <= _MYSELF_M
            if alert.class_ == "robot" and (alert.class_id == self._me or near):
                continue
            radius = PERSON_M if alert.class_ == "person" else PEER_M
            name = alert.class_id or alert.class_
            ring = alert.radius_m or LIMITS.ring_default_m
            yield Neighbour(alert.class_, name, x, y, radius, ring)
