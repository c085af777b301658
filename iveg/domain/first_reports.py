"""Notices: when iVeg was notified of each person; acknowledgement is timed from there.

A robot judges the feedback by its own pose and is often ahead of iVeg: its report that
it slows for an alert comes before iVeg finds it inside the ring.  It is timed all the
same, from the newest frame that robots had received by then::

    frame notified ──> feedback ──> robot slows, reports ──> (iVeg finds it inside)
         └────────────── timed ──────────────┘
"""

from collections import deque
from collections.abc import Container
from dataclasses import dataclass, field
from typing import NamedTuple

from iveg.domain.feedback import HALF_SPEED
from iveg.domain.observations import Instant, SafetyReport
from iveg.domain.rule.crossings import Crossing

FRESH_S = 0.25
"""Without a newer frame a ring was known: a robot that enters it is not timed."""
_KEPT = 16
_UNTIMED = "", 0.0, 0.0


class FirstReport(NamedTuple):
    """The notification that an acknowledgement is timed from.

    Attributes:
        at: Arrival of its notification (monotonic, s).
        answered: When the robot said that it slows (monotonic, s); None where that is
            still to come.
    """

    at: float
    answered: float | None = None


@dataclass(slots=True)
class FirstReports:
    """Notifications by person, and robots that slowed for an alert by themselves."""

    _detections: dict[str, deque[float]] = field(default_factory=dict)
    _ahead: dict[str, tuple[str, float, float]] = field(default_factory=dict)
    """Slow robot → alert, when it first said so, when feedback had gone out before."""

    def seen(self, person_id: str, at: Instant) -> None:
        """Note the notification of a frame that shows this person."""
        frames = self._detections.setdefault(person_id, deque(maxlen=_KEPT))
        frames.append(at.mono)

    def reported(self, report: SafetyReport, published_at: float, at: Instant) -> None:
        """Note a safety report; feedback last went out at ``published_at``."""
        robot_id, alert = report.robot_id, report.decision_id or ""
        if report.speed_factor > HALF_SPEED:
            self._ahead.pop(robot_id, None)
        elif robot_id not in self._ahead:
            self._ahead[robot_id] = alert, at.mono, published_at
        elif self._ahead[robot_id][0] != alert:
            # Slow for something else already: that it names this too times nothing.
            self._ahead[robot_id] = _UNTIMED

    def of(self, crossing: Crossing) -> FirstReport | None:
        """The notice of a crossing; None where there is none."""
        zone = crossing.zone
        if zone.sighting is None:
            return None
        if not crossing.ahead:
            return self._notice(zone.cause, crossing.entered.mono)
        alert, answered, published_at = self._ahead.get(crossing.robot_id, _UNTIMED)
        if alert != zone.alert_id:
            return None
        return self._notice(zone.cause, published_at, answered)

    def _notice(
        self, person_id: str, before: float, answered: float | None = None
    ) -> FirstReport | None:
        frames = [at for at in self._detections.get(person_id, ()) if at <= before]
        now = before if answered is None else answered
        if not frames or now - frames[-1] > FRESH_S:
            return None
        return FirstReport(frames[-1], answered)

    def forget(self, known: Container[str]) -> None:
        """Keep only persons who are still known."""
        for person_id in [one for one in self._detections if one not in known]:
            del self._detections[person_id]
