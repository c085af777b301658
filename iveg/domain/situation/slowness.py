"""Why a robot is slow: by its own report, or because iVeg tells it."""

from collections.abc import Iterator
from dataclasses import replace

from iveg.domain.feedback import FULL_SPEED, HALF_SPEED
from iveg.domain.limits import LIMITS
from iveg.domain.observations import SafetyReport
from iveg.domain.rule.premises import Missing
from iveg.domain.situation.facts import Action, Level, Near, RobotFacts, Situation

HAZARDS = ("person", "robot", "obstacle")
"""Reasons that are about somebody or something near."""


def waits_for_resume(report: SafetyReport) -> bool:
    """Whether a robot that nothing holds stays where it is, and does not drive."""
    return report.reason == "hold" and report.speed_factor <= 0.0


def limited(facts: RobotFacts) -> Iterator[Situation]:
    """Slow: by its own report, or because iVeg tells it and it does not say so yet."""
    report, limit, applied = facts.report, facts.limit, facts.applied
    held = report is not None and (report.holds or waits_for_resume(report))
    if held or facts.stop != "RUNNING":
        return
    if limit.speed_factor < applied:
        yield _slow("told", limit.speed_factor, limit.reason, facts.told_near, facts)
    elif report is not None and applied < FULL_SPEED:
        half = "half" if applied == HALF_SPEED else "slow"
        state = half if applied > 0.0 else "stands"
        yield _slow(state, applied, report.reason, facts.near, facts)


def _slow(
    state: str, factor: float, reason: str, near: Near | None, facts: RobotFacts
) -> Situation:
    level: Level = "caution" if reason in HAZARDS else "doubt"
    slow = Situation(level, state, reason, slots={"factor": factor})
    if near is not None and near.kind in HAZARDS:
        return because_of(slow, near)
    lacks = next((one for one in facts.missing if one.reason == reason), None)
    if lacks is not None:
        return _lacking(slow, lacks, facts.robot_id)
    action: Action = "check_network" if reason == "watchdog" else "none"
    known = reason if reason in _PLAIN else "other"
    return replace(slow, why=known, action=action)


_PLAIN = ("person", "robot", "obstacle", "stale", "doubt", "watchdog", "unsupervised")
"""Reasons that have a sentence without a distance."""


def _lacking(slow: Situation, lacks: Missing, own_id: str) -> Situation:
    """A robot that is slow because something is missing, its own or another's."""
    own = "_own" if lacks.robot_id == own_id and lacks.premise != "pose" else ""
    action: Action = "check_camera" if lacks.premise == "detector" else "none"
    return replace(
        slow,
        why=f"no_{lacks.premise}{own}",
        about=lacks.robot_id,
        action=action,
        slots={**slow.slots, "about": lacks.robot_id},
    )


def because_of(of: Situation, near: Near) -> Situation:
    """The same because of somebody near."""
    slots = dict(of.slots)
    why = near.kind
    if near.distance_m is not None:
        slots["distance"] = round(near.distance_m, 1)
        why = f"{near.kind}_at"
        if near.foretold_s is not None:
            slots["seconds"] = round(near.foretold_s, 1)
            why = f"{near.kind}_ahead"
        elif near.kind == "person" and near.lane is not None:
            slots["lane"] = near.lane
            why = "person_in"
    if near.kind == "person" and near.unseen_s > LIMITS.seen_s:
        # A distance to where somebody was is no distance to anybody.
        slots["unseen"] = round(near.unseen_s)
        why = "person_unseen" if near.lane is None else "person_was_in"
    if near.kind == "robot" and near.about is not None:
        slots["about"] = near.about
    return replace(of, why=why, cause=near.kind, about=near.about, slots=slots)
