"""The decision record: from the detection to the observed slow-down, link by link.

A ``SlowdownDecision`` opens when a robot enters a ring and closes when it is let go.
Every link has a time and a verdict; a link that does not come in time raises an alert
(docs/dashboard.md, "Decisions")::

    detection ─> filter ─> geometry ─> rule ─> feedback ─> applied ─> observed

A link is ``open`` while it may still come and never for longer: it comes, is missing,
or iVeg itself is interrupted and its end is ``unknown``.
"""

from collections.abc import Callable, Container, Iterable
from dataclasses import dataclass, replace
from typing import Literal

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import HALF_SPEED
from iveg.domain.first_reports import FirstReports
from iveg.domain.observations import Instant, Odometry, SafetyReport
from iveg.domain.rule.crossings import Crossing

LinkVerdict = Literal["ok", "late", "missing", "n/a", "open", "unknown"]
LinkName = Literal[
    "detection",
    "filter",
    "geometry",
    "rule",
    "feedback",
    "applied",
    "observed",
    "interrupted",
]

OBSERVED_SHARE = 0.55
"""The slow-down counts when the speed is at most this share of what it was."""
JUDGED_ABOVE = 0.2
"""Slower than this (m/s) there is no slow-down to observe."""
LATE_S, MISSING_S = 1.0, 2.0


@dataclass(frozen=True, slots=True)
class Link:
    """One step of the chain: when, what, and whether it held."""

    name: LinkName
    verdict: LinkVerdict
    at: float | None = None
    value: str | float | None = None


@dataclass(frozen=True, slots=True)
class Place:
    """Where a robot was when a decision began, in ``map`` (m, rad)."""

    robot_id: str
    x: float
    y: float
    yaw: float


@dataclass(frozen=True, slots=True)
class SlowdownDecision:
    """Why one robot was slowed once.

    Attributes:
        feedback: When the speed limit was first published; ``applied`` when the robot
            said so; ``observed`` when its odometry showed it.
        speed_after: Speed at ``observed`` (m/s).
        waited_out: Whether every link has come or is missing.
        interrupted: iVeg went away while it was open; ``ended`` is when that was.
        noticed: Arrival of the look that it rests on (monotonic, s); None for a ring
            that was known before.
        answered: When a robot that was ahead said that it slows (monotonic, s).
        places: Where the robot that is slowed and the observer were.
    """

    crossing: Crossing
    rule: DetectionRule
    feedback: Instant | None = None
    applied: Instant | None = None
    observed: Instant | None = None
    ended: Instant | None = None
    speed_after: float | None = None
    waited_out: bool = False
    interrupted: bool = False
    noticed: float | None = None
    answered: float | None = None
    places: tuple[Place, ...] = ()

    @property
    def answered_at(self) -> float | None:
        """When the robot said that it slows for it (monotonic, s); None: never."""
        if self.answered is not None:
            return self.answered
        if self.applied is None or self.crossing.ahead:
            return None
        return self.applied.mono

    @property
    def took_s(self) -> float | None:
        """From the frame to the robot's own report (s); None where one is missing."""
        answered_at = self.answered_at
        if answered_at is None or self.noticed is None:
            return None
        return answered_at - self.noticed

    @property
    def decision_id(self) -> str:
        """Names the decision everywhere: feedback, log, record."""
        return self.crossing.decision_id

    @property
    def judged(self) -> bool:
        """Whether the robot drove fast and evenly enough for a slow-down to be seen."""
        crossing = self.crossing
        hidden = crossing.already_slow or crossing.speeding_up
        return crossing.speed_before > JUDGED_ABOVE and not hidden

    def published(self, at: Instant) -> "SlowdownDecision":
        """The speed limit was published."""
        return self if self.feedback is not None else replace(self, feedback=at)

    def reported(self, report: SafetyReport, at: Instant) -> "SlowdownDecision":
        """The robot said what it applies."""
        obeys = report.speed_factor <= HALF_SPEED
        if self.applied is not None or not obeys or self.ended is not None:
            return self
        return replace(self, applied=at)

    def moved(self, speed: float, at: Instant) -> "SlowdownDecision":
        """Odometry came in with this speed (m/s)."""
        limit = OBSERVED_SHARE * self.crossing.speed_before
        if self.observed is not None or not self.judged or abs(speed) > limit:
            return self
        return replace(self, observed=at, speed_after=abs(speed))

    def closed(self, at: Instant) -> "SlowdownDecision":
        """The robot was let go."""
        return replace(self, ended=at)

    def aged(self, heard_s: float) -> "SlowdownDecision":
        """Let time pass; a link that did not come is missing from now on.

        Args:
            heard_s: How long the robot has been heard since it began, without a silence
                (s): what nobody could hear is not judged.
        """
        if self.waited_out or heard_s < MISSING_S:
            return self
        return replace(self, waited_out=True)

    def broken_off(self, at: Instant) -> "SlowdownDecision":
        """Close the decision unfinished: iVeg stops, and its end stays unknown."""
        return replace(self, ended=at, interrupted=True)

    @property
    def is_overdue(self) -> bool:
        """Whether the slow-down should have been seen by now and was not."""
        if self.ended is not None or not self.waited_out:
            return False
        return self.applied is None or (self.judged and self.observed is None)

    def links(self) -> tuple[Link, ...]:
        """The chain as it stands."""
        crossing, rule = self.crossing, self.rule
        sighting = crossing.zone.sighting
        entered = crossing.entered.wall
        seen = (
            _unseen(crossing)
            if sighting is None
            else Link("detection", "ok", sighting.at.wall, sighting.class_id)
        )
        passed = (
            Link("filter", "n/a")
            if sighting is None or sighting.laser
            else Link("filter", "ok", sighting.at.wall, sighting.confidence)
        )
        return (
            seen,
            passed,
            Link("geometry", "ok", entered, crossing.entered_m),
            Link("rule", "ok", entered, f"{rule.id} {rule.version}"),
            self._step("feedback", self.feedback, None),
            self._step("applied", self.applied, HALF_SPEED),
            self._step("observed", self.observed, self.speed_after)
            if self.judged
            else Link("observed", "n/a", None, crossing.speed_before),
            *self._interruption(),
        )

    def _interruption(self) -> Iterable[Link]:
        if self.interrupted and self.ended is not None:
            yield Link("interrupted", "unknown", self.ended.wall)

    def _step(self, name: LinkName, at: Instant | None, value: float | None) -> Link:
        start = self.crossing.entered.mono
        if at is not None:
            took = at.mono - start
            return Link(name, "ok" if took <= LATE_S else "late", at.wall, value)
        if self.waited_out:
            return Link(name, "missing")
        if self.ended is None:
            return Link(name, "open")
        return Link(name, "unknown" if self.interrupted else "missing")


