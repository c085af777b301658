"""Decisions: each slow-down of a robot, from the detection to its motion, by links.

A ``SlowdownDecision`` opens when a robot enters a zone and closes when the robot is
released from the limit.  Every link has a time and a verdict (docs/dashboard.md,
"Decisions")::

    detection ─> filter ─> geometry ─> rule ─> feedback ─> applied ─> observed

A link is ``open`` while it may still come.  Then it has come, is ``missing``, or is
``unknown`` because iVeg itself was interrupted.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any, Literal

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
"""Time after the entry from which a link is late, or is waited for no more (s)."""


@dataclass(frozen=True, slots=True)
class Link:
    """One step of the chain: verdict, time (Unix s) and value."""

    name: LinkName
    verdict: LinkVerdict
    at: float | None = None
    value: str | float | None = None


@dataclass(frozen=True, slots=True)
class Place:
    """Pose of a robot at the start of a decision, in ``map`` (m, rad)."""

    robot_id: str
    x: float
    y: float
    yaw: float


@dataclass(frozen=True, slots=True)
class SlowdownDecision:
    """One slow-down of one robot, with its cause and effects.

    Attributes:
        feedback: First publication of the speed limit.
        applied: First report of the robot that it applies the limit.
        observed: First slow motion of the robot.
        ended: Release from the limit, or the end of iVeg.
        speed_after: Speed at ``observed`` (m/s).
        waited_out: Whether links that have not come are missing.
        interrupted: Whether iVeg ended while the decision was open.
        places: Poses of the slowed robot and the observer at its start.
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
        """Id of the decision in feedback, log and record."""
        return self.entry.decision_id

    def links(self) -> tuple[Link, ...]:
        """All links, as known now."""
        entry, rule = self.entry, self.rule
        sighting = entry.zone.sighting
        entered = entry.entered.wall
        # A zone without a sighting is that of a peer, which its own odometry places.
        detection = (
            Link("detection", "n/a", None, "odometry")
            if sighting is None
            else Link("detection", "ok", sighting.at.wall, sighting.class_id)
        )
        # The filter judges confidence, which a laser track lacks.
        passed = (
            Link("filter", "n/a")
            if sighting is None or sighting.laser
            else Link("filter", "ok", sighting.at.wall, sighting.confidence)
        )
        return (
            detection,
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
        if at is not None:
            took = at.mono - self.entry.entered.mono
            return Link(name, "ok" if took <= LATE_S else "late", at.wall, value)
        if self.waited_out:
            return Link(name, "missing")
        if self.ended is None:
            return Link(name, "open")
        return Link(name, "unknown" if self.interrupted else "missing")


class Decisions:
    """Open decisions, and the newest ended ones.

    Each event of the fleet is a method, which returns the decisions that it changed.

    Args:
        keep: Number of decisions beyond which an ended one is forgotten.
    """

    def __init__(self, keep: int = 200) -> None:
        self._keep = keep
        self._all: dict[str, SlowdownDecision] = {}

    def get(self, decision_id: str) -> SlowdownDecision | None:
        """A decision by its id; None when it is not in memory."""
        return self._all.get(decision_id)

    @property
    def open(self) -> list[SlowdownDecision]:
        """Decisions that have not ended, oldest first."""
        return [decision for decision in self._all.values() if decision.ended is None]

    def begin(
        self, entry: ZoneEntry, rule: DetectionRule, places: Iterable[Place] = ()
    ) -> SlowdownDecision:
        """Open the decision of an entry; the oldest ended decision makes room."""
        decision = SlowdownDecision(entry, rule, places=tuple(places))
        self._all[decision.decision_id] = decision
        if len(self._all) > self._keep:
            ended = (
                key for key, decision in self._all.items() if decision.ended is not None
            )
            self._all.pop(next(ended, ""), None)
        return decision

    def end(self, decision_id: str, at: Instant) -> list[SlowdownDecision]:
        """End a decision: its robot is released from the limit."""
        decision = self._all.get(decision_id)
        return self._change([] if decision is None else [decision], ended=at)

    def moved(
        self, robot_id: str, speed: float, at: Instant, *, is_slow: bool
    ) -> list[SlowdownDecision]:
        """Take the measured speed of a robot (m/s)."""
        known = self._open_of(robot_id) if is_slow else ()
        waiting = [decision for decision in known if decision.observed is None]
        return self._change(waiting, observed=at, speed_after=speed)

    def reported(self, report: SafetyReport, at: Instant) -> list[SlowdownDecision]:
        """Take the applied factor of a robot's report."""
        is_slow = report.speed_factor <= HALF_SPEED
        known = self._open_of(report.robot_id) if is_slow else ()
        waiting = [decision for decision in known if decision.applied is None]
        return self._change(waiting, applied=at)

    def published(self, at: Instant) -> list[SlowdownDecision]:
        """Note that feedback was published."""
        waiting = [decision for decision in self.open if decision.feedback is None]
        return self._change(waiting, feedback=at)

    def age(self, linked_s: Callable[[ZoneEntry], float]) -> list[SlowdownDecision]:
        """Let time pass; links that have not come in time are missing from now on.

        Args:
            linked_s: Time since an entry in which its robot was received without a
                silence (s).
        """
        # By time with a link, not by the clock: a silence judges no link.
        late = [
            decision
            for decision in self.open
            if not decision.waited_out and linked_s(decision.entry) >= MISSING_S
        ]
        return self._change(late, waited_out=True)

    def break_off(self, at: Instant) -> list[SlowdownDecision]:
        """End every open decision, as iVeg stops."""
        return self._change(self.open, ended=at, interrupted=True)

    def _open_of(self, robot_id: str) -> list[SlowdownDecision]:
        return [
            decision for decision in self.open if decision.entry.robot_id == robot_id
        ]

    def _change(
        self, decisions: Iterable[SlowdownDecision], **changes: Any
    ) -> list[SlowdownDecision]:
        changed = [replace(decision, **changes) for decision in decisions]
        self._all.update({decision.decision_id: decision for decision in changed})
        return changed
