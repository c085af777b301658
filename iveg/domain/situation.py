"""Situation of one robot: its state, the cause, and the action open to a person.

Cards, map, fleet page, status line and REST take the situation from here, so that no
two of them can differ (docs/dashboard.md, "Situation").  Several situations may hold;
the first in ``ORDER`` is shown.  Silence makes nothing better, and "clear" remains when
nothing else holds.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

from iveg.domain.events import Condition, Slot
from iveg.domain.feedback import FULL_SPEED, HALF_SPEED, SpeedLimit
from iveg.domain.limits import LIMITS
from iveg.domain.observations import SafetyReport
from iveg.domain.robot_state import Link
from iveg.domain.rule.clear import ClearCondition
from iveg.domain.rule.clear import Reason as UnmetReason
from iveg.domain.stop.commands import State

Level = Literal["danger", "caution", "doubt", "locked", "working", "away"]
"""Colour and shape, worst first: a P1; a robot near somebody or on its way to a
standstill; in doubt; not free to move; at work; never received."""
Kind = Literal[
    "disobeys",
    "lost_moving",
    "stop_failed",
    "stop_unknown",
    "stop_under_way",
    "moved",
    "another_iveg",
    "recording_live",
    "contradiction",
    "blind",
    "lost",
    "person",
    "laser",
    "robot",
    "unsure",
    "locked",
    "battery",
    "working",
    "away",
]
ORDER: Mapping[Kind, Level] = {
    "disobeys": "danger",
    "lost_moving": "danger",
    "stop_failed": "danger",
    "stop_unknown": "doubt",
    "stop_under_way": "caution",
    "moved": "danger",
    "another_iveg": "danger",
    "recording_live": "danger",
    "contradiction": "doubt",
    "blind": "doubt",
    "lost": "doubt",
    "person": "caution",
    "laser": "caution",
    "robot": "caution",
    "unsure": "doubt",
    "locked": "locked",
    "battery": "working",
    "working": "working",
    "away": "away",
}
"""Kinds in the order in which they are shown, and the level of each.

