"""When iVeg was told of each person, so that a robot's answer can be timed from there.

A robot judges what the feedback told it by its own pose and is often ahead of iVeg: its
report that it slows for an alert comes before iVeg finds it inside the ring.  It is
timed all the same, from the newest look that robots had been told of by then::

    look notified ──> feedback ──> robot slows, reports ──> (iVeg finds it inside)
         └───────────── timed ─────────────┘
"""

from collections import deque
from collections.abc import Container
from dataclasses import dataclass, field

from iveg.domain.feedback import HALF_SPEED
from iveg.domain.mandates import Crossing
from iveg.domain.observations import Instant, SafetyReport

FRESH_S = 0.25
"""A ring that nobody has looked at for longer is known: who enters it is not timed."""
_KEPT = 16


@dataclass(frozen=True, slots=True)
class Notice:
    """The look that an answer is timed from.

    Attributes:
        at: Arrival of its notification (monotonic, s).
        answered: When the robot said that it slows (monotonic, s); None where that is
            still to come.
    """

    at: float
    answered: float | None = None


@dataclass(slots=True)
class Notices:
    """Looks by person, and the robots that slowed for an alert by themselves."""

    _looks: dict[str, deque[float]] = field(default_factory=dict)
    _ahead: dict[str, tuple[str, float, float]] = field(default_factory=dict)
    """Robot → alert, when it first said so, when feedback had gone out before."""
    _slow: set[str] = field(default_factory=set)

    def seen(self, person_id: str, at: Instant) -> None:
        """A look that found this person was notified."""
        looks = self._looks.setdefault(person_id, deque(maxlen=_KEPT))
        looks.append(at.mono)

    def reported(self, report: SafetyReport, told_at: float, at: Instant) -> None:
        """A robot said what it applies; feedback last went out at ``told_at``."""
        robot_id, alert = report.robot_id, report.decision_id or ""
        was_slow = robot_id in self._slow
        if report.speed_factor > HALF_SPEED:
            self._slow.discard(robot_id)
            self._ahead.pop(robot_id, None)
            return
        self._slow.add(robot_id)
        if not was_slow:
            self._ahead[robot_id] = alert, at.mono, told_at
        elif robot_id in self._ahead and self._ahead[robot_id][0] != alert:
            # Slow for something else already: that it names this too tells no time.
            del self._ahead[robot_id]

    def of(self, crossing: Crossing) -> Notice | None:
        """What the answer to a crossing is timed from; None where nothing tells."""
        hazard = crossing.hazard
        if hazard.sighting is None:
            return None
        if not crossing.ahead:
            return self._notice(hazard.cause, crossing.entered.mono)
        alert, answered, told_at = self._ahead.get(crossing.robot_id, ("", 0.0, 0.0))
        if alert != hazard.alert_id:
            return None
        return self._notice(hazard.cause, told_at, answered)

    def _notice(
        self, person_id: str, before: float, answered: float | None = None
    ) -> Notice | None:
        looks = [at for at in self._looks.get(person_id, ()) if at <= before]
        now = before if answered is None else answered
        if not looks or now - looks[-1] > FRESH_S:
            return None
        return Notice(looks[-1], answered)

    def forget(self, known: Container[str]) -> None:
        """Keep only those who are still known."""
        for person_id in [one for one in self._looks if one not in known]:
            del self._looks[person_id]
