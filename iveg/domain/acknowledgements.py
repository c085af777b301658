"""Acknowledgement latency: how soon the fleet obeys its speed limits (docs/safety.md).

The time runs from the notification of the detection frame that a slow-down rests on to
the robot's own report that it applies the factor.  Both are read on the server's clock,
so no other clock has to be believed.  The way from camera to iVeg is left out: only the
robot's clock could tell it.

A robot judges the feedback by its own pose, and may report a slow-down before iVeg
finds the robot inside the ring.  It is then timed from the newest frame that the fleet
had received by then.  A robot that drives into a ring of which no frame is recent
counts as asked and acknowledged, but its time says nothing of the way.  A robot that
was slow for another reason is not asked.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from iveg.domain.decisions import SlowdownDecision
from iveg.domain.observations import Instant
from iveg.domain.ranks import nearest_rank

WINDOW_S = 300.0
ECHO_S = 1.0
"""A robot that has not answered by then has not echoed."""


@dataclass(frozen=True, slots=True)
class Acknowledgements:
    """The alerts of the last minutes, as robots acknowledged them.

    Attributes:
        timed: How many answers could be timed.
        p50_s: That half of them did not exceed (s); ``p95_s``, ``p99_s`` likewise.
        echo_age_s: Of the newest timed answer (s).
        asked: How many alerts should have been answered by now.
        missed: How many of those were not, within ``ECHO_S``.
        asked_age_s: Since the newest of those (s).
    """

    timed: int = 0
    p50_s: float | None = None
    p95_s: float | None = None
    p99_s: float | None = None
    echo_age_s: float | None = None
    asked: int = 0
    missed: int = 0
    asked_age_s: float | None = None


def acknowledgements_of(
    decisions: Iterable[SlowdownDecision], now: Instant
) -> Acknowledgements:
    """Acknowledgement latencies of the decisions in memory, last five minutes."""
    recent = [one for one in decisions if _counts(one, now)]
    due = [one for one in recent if _is_due(one, now)]
    timed = [one for one in recent if one.took_s is not None]
    took = sorted(one.took_s for one in timed if one.took_s is not None)
    return Acknowledgements(
        timed=len(took),
        p50_s=nearest_rank(took, 0.50),
        p95_s=nearest_rank(took, 0.95),
        p99_s=nearest_rank(took, 0.99),
        echo_age_s=_age((one.answered_at for one in timed), now),
        asked=len(due),
        missed=sum(not _is_acknowledged(one) for one in due),
        asked_age_s=_age((one.crossing.entered.mono for one in due), now),
    )


def _counts(decision: SlowdownDecision, now: Instant) -> bool:
    crossing = decision.crossing
    # Who was ahead and has braked by now was not slow for something else.
    asked = decision.answered is not None or not crossing.already_slow
    return asked and now.mono - crossing.entered.mono <= WINDOW_S


def _is_due(decision: SlowdownDecision, now: Instant) -> bool:
    """Whether the time to acknowledge is over."""
    waited = now.mono - decision.crossing.entered.mono
    return waited > ECHO_S or _is_acknowledged(decision)


def _is_acknowledged(decision: SlowdownDecision) -> bool:
    applied, crossing = decision.applied, decision.crossing
    return crossing.ahead or (
        applied is not None and applied.mono - crossing.entered.mono <= ECHO_S
    )


def _age(moments: Iterable[float | None], now: Instant) -> float | None:
    newest = max((at for at in moments if at is not None), default=None)
    return None if newest is None else now.mono - newest
