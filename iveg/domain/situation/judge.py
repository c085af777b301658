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
from iveg.domain.situation.facts import Action, Level, RobotFacts, Situation
from iveg.domain.situation.slowness import because_of, limited
from iveg.domain.situation.stops_and_holds import OF_STOPS, held, stopping

_WORST_FIRST = get_args(Level)


def situation_of(facts: RobotFacts) -> Situation:
    """The worst of all that holds for a robot."""
    holding = list(_silent(facts) if _is_silent(facts) else _heard(facts))
    worst = min(
        (*_alerted(facts), *holding), key=lambda one: _WORST_FIRST.index(one.level)
    )
    if facts.link == "LATE" and worst.state not in OF_STOPS:
        worst = _late(worst, facts)
    return replace(worst, factor=facts.factor)


def _is_silent(facts: RobotFacts) -> bool:
    return facts.link in ("LOST", "UNKNOWN")


def _heard(facts: RobotFacts) -> Iterator[Situation]:
    """All that holds for a robot that is heard; its work if nothing else does."""
    yield from held(facts)
    yield from stopping(facts)
    yield from limited(facts)
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
        danger = because_of(danger, facts.alert_about)
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
        close = because_of(close, facts.margin_near)
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
