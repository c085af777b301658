"""Alert conditions of the STOPs of a fleet."""

from collections.abc import Iterable

from iveg.domain.events import Condition
from iveg.domain.observations import Instant
from iveg.domain.stop.effects import OffTable
from iveg.domain.stop.machine import StopMachine

_ALERTS = {
    "UNCONFIRMED": "alert.stop_unconfirmed",
    "STILL_MOVING": "alert.stop_still_moving",
}
_NOT_AT_REST = {"REQUESTED", "SENT", "DELIVERED", *_ALERTS}
"""A STOP in one of these has not been seen to stand, not even once."""


def of_machines(machines: Iterable[StopMachine], now: Instant) -> Iterable[Condition]:
    """Conditions of STOPs that are not confirmed or not obeyed."""
    for machine in machines:
        stop, robot_id = machine.stop, machine.robot_id
        if stop is None:
            continue
        age = round(now.mono - stop.times.requested.mono, 1)
        key = _ALERTS.get(machine.state)
        if key is not None:
            yield Condition.of_robot("P1", key, robot_id, age=age)
        if stop.reason == "moved" and machine.state in _NOT_AT_REST:
            yield Condition.of_robot("P1", "alert.stop_moved", robot_id, age=age)


def of_mistakes(mistakes: Iterable[OffTable]) -> Iterable[Condition]:
    """Conditions of internal errors of the machine."""
    for one in mistakes:
        yield Condition.of_robot(
            "P2", "alert.stop_off_table", one.robot_id, state=one.state, event=one.key
        )
