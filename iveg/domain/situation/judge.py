"""The situation of one robot: how it stands with it, why, and what a person can do.

Every surface that says how a robot is (cards, map, fleet page, status line, REST) takes
it from here, so that no two of them can differ (docs/dashboard.md, "Situation").  Of
all that holds the worst counts; silence makes nothing better, and "clear" is what
remains when nothing else holds.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import get_args

from iveg.domain.events import Condition, Slot
from iveg.domain.feedback import FULL_SPEED, HALF_SPEED
from iveg.domain.limits import LIMITS
from iveg.domain.observations import SafetyReport
from iveg.domain.rule.premises import Missing
from iveg.domain.situation.facts import Action, Level, Near, RobotFacts, Situation
from iveg.domain.stop.commands import State

_WORST_FIRST = get_args(Level)
HAZARDS = ("person", "robot", "obstacle")
"""Reasons that are about somebody or something near."""


def situation_of(facts: RobotFacts) -> Situation:
    """The worst of all that holds for a robot."""
    holding = list(_silent(facts) if _is_silent(facts) else _heard(facts))
    worst = min(
        (*_alerted(facts), *holding), key=lambda one: _WORST_FIRST.index(one.level)
    )
    if facts.link == "LATE" and worst.state not in _OF_STOPS:
        worst = _late(worst, facts)
    return replace(worst, factor=facts.factor)


def _is_silent(facts: RobotFacts) -> bool:
    return facts.link in ("LOST", "UNKNOWN")


def _heard(facts: RobotFacts) -> Iterator[Situation]:
    """All that holds for a robot that is heard; its work if nothing else does."""
    yield from _held(facts)
    yield from _stopping(facts)
    yield from _limited(facts)
    yield from _too_close(facts)
    yield from _doubted(facts)
    yield _at_work(facts)


# --- danger ---------------------------------------------------------------------------

P1_STATES: Mapping[str, tuple[str, Action]] = {
    "alert.stop_unconfirmed": ("unconfirmed", "red_button"),
    "alert.stop_still_moving": ("still_moving", "red_button"),
    "alert.stop_moved": ("moved", "red_button"),
    "alert.moving_robot_lost": ("lost_moving", "keep_away"),
    "alert.person_not_slowing": ("not_slowing", "press_stop"),
    "alert.no_slow_down": ("not_slowing", "press_stop"),
    "alert.recording_is_live": ("recording_live", "check_fleet_file"),
}
"""What each P1 is called here, the gravest first."""


def gravest(alerts: Iterable[Condition]) -> Condition | None:
    """The P1 that a situation names, of those that hold for a robot."""
    order = list(P1_STATES)
    known = (one for one in alerts if one.key in P1_STATES and one.priority == "P1")
    return min(known, key=lambda one: order.index(one.key), default=None)


def _alerted(facts: RobotFacts) -> Iterator[Situation]:
    if facts.alert is None:
        return
    state, action = P1_STATES[facts.alert.key]
    if state == "lost_moving" and not _is_silent(facts):
        return  # It is heard again; the alert clears with the next tick.
    danger = Situation("danger", state, "alarm", action=action)
    if facts.alert_about is not None:
        danger = _because(danger, facts.alert_about)
    yield _aged(danger, facts) if state == "lost_moving" else danger


# --- silence --------------------------------------------------------------------------


def _silent(facts: RobotFacts) -> Iterator[Situation]:
    if facts.link == "UNKNOWN":
        yield Situation("away", "no_data", "link")
    elif facts.age_s is None:
        yield Situation("doubt", "age_unknown", "link", action="check_network")
    else:
        # The network is well where an admin had it heard no more.
        action: Action = "none" if facts.is_revoked else "check_network"
        yield _aged(Situation("doubt", "lost", "link", action=action), facts)


def _late(live: Situation, facts: RobotFacts) -> Situation:
    """What was true a moment ago; a late robot is no better off than it was."""
    if live.level == "danger":
        return live
    level: Level = "caution" if live.level == "caution" else "doubt"
    return _aged(Situation(level, "late", "link", action="as_moving"), facts)


def _aged(situation: Situation, facts: RobotFacts) -> Situation:
    age_s = 0.0 if facts.age_s is None else round(facts.age_s, 1)
    return replace(situation, slots={**situation.slots, "age": age_s})


# --- STOP and locks -------------------------------------------------------------------

_STOPS: Mapping[State, tuple[Level, str, Action]] = {
    "REQUESTED": ("caution", "stopping", "as_moving"),
    "SENT": ("caution", "stopping", "as_moving"),
    "DELIVERED": ("caution", "braking", "as_moving"),
    "UNCONFIRMED": ("danger", "unconfirmed", "red_button"),
    "STILL_MOVING": ("danger", "still_moving", "red_button"),
    "STANDING": ("locked", "standing", "release"),
    "STALE": ("doubt", "stood", "as_moving"),
    "RELEASING": ("caution", "releasing", "as_moving"),
    "READY": ("locked", "ready", "resume"),
}
_OF_STOPS = {state for _, state, _ in _STOPS.values()} | {"resuming"}
"""States that follow an order of people: they have rules for silence of their own."""


def _stopping(facts: RobotFacts) -> Iterator[Situation]:
    found = _STOPS.get(facts.stop)
    if found is None:
        return
    level, state, action = found
    if facts.is_resuming and state == "releasing":
        state = "resuming"
    yield Situation(level, state, "stop", action=action)


_UNLOCKED: Mapping[str, Action] = {
    "local": "unlock",
    "remote": "release",
    "auto": "none",
}
"""What lifts a hold; the one that takes most comes first."""


def _held(facts: RobotFacts) -> Iterator[Situation]:
    """Not free to move, by its own report; a STOP of ours says so itself."""
    report = facts.report
    if report is None or facts.stop not in ("RUNNING", "READY"):
        return
    holds = report.holds
    if not holds:
        if _waits_for_resume(report):
            yield Situation("locked", "ready", "hold", action="resume")
        return
    first = min(holds, key=lambda one: list(_UNLOCKED).index(one.ack))
    action, source = _UNLOCKED[first.ack], f"held_{first.source}"
    yield Situation("locked", "held", "hold", source, first.id, action)


def _waits_for_resume(report: SafetyReport) -> bool:
    """Whether a robot that nothing holds stays where it is, and does not drive."""
    return report.reason == "hold" and report.speed_factor <= 0.0


# --- speed ----------------------------------------------------------------------------


def _limited(facts: RobotFacts) -> Iterator[Situation]:
    """Slow: by its own report, or because iVeg tells it and it does not say so yet."""
    report, limit, applied = facts.report, facts.limit, facts.applied
    held = report is not None and (report.holds or _waits_for_resume(report))
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
        return _because(slow, near)
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


def _because(of: Situation, near: Near) -> Situation:
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


# --- people, doubts, work -------------------------------------------------------------


def _too_close(facts: RobotFacts) -> Iterator[Situation]:
    """Somebody within the way that it takes to stop: shown, and never a call to STOP.

    A robot that stands stops nothing.
    """
    margin = facts.margin
    if margin is None or facts.stands or facts.margin_near is None:
        return
    if margin.band == "inside":
        close = Situation("caution", "close", "margin")
        close = _because(close, facts.margin_near)
        slots = {**close.slots, "short": max(0.1, round(-margin.margin_m, 1))}
        yield replace(close, cause="margin", slots=slots)
    elif margin.band == "unknown":
        yield Situation("doubt", "unseen", "margin", about=margin.person_id)


def _doubted(facts: RobotFacts) -> Iterator[Situation]:
    """It contradicts itself, or nobody knows what it applies."""
    if facts.doubts:
        slots: dict[str, Slot] = {"code": facts.doubts[0]}
        yield Situation(
            "doubt", "contradicts", "doubt", action="check_robot", slots=slots
        )
    elif not _says_clear(facts):
        yield Situation("doubt", "unreported", "link", action="check_robot")


def _says_clear(facts: RobotFacts) -> bool:
    """Whether it reports itself that nothing limits it, or owes no such report."""
    if facts.stop != "RUNNING" or facts.is_replay:
        return True
    report = facts.report
    return report is not None and (report.reason == "clear" or facts.applied < 1.0)


def _at_work(facts: RobotFacts) -> Situation:
    """Nothing else holds: "clear" is earned by a way that is driven, not by waiting."""
    if facts.is_replay:
        return Situation("working", "replay", "clear")
    if facts.stands:
        return Situation("working", "waiting", "clear")
    return Situation("working", "clear", "clear")