def _unseen(crossing: Crossing) -> Link:
    """The first link of whom no camera saw: a laser, or a peer's own word."""
    if crossing.zone.obstacle is None:
        return Link("detection", "n/a", None, "odometry")
    return Link("detection", "ok", crossing.entered.wall, "laser")


class Decisions:
    """Open decisions, and the last few that ended.

    What happens to the fleet is a method, which returns the decisions that it changed.
    """

    def __init__(self, keep: int = 200) -> None:
        self._keep = keep
        self._all: dict[str, SlowdownDecision] = {}
        self._first_reports = FirstReports()

    def get(self, decision_id: str) -> SlowdownDecision | None:
        """One decision that is still in memory."""
        return self._all.get(decision_id)

    @property
    def known(self) -> Iterable[SlowdownDecision]:
        """All that are in memory: the open ones and the newest that ended."""
        return self._all.values()

    @property
    def open(self) -> list[SlowdownDecision]:
        """All open decisions."""
        return [one for one in self._all.values() if one.ended is None]

    def begin(
        self, crossing: Crossing, rule: DetectionRule, places: Iterable[Place] = ()
    ) -> SlowdownDecision:
        """Open the decision of a crossing; the oldest ended ones make room."""
        notice = self._first_reports.of(crossing)
        noticed, answered = (None, None) if notice is None else notice
        decision = SlowdownDecision(
            crossing,
            rule,
            noticed=noticed,
            answered=answered,
            places=tuple(places),
        )
        self._all[decision.decision_id] = decision
        if len(self._all) > self._keep:
            ended = (key for key, one in self._all.items() if one.ended is not None)
            self._all.pop(next(ended, ""), None)
        return decision

    def end(self, decision_id: str, at: Instant) -> list[SlowdownDecision]:
        """A robot was let go."""
        one = self._all.get(decision_id)
        return [] if one is None else self._change([one], lambda one: one.closed(at))

    def seen(self, people: Iterable[str], at: Instant) -> None:
        """A frame that shows these people was notified."""
        for person_id in people:
            self._first_reports.seen(person_id, at)

    def moved(self, odometry: Odometry, at: Instant) -> list[SlowdownDecision]:
        """A robot drives."""
        speed = odometry.twist.linear_x
        return self._change(
            self._open_of(odometry.robot_id), lambda one: one.moved(speed, at)
        )

    def reported(
        self, report: SafetyReport, published_at: float, at: Instant
    ) -> list[SlowdownDecision]:
        """A robot says what it applies; feedback last went out at ``published_at``."""
        self._first_reports.reported(report, published_at, at)
        return self._change(
            self._open_of(report.robot_id), lambda one: one.reported(report, at)
        )

    def published(self, at: Instant) -> list[SlowdownDecision]:
        """Feedback was published."""
        return self._change(self.open, lambda one: one.published(at))

    def age(
        self, heard_s: Callable[[Crossing], float], known: Container[str]
    ) -> list[SlowdownDecision]:
        """Time passes; notices of persons who are no longer known are forgotten.

        ``heard_s``: how long a crossing's robot has been heard since it began (s).
        """
        self._first_reports.forget(known)
        return self._change(self.open, lambda one: one.aged(heard_s(one.crossing)))

    def break_off(self, at: Instant) -> list[SlowdownDecision]:
        """End every open one: iVeg stops."""
        return self._change(self.open, lambda one: one.broken_off(at))

    def _open_of(self, robot_id: str) -> list[SlowdownDecision]:
        return [one for one in self.open if one.crossing.robot_id == robot_id]

    def _change(
        self,
        some: Iterable[SlowdownDecision],
        step: Callable[[SlowdownDecision], SlowdownDecision],
    ) -> list[SlowdownDecision]:
        changed = [after for one in some if (after := step(one)) is not one]
        self._all.update({one.decision_id: one for one in changed})
        return changed
