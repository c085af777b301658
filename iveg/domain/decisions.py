"""The decision record: from the detection to the observed slow-down, link by link.

A ``SlowdownDecision`` opens when a robot enters a zone and closes when it is let go.
Every link has a time and a verdict; a link that does not come in time raises an alert
(docs/dashboard.md, "Decisions")::

    detection ─> filter ─> geometry ─> rule ─> feedback ─> applied ─> observed

A link is ``open`` while it may still come and never for longer: it comes, is missing,
or iVeg itself is interrupted and its end is ``unknown``.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Literal

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import HALF_SPEED
from iveg.domain.observations import Instant, SafetyReport
from iveg.domain.rule.zones import ZoneEntry

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
            said so; ``observed`` when its motion showed it.
        speed_after: Speed at ``observed`` (m/s).
        waited_out: Whether every link has come or is missing.
        interrupted: iVeg went away while it was open; ``ended`` is when that was.
        places: Where the robot that is slowed and the observer were.
    """

    entry: ZoneEntry
    rule: DetectionRule
    feedback: Instant | None = None
    applied: Instant | None = None
    observed: Instant | None = None
    ended: Instant | None = None
    speed_after: float | None = None
    waited_out: bool = False
    interrupted: bool = False
    places: tuple[Place, ...] = ()

    @property
    def decision_id(self) -> str:
        """Names the decision everywhere: feedback, log, record."""
        return self.entry.decision_id

    def published(self, at: Instant) -> "SlowdownDecision":
        """The speed limit was published."""
        return self if self.feedback is not None else replace(self, feedback=at)

    def reported(self, report: SafetyReport, at: Instant) -> "SlowdownDecision":
        """The robot said what it applies."""
        if self.applied is not None or report.speed_factor > HALF_SPEED:
            return self
        return replace(self, applied=at)

    def slowed(self, speed: float, at: Instant) -> "SlowdownDecision":
        """The robot was measured to be slow, at this speed (m/s)."""
        if self.observed is not None:
            return self
        return replace(self, observed=at, speed_after=speed)

    def closed(self, at: Instant, *, interrupted: bool = False) -> "SlowdownDecision":
        """The robot was let go, or iVeg stops and the end stays unknown."""
        return replace(self, ended=at, interrupted=interrupted)

    def aged(self, heard_s: float) -> "SlowdownDecision":
        """Let time pass; a link that did not come is missing from now on.

        Args:
            heard_s: How long the robot has been heard since it began, without a silence
                (s): what nobody could hear is not judged.
        """
        if self.waited_out or heard_s < MISSING_S:
            return self
        return replace(self, waited_out=True)

    def links(self) -> tuple[Link, ...]:
        """The chain as it stands."""
        entry, rule = self.entry, self.rule
        sighting = entry.zone.sighting
        entered = entry.entered.wall
        seen = (
            Link("detection", "n/a", None, "odometry")
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
            Link("geometry", "ok", entered, entry.entered_m),
            Link("rule", "ok", entered, f"{rule.id} {rule.version}"),
            self._step("feedback", self.feedback, None),
            self._step("applied", self.applied, HALF_SPEED),
            self._step("observed", self.observed, self.speed_after),
            *self._interruption(),
        )

    def _interruption(self) -> Iterable[Link]:
        if self.interrupted and self.ended is not None:
            yield Link("interrupted", "unknown", self.ended.wall)

    def _step(self, name: LinkName, at: Instant | None, value: float | None) -> Link:
        start = self.entry.entered.mono
        if at is not None:
            took = at.mono - start
            return Link(name, "ok" if took <= LATE_S else "late", at.wall, value)
        if self.waited_out:
            return Link(name, "missing")
        if self.ended is None:
            return Link(name, "open")
        return Link(name, "unknown" if self.interrupted else "missing")


class Decisions:
    """Open decisions, and the last few that ended.

    What happens to the fleet is a method, which returns the decisions that it changed.
    """

    def __init__(self, keep: int = 200) -> None:
        self._keep = keep
        self._all: dict[str, SlowdownDecision] = {}

    def get(self, decision_id: str) -> SlowdownDecision | None:
        """One decision that is still in memory."""
        return self._all.get(decision_id)

    @property
    def open(self) -> list[SlowdownDecision]:
        """All open decisions."""
        return [decision for decision in self._all.values() if decision.ended is None]

    def begin(
        self, entry: ZoneEntry, rule: DetectionRule, places: Iterable[Place] = ()
    ) -> SlowdownDecision:
        """Open the decision of an entry; the oldest ended ones make room."""
        decision = SlowdownDecision(entry, rule, places=tuple(places))
        self._all[decision.decision_id] = decision
        if len(self._all) > self._keep:
            ended = (
                key for key, decision in self._all.items() if decision.ended is not None
            )
            self._all.pop(next(ended, ""), None)
        return decision

    def end(self, decision_id: str, at: Instant) -> list[SlowdownDecision]:
        """A robot was let go."""
        decision = self._all.get(decision_id)
        return (
            []
            if decision is None
            else self._change([decision], lambda decision: decision.closed(at))
        )

    def moved(
        self, robot_id: str, speed: float, at: Instant, *, is_slow: bool
    ) -> list[SlowdownDecision]:
        """A robot drives, at this measured speed (m/s)."""
        some = self._open_of(robot_id) if is_slow else ()
        return self._change(some, lambda decision: decision.slowed(speed, at))

    def reported(self, report: SafetyReport, at: Instant) -> list[SlowdownDecision]:
        """A robot says what it applies."""
        some = self._open_of(report.robot_id)
        return self._change(some, lambda decision: decision.reported(report, at))

    def published(self, at: Instant) -> list[SlowdownDecision]:
        """Feedback was published."""
        return self._change(self.open, lambda decision: decision.published(at))

    def age(self, heard_s: Callable[[ZoneEntry], float]) -> list[SlowdownDecision]:
        """Time passes.

        ``heard_s``: how long an entry's robot has been heard since it began (s).
        """
        return self._change(
            self.open, lambda decision: decision.aged(heard_s(decision.entry))
        )

    def break_off(self, at: Instant) -> list[SlowdownDecision]:
        """End every open one: iVeg stops."""
        return self._change(
            self.open, lambda decision: decision.closed(at, interrupted=True)
        )

    def _open_of(self, robot_id: str) -> list[SlowdownDecision]:
        return [
            decision for decision in self.open if decision.entry.robot_id == robot_id
        ]

    def _change(
        self,
        some: Iterable[SlowdownDecision],
        step: Callable[[SlowdownDecision], SlowdownDecision],
    ) -> list[SlowdownDecision]:
        changed = [
            after for decision in some if (after := step(decision)) is not decision
        ]
        self._all.update({decision.decision_id: decision for decision in changed})
        return changed
