"""Situation of one robot: what it does, why, and what a person can do about it.

Every surface that says how a robot is (cards, map, fleet page, status line, REST) takes
it from here, so that no two of them can differ (docs/dashboard.md, "Situation").  Of
all that holds the first in ``ORDER`` is told; silence makes nothing better, and "clear"
is what remains when nothing else holds.
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
"""Colour and shape, worst first: a P1; a robot near somebody, or on its way to a
standstill; one of which iVeg does not know enough; one that may not move; one at work;
one that never spoke."""
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
"""Order in which they are told, and how grave each is.

The first that holds for a robot or the fleet is told, in the colour of the gravest that
holds.  Line, cards, map and REST follow this table; ``iveg.models.docs``
writes it for the page.
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
    """The person, robot or obstacle that a situation is about.

    Attributes:
        about: Its id, where it is known.
        distance_m: To it (m); ``lane`` is where it is.
        foretold_s: Until the robot reaches its zone (s); None: it is inside.
        unseen_s: Since anybody saw it (s); of a robot of the fleet 0.
    """

    kind: str
    about: str | None = None
    distance_m: float | None = None
    lane: str | None = None
    foretold_s: float | None = None
    unseen_s: float = 0.0


@dataclass(frozen=True, slots=True)
class RobotFacts:
    """All that is known of one robot now.

    Attributes:
        age_s: Age of its pose (s); None while nobody knows.
        report: Its newest, while that is fresh.
        alerts: Active alerts of it and of the fleet that are a situation, in order.
        alert_about: The person or robot of the first of them.
        near: Cause of the applied reason; ``told_near`` that of the speed limit.
        out_of_service_by: The person who took its camera out of service.
        stop: State of its STOP.
        is_resuming: The order under way is a resume.
        is_slow: Its measured speed is at most half of its greatest.
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
    told_near: Near | None = None
    stop: State = "RUNNING"
    is_resuming: bool = False
    out_of_service_by: str | None = None
    is_replay: bool = False
    is_refused: bool = False
    is_slow: bool = True

    @property
    def applied(self) -> float:
        """Speed factor that it reports to apply; 1.0 where it reports none."""
        if self.report is None:
            return FULL_SPEED
        return 0.0 if self.report.holds else self.report.speed_factor

    @property
    def is_silent(self) -> bool:
        """Whether nothing is heard of it, now or ever."""
        return self.link in ("LOST", "UNKNOWN")

    @property
    def is_held(self) -> bool:
        """Whether it reports a hold, or waits for its resume."""
        report = self.report
        return report is not None and (bool(report.holds) or waits_for_resume(report))

    @property
    def factor(self) -> float | None:
        """The strictest factor in force; None of a robot that never spoke."""
        if self.link == "UNKNOWN" and self.report is None:
            return None
        return min(self.applied, self.limit.speed_factor)


@dataclass(frozen=True, slots=True)
class Situation:
    """One truth of one robot.

    Attributes:
        kind: Its place in ``ORDER``.
        state: Names the sentence of what it does (``situation.is.{state}``).
        cause: The reason that is applied: that of the robot's report, of the speed
            limit, or what iVeg found itself.
        why: Names the sentence of the cause (``situation.why.{why}``); None: the state
            says it all.
        about: The person, robot or hold that is the cause, where it is known.
        factor: The strictest speed factor in force; None: unknown.
        level: Level of the gravest that holds for the robot.
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
"""Reasons that are about somebody or something near, and their kinds."""


def waits_for_resume(report: SafetyReport) -> bool:
    """Whether a robot that nothing holds stays where it is, and does not drive."""
    return report.reason == "hold" and report.speed_factor <= 0.0


def limited(facts: RobotFacts) -> Iterator[Situation]:
    """Slow: by its own report, or because iVeg tells it and it does not say so yet."""
    report, limit, applied = facts.report, facts.limit, facts.applied
    if facts.is_held or facts.stop != "RUNNING":
        return
    if limit.speed_factor < applied:
        yield _slow("told", limit.speed_factor, limit.reason, facts.told_near, facts)
    elif report is not None and applied < FULL_SPEED:
        yield _slow(_state(facts), applied, report.reason, facts.near, facts)


def _state(facts: RobotFacts) -> str:
    """State of a robot that says that it is slow; it may only be on its way to it."""
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
    lacks = next((one for one in facts.unmet if one.limit_reason == reason), None)
    if lacks is not None:
        return _lacking(slow, lacks, facts.robot_id)
    action: Action = "check_network" if reason == "watchdog" else "none"
    known = reason if reason in _PLAIN else "other"
    return replace(slow, why=known, action=action)


_PLAIN = ("person", "robot", "obstacle", "stale", "doubt", "watchdog", "unsupervised")
"""Reasons that have a sentence without a distance."""


_LACKS: Mapping[UnmetReason, tuple[Kind, Action]] = {
    "pose": ("unsure", "none"),
    "doubt": ("contradiction", "none"),
    "detector": ("blind", "check_camera"),
}


def _lacking(slow: Situation, lacks: ClearCondition, own_id: str) -> Situation:
    """A robot that is slow because something is missing, its own or another's."""
    own = "_own" if lacks.robot_id == own_id and lacks.reason != "pose" else ""
    kind, action = _LACKS[lacks.reason]
    return replace(
        slow,
        kind=kind,
        why=f"no_{lacks.reason}{own}",
        about=lacks.robot_id,
        action=action,
        slots={**slow.slots, "about": lacks.robot_id},
    )