The first that holds for a robot or the fleet is shown, in the colour of the gravest
that holds.  Line, cards, map and REST follow this table; ``iveg.models.docs`` writes it
for the page.
"""
Action = Literal[
    "none",
    "press_stop",
    "red_button",
    "as_moving",
    "check_robot",
    "check_camera",
    "check_network",
    "check_fleet_file",
    "stop_other_iveg",
    "charge",
    "release",
    "unlock",
    "resume",
]


@dataclass(frozen=True, slots=True)
class Near:
    """Person, robot or obstacle that a situation is about.

    Attributes:
        about: Its id, where known.
        distance_m: Distance to it (m).
        lane: Label of the aisle that it is in.
        foretold_s: Time until the robot reaches its zone (s); None: it is inside.
        unseen_s: Time since it was last seen (s); 0 for a robot of the fleet.
    """

    kind: str
    about: str | None = None
    distance_m: float | None = None
    lane: str | None = None
    foretold_s: float | None = None
    unseen_s: float = 0.0


@dataclass(frozen=True, slots=True)
class RobotFacts:
    """Facts about one robot from which its situation follows.

    Attributes:
        age_s: Age of its pose (s); None while unproven.
        stands: Whether it is measured at rest.
        report: Its newest report, while fresh.
        limit: Its speed limit by the rule.
        unmet: Conditions of "clear" that it does not meet.
        doubts: Codes of its contradictions.
        alerts: Active alerts of it and of the fleet that are a situation, in order.
        alert_about: Person or robot of the first of these alerts.
        near: Cause of the reason that it reports.
        limit_near: Cause of its speed limit.
        stop: State of its STOP machine.
        is_resuming: Whether the order under way is a resume.
        out_of_service_by: Operator who took its camera out of service.
        is_refused: Whether a setting excludes its messages.
        is_slow: Whether its measured speed is at most half of its greatest.
    """

    robot_id: str
    link: Link
    age_s: float | None
    stands: bool
    report: SafetyReport | None
    limit: SpeedLimit
    unmet: Sequence[ClearCondition] = ()
    doubts: Sequence[str] = ()
    alerts: Sequence[Condition] = ()
    alert_about: Near | None = None
    near: Near | None = None
    limit_near: Near | None = None
    stop: State = "RUNNING"
    is_resuming: bool = False
    out_of_service_by: str | None = None
    is_replay: bool = False
    is_refused: bool = False
    is_slow: bool = True

    @property
    def applied(self) -> float:
        """Speed factor by its own report; 1.0 without a report."""
        if self.report is None:
            return FULL_SPEED
        return 0.0 if self.report.holds else self.report.speed_factor

    @property
    def is_silent(self) -> bool:
        """Whether it is lost or was never received."""
        return self.link in ("LOST", "UNKNOWN")

    @property
    def is_held(self) -> bool:
        """Whether it reports a hold or waits for its resume."""
        report = self.report
        return report is not None and (bool(report.holds) or waits_for_resume(report))

    @property
    def factor(self) -> float | None:
        """Strictest speed factor in force; None for a robot that was never received."""
        if self.link == "UNKNOWN" and self.report is None:
            return None
        return min(self.applied, self.limit.speed_factor)


@dataclass(frozen=True, slots=True)
class Situation:
    """One situation of one robot.

    Attributes:
        kind: Its place in ``ORDER``.
        state: Key of the sentence for its state (``situation.is.{state}``).
        cause: Reason in force: that of the robot's report, of the speed limit, or of
            iVeg's own judgement.
        why: Key of the sentence for the cause (``situation.why.{why}``); None: the
            state says it all.
        about: Id of the person, robot or hold that is the cause, where known.
        action: Action that is open to a person.
        factor: Strictest speed factor in force; None: unknown.
        level: Gravest level that holds for the robot.
    """

    kind: Kind
    state: str
    cause: str
    why: str | None = None
    about: str | None = None
    action: Action = "none"
    factor: float | None = None
    slots: Mapping[str, Slot] = field(default_factory=dict)
    level: Level = "working"


HAZARDS: Mapping[str, Kind] = {
    "person": "person",
    "robot": "robot",
    "obstacle": "laser",
}
"""Reasons with a person, robot or obstacle near by, and their kinds."""


def waits_for_resume(report: SafetyReport) -> bool:
    """Whether a robot without a hold stands until somebody resumes it."""
    return report.reason == "hold" and report.speed_factor <= 0.0


def limited(facts: RobotFacts) -> Iterator[Situation]:
    """Slow, by its own report or by a stricter limit that it does not report yet."""
    report, limit, applied = facts.report, facts.limit, facts.applied
    if facts.is_held or facts.stop != "RUNNING":
        return
    # A stricter limit counts before the report: the robot does not apply it yet.
    if limit.speed_factor < applied:
        yield _slow("told", limit.speed_factor, limit.reason, facts.limit_near, facts)
    elif report is not None and applied < FULL_SPEED:
        yield _slow(_state(facts), applied, report.reason, facts.near, facts)


def _state(facts: RobotFacts) -> str:
    """State of a robot that reports a slow factor, by its measured motion."""
    # "Half speed" is never said of a robot that is measured faster.
    if not facts.is_slow:
        return "told"
    if facts.applied <= 0.0:
        return "stands" if facts.stands else "told"
    return "half" if facts.applied == HALF_SPEED else "slow"


def _slow(
    state: str, factor: float, reason: str, near: Near | None, facts: RobotFacts
) -> Situation:
    kind = HAZARDS.get(reason, "unsure")
    slow = Situation(kind, state, reason, slots={"factor": factor})
    if near is not None and near.kind in HAZARDS:
        return because_of(slow, near)
    unmet = next((unmet for unmet in facts.unmet if unmet.limit_reason == reason), None)
    if unmet is not None:
        return _because_unmet(slow, unmet, facts.robot_id)
    action: Action = "check_network" if reason == "watchdog" else "none"
    return replace(slow, why=reason if reason in _PLAIN else "other", action=action)


_PLAIN = ("person", "robot", "obstacle", "stale", "doubt", "watchdog", "unsupervised")
"""Reasons with a sentence that names no distance."""


_UNMET: Mapping[UnmetReason, tuple[Kind, Action]] = {
    "pose": ("unsure", "none"),
    "doubt": ("contradiction", "none"),
    "detector": ("blind", "check_camera"),
}


def _because_unmet(slow: Situation, unmet: ClearCondition, own_id: str) -> Situation:
    """Slow situation with an unmet condition of "clear" as its cause."""
    # A pose is always the robot's own, so its sentence has no second form.
    own = "_own" if unmet.robot_id == own_id and unmet.reason != "pose" else ""
    kind, action = _UNMET[unmet.reason]
    return replace(
        slow,
        kind=kind,
        why=f"no_{unmet.reason}{own}",
        about=unmet.robot_id,
        action=action,
        slots={**slow.slots, "about": unmet.robot_id},
    )


def because_of(situation: Situation, near: Near) -> Situation:
    """Situation with a person, robot or obstacle near by as its cause."""
    slots, kind = dict(situation.slots), near.kind
    if near.distance_m is not None:
        slots["distance"] = round(near.distance_m, 1)
        kind = f"{near.kind}_at"
        if near.foretold_s is not None:
            slots["seconds"] = round(near.foretold_s, 1)
            kind = f"{near.kind}_ahead"
        elif near.kind == "person" and near.lane is not None:
            slots["lane"] = near.lane
            kind = "person_in"
    if near.kind == "person" and near.unseen_s > LIMITS.seen_s:
        # The distance to a place where somebody was is no distance to a person.
        slots["unseen"] = round(near.unseen_s)
        kind = "person_unseen" if near.lane is None else "person_was_in"
    if near.kind == "robot" and near.about is not None:
        slots["about"] = near.about
    return replace(situation, why=kind, cause=near.kind, about=near.about, slots=slots)


_STOPS: Mapping[State, tuple[Kind, str, Action]] = {
    "REQUESTED": ("stop_under_way", "stopping", "as_moving"),
    "SENT": ("stop_under_way", "stopping", "as_moving"),
    "DELIVERED": ("stop_under_way", "braking", "as_moving"),
    "UNCONFIRMED": ("stop_failed", "unconfirmed", "red_button"),
    "STILL_MOVING": ("stop_failed", "still_moving", "red_button"),
    "STANDING": ("locked", "standing", "release"),
    "STALE": ("stop_unknown", "stood", "as_moving"),
    "RELEASING": ("stop_under_way", "releasing", "as_moving"),
    "READY": ("locked", "ready", "resume"),
}


STOP_STATES = {state for _, state, _ in _STOPS.values()} | {"resuming"}
"""States of STOP, release and resume, whose machine has its own rules for silence."""


def stopping(facts: RobotFacts) -> Iterator[Situation]:
    """Under a STOP, release or resume of this iVeg."""
    row = _STOPS.get(facts.stop)
    # A robot that moved while held is being stopped anew: its alert says both.
    if row is None or "alert.stop_moved" in {alert.key for alert in facts.alerts}:
        return
    kind, state, action = row
    if facts.is_resuming and state == "releasing":
        state = "resuming"
    yield Situation(kind, state, "stop", action=action)


_UNLOCKED: Mapping[str, Action] = {
    "local": "unlock",
    "remote": "release",
    "auto": "none",
}
"""Action that lifts a hold, by its ``ack``; the most laborious first."""


def locked(facts: RobotFacts) -> Iterator[Situation]:
    """Not free to move, by its own report; an open STOP has ``stopping`` instead."""
    report = facts.report
    if report is None or facts.stop not in ("RUNNING", "READY"):
        return
    if report.holds:
        first = min(report.holds, key=lambda hold: list(_UNLOCKED).index(hold.ack))
        action, source = _UNLOCKED[first.ack], f"held_{first.source}"
        yield Situation("locked", "held", "hold", source, first.id, action)
    elif waits_for_resume(report):
        yield Situation("locked", "ready", "hold", action="resume")


_KINDS, _LEVELS = list(ORDER), get_args(Level)


def situation_of(facts: RobotFacts) -> Situation:
    """Situation of a robot: the first in ``ORDER`` of all that hold."""
    others = _silent(facts) if facts.is_silent else _present(facts)
    holding = [*_alerted(facts), *others]
    first = min(holding, key=lambda situation: _KINDS.index(situation.kind))
    # A mild kind may come first: its colour must not hide a graver situation.
    level = min((ORDER[situation.kind] for situation in holding), key=_LEVELS.index)
    if facts.link == "LATE" and first.state not in STOP_STATES:
        first, level = _late(first, level, facts)
    return replace(first, level=level, factor=facts.factor)


def _present(facts: RobotFacts) -> Iterator[Situation]:
    """Situations of a robot that is received; the last is its work."""
    yield from locked(facts)
    yield from stopping(facts)
    yield from _doubted(facts)
    yield from limited(facts)
    yield from _blind(facts)
    # "Clear" is said of a robot that drives; a standing robot waits.
    state = "waiting" if facts.stands else "clear"
    yield Situation("working", "replay" if facts.is_replay else state, "clear")


# --- alerts ---------------------------------------------------------------------------

ALERTED: Mapping[str, tuple[Kind, str, Action]] = {
    "alert.person_not_slowing": ("disobeys", "not_slowing", "press_stop"),
    "alert.no_slow_down": ("disobeys", "not_slowing", "press_stop"),
    "alert.moving_robot_lost": ("lost_moving", "lost_moving", "red_button"),
    "alert.stop_unconfirmed": ("stop_failed", "unconfirmed", "red_button"),
    "alert.stop_still_moving": ("stop_failed", "still_moving", "red_button"),
    "alert.stop_moved": ("moved", "moved", "red_button"),
    "alert.another_iveg": ("another_iveg", "another_iveg", "stop_other_iveg"),
    "alert.recording_is_live": ("recording_live", "recording_live", "check_fleet_file"),
    "alert.camera_blind": ("blind", "camera_blind", "check_camera"),
    "alert.battery_low": ("battery", "battery_low", "charge"),
}
"""Kind, state and action of each alert that is a situation, as in ``ORDER``."""


def situation_alerts(alerts: Iterable[Condition]) -> list[Condition]:
    """Alerts that are a situation, in the order of ``ALERTED``."""
    order = list(ALERTED)
    named = (alert for alert in alerts if alert.key in ALERTED)
    return sorted(named, key=lambda alert: order.index(alert.key))


def _alerted(facts: RobotFacts) -> Iterator[Situation]:
    for alert in facts.alerts:
        kind, state, action = ALERTED[alert.key]
        if state == "lost_moving" and not facts.is_silent:
            continue  # The robot is received again; the next tick clears the alert.
        slots = {name: alert.slots[name] for name in _SLOTS if name in alert.slots}
        alerted = Situation(kind, state, "alarm", action=action, slots=slots)
        if alert is facts.alerts[0] and facts.alert_about is not None:
            alerted = because_of(alerted, facts.alert_about)
        yield _aged(alerted, facts) if state == "lost_moving" else alerted


_SLOTS = ("boot", "by", "level")
"""Slots of alerts that sentences of situations use."""


# --- silence --------------------------------------------------------------------------


def _silent(facts: RobotFacts) -> Iterator[Situation]:
    if facts.link == "UNKNOWN":
        yield Situation("away", "no_data", "link")
    elif facts.age_s is None:
        yield Situation("lost", "age_unknown", "link", action="red_button")
    else:
        # The silence of a refused robot comes from a setting, not from the network.
        action: Action = "none" if facts.is_refused else "red_button"
        yield _aged(Situation("lost", "lost", "link", action=action), facts)


def _late(live: Situation, level: Level, facts: RobotFacts) -> tuple[Situation, Level]:
    """Situation and level of a late robot, no better than before it was late."""
    if level == "danger":
        return live, level
    kind = min(live.kind, "unsure", key=_KINDS.index)
    late = Situation(kind, "late", "link", action="as_moving")
    return _aged(late, facts), min(level, "doubt", key=_LEVELS.index)


def _aged(situation: Situation, facts: RobotFacts) -> Situation:
    age_s = 0.0 if facts.age_s is None else round(facts.age_s, 1)
    return replace(situation, slots={**situation.slots, "age": age_s})


# --- doubts, cameras, work ------------------------------------------------------------


def _doubted(facts: RobotFacts) -> Iterator[Situation]:
    """In contradiction with itself, or without a report of its speed factor."""
    if facts.doubts:
        slots: dict[str, Slot] = {"code": facts.doubts[0]}
        yield Situation(
            "contradiction", "contradicts", "doubt", action="check_robot", slots=slots
        )
        return
    report, owes_none = facts.report, facts.stop != "RUNNING" or facts.is_replay
    if owes_none or facts.applied < FULL_SPEED:
        return
    # A robot is "clear" only by its own report; iVeg's limit alone proves nothing.
    if report is None or report.reason != "clear":
        yield Situation("unsure", "unreported", "link", action="check_robot")


def _blind(facts: RobotFacts) -> Iterator[Situation]:
    """Without a camera: out of service or not being read.

    The cause names a hazard near by: other robots or a laser may see it.
    """
    operator, own = facts.out_of_service_by, ClearCondition("detector", facts.robot_id)
    if facts.is_held or facts.stop in ("STANDING", "READY"):
        return
    if operator is None and own not in facts.unmet:
        return
    sentence, slots = (
        ("no_detector_own", {})
        if operator is None
        else ("camera_out", {"by": operator})
    )
    blind = Situation(
        "blind", "no_camera", "camera", sentence, None, "check_camera", None, slots
    )
    for near in (facts.near, facts.limit_near):
        if near is not None and near.kind in HAZARDS:
            blind = because_of(blind, near)
            break
    yield blind
