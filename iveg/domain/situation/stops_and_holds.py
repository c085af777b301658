"""A robot that people stopped or that something holds, and what lets it go."""

from collections.abc import Iterator, Mapping

from iveg.domain.situation.facts import Action, Level, RobotFacts, Situation
from iveg.domain.situation.slowness import waits_for_resume
from iveg.domain.stop.commands import State

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
OF_STOPS = {state for _, state, _ in _STOPS.values()} | {"resuming"}
"""States that follow an order of people: they have rules for silence of their own."""


def stopping(facts: RobotFacts) -> Iterator[Situation]:
    """Under an order of people."""
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


def held(facts: RobotFacts) -> Iterator[Situation]:
    """Not free to move, by its own report; a STOP of ours says so itself."""
    report = facts.report
    if report is None or facts.stop not in ("RUNNING", "READY"):
        return
    holds = report.holds
    if not holds:
        if waits_for_resume(report):
            yield Situation("locked", "ready", "hold", action="resume")
        return
    first = min(holds, key=lambda one: list(_UNLOCKED).index(one.ack))
    action, source = _UNLOCKED[first.ack], f"held_{first.source}"
    yield Situation("locked", "held", "hold", source, first.id, action)