def because_of(situation: Situation, near: Near) -> Situation:
    """A situation whose cause is somebody near."""
    slots, why = dict(situation.slots), near.kind
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
    return replace(situation, why=why, cause=near.kind, about=near.about, slots=slots)


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


OF_STOPS = {state for _, state, _ in _STOPS.values()} | {"resuming"}
"""States that follow an order of people: they have rules for silence of their own."""


def stopping(facts: RobotFacts) -> Iterator[Situation]:
    """Under an order of people."""
    found = _STOPS.get(facts.stop)
    # A robot that moved while held is being stopped anew: its alert says both.
    if found is None or "alert.stop_moved" in {one.key for one in facts.alerts}:
        return
    kind, state, action = found
    if facts.is_resuming and state == "releasing":
        state = "resuming"
    yield Situation(kind, state, "stop", action=action)


_UNLOCKED: Mapping[str, Action] = {
    "local": "unlock",
    "remote": "release",
    "auto": "none",
}
"""Action that lifts a hold; the one that takes most comes first."""


def locked(facts: RobotFacts) -> Iterator[Situation]:
    """Not free to move, by its own report; a STOP of ours says so itself."""
    report = facts.report
    if report is None or facts.stop not in ("RUNNING", "READY"):
        return
    if report.holds:
        first = min(report.holds, key=lambda one: list(_UNLOCKED).index(one.ack))
        action, source = _UNLOCKED[first.ack], f"held_{first.source}"
        yield Situation("locked", "held", "hold", source, first.id, action)
    elif waits_for_resume(report):
        yield Situation("locked", "ready", "hold", action="resume")


_KINDS, _LEVELS = list(ORDER), get_args(Level)


def situation_of(facts: RobotFacts) -> Situation:
    """The first of all that holds for a robot."""
    found = _silent(facts) if facts.is_silent else _present(facts)
    holding = [*_alerted(facts), *found]
    first = min(holding, key=lambda one: _KINDS.index(one.kind))
    level = min((ORDER[one.kind] for one in holding), key=_LEVELS.index)
    if facts.link == "LATE" and first.state not in OF_STOPS:
        first, level = _late(first, level, facts)
    return replace(first, level=level, factor=facts.factor)


def _present(facts: RobotFacts) -> Iterator[Situation]:
    """All that holds for a robot that is heard; its work if nothing else does."""
    yield from locked(facts)
    yield from stopping(facts)
    yield from _doubted(facts)
    yield from limited(facts)
    yield from _blind(facts)
    yield _at_work(facts)


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


def told_of(alerts: Iterable[Condition]) -> list[Condition]:
    """The alerts that a situation names, the first in order first."""
    order = list(ALERTED)
    named = (one for one in alerts if one.key in ALERTED)
    return sorted(named, key=lambda one: order.index(one.key))


def _alerted(facts: RobotFacts) -> Iterator[Situation]:
    for alert in facts.alerts:
        kind, state, action = ALERTED[alert.key]
        if state == "lost_moving" and not facts.is_silent:
            continue  # It is heard again; the alert clears with the next tick.
        slots = {name: alert.slots[name] for name in _SLOTS if name in alert.slots}
        found = Situation(kind, state, "alarm", action=action, slots=slots)
        if alert is facts.alerts[0] and facts.alert_about is not None:
            found = because_of(found, facts.alert_about)
        yield _aged(found, facts) if state == "lost_moving" else found


_SLOTS = ("boot", "by", "level")
"""Slots of alerts that sentences of situations name."""


# --- silence --------------------------------------------------------------------------


def _silent(facts: RobotFacts) -> Iterator[Situation]:
    if facts.link == "UNKNOWN":
        yield Situation("away", "no_data", "link")
    elif facts.age_s is None:
        yield Situation("lost", "age_unknown", "link", action="red_button")
    else:
        # The network is well where a setting says that it is not heard.
        action: Action = "none" if facts.is_refused else "red_button"
        yield _aged(Situation("lost", "lost", "link", action=action), facts)


def _late(live: Situation, level: Level, facts: RobotFacts) -> tuple[Situation, Level]:
    """A late robot: no better off than it was a moment ago."""
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
    """It contradicts itself, or nobody knows what it applies."""
    if facts.doubts:
        slots: dict[str, Slot] = {"code": facts.doubts[0]}
        yield Situation(
            "contradiction", "contradicts", "doubt", action="check_robot", slots=slots
        )
        return
    report, owes_none = facts.report, facts.stop != "RUNNING" or facts.is_replay
    if owes_none or facts.applied < FULL_SPEED:
        return
    # "Clear" needs the robot's own word.
    if report is None or report.reason != "clear":
        yield Situation("unsure", "unreported", "link", action="check_robot")


def _blind(facts: RobotFacts) -> Iterator[Situation]:
    """Its camera is out of service or not being read: it warns nobody of people.

    Somebody who is near it all the same is told with it.
    """
    by, own = facts.out_of_service_by, ClearCondition("detector", facts.robot_id)
    if facts.is_held or facts.stop in ("STANDING", "READY"):
        return
    if by is None and own not in facts.unmet:
        return
    why, slots = ("no_detector_own", {}) if by is None else ("camera_out", {"by": by})
    blind = Situation(
        "blind", "no_camera", "camera", why, None, "check_camera", None, slots
    )
    for near in (facts.near, facts.told_near):
        if near is not None and near.kind in HAZARDS:
            blind = because_of(blind, near)
            break
    yield blind


def _at_work(facts: RobotFacts) -> Situation:
    """Nothing else holds: "clear" is earned by a way that is driven, not by waiting."""
    state = "waiting" if facts.stands else "clear"
    return Situation("working", "replay" if facts.is_replay else state, "clear")
