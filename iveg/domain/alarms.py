"""Notices to people, after ISA-18.2: raised, acknowledged, cleared (product.md §3).

What is wrong is a set of conditions, found anew each time; the book compares it with
what it holds.  A condition that goes clears its alarm; one that comes back soon is the
same alarm, counted; acknowledging never hides what is still active.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from iveg.domain.events import Slot
from iveg.domain.observations import Instant

Priority = Literal["P1", "P2", "P3"]

GROUPING_S = 30.0
"""The same condition back within this time is the same alarm, counted once more."""


@dataclass(frozen=True, slots=True)
class Condition:
    """Something that is wrong now.

    Attributes:
        key: Names the sentence; ``subject`` tells two of a kind apart.
    """

    priority: Priority
    key: str
    subject: str
    robot_id: str | None = None
    slots: Mapping[str, Slot] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Alarm:
    """One notice with its life."""

    alert_id: str
    condition: Condition
    raised: Instant
    cleared: Instant | None = None
    acknowledged: Instant | None = None
    acknowledged_by: str | None = None
    note: str = ""
    count: int = 1


class AlarmBook:
    """All active alarms and the recently cleared ones."""

    def __init__(self) -> None:
        self._alarms: dict[tuple[str, str], Alarm] = {}

    @property
    def active(self) -> list[Alarm]:
        """What is wrong now, whatever anybody acknowledged."""
        return [one for one in self._alarms.values() if one.cleared is None]

    def sync(
        self, conditions: Iterable[Condition], now: Instant, new_id: str
    ) -> list[Alarm]:
        """Take what is wrong now; returns the alarms that were raised or cleared."""
        wrong = {(one.key, one.subject): one for one in conditions}
        changed = []
        for key, alarm in list(self._alarms.items()):
            if key in wrong or alarm.cleared is not None:
                continue
            self._alarms[key] = replace(alarm, cleared=now)
            changed.append(self._alarms[key])
        for number, (key, condition) in enumerate(wrong.items()):
            before = self._alarms.get(key)
            if before is not None and before.cleared is None:
                self._alarms[key] = replace(before, condition=condition)
                continue
            self._alarms[key] = _raise(before, condition, now, f"{new_id}-{number}")
            changed.append(self._alarms[key])
        self._forget(now)
        return changed

    def acknowledge(
        self, alert_id: str, by: str, note: str, now: Instant
    ) -> Alarm | None:
        """Somebody has seen it; None when there is no such alarm."""
        for key, alarm in self._alarms.items():
            if alarm.alert_id == alert_id:
                if alarm.acknowledged is None:
                    alarm = replace(
                        alarm, acknowledged=now, acknowledged_by=by, note=note
                    )
                    self._alarms[key] = alarm
                return alarm
        return None

    def _forget(self, now: Instant) -> None:
        for key, alarm in list(self._alarms.items()):
            cleared = alarm.cleared
            if cleared is not None and now.mono - cleared.mono > GROUPING_S:
                del self._alarms[key]


def _raise(
    before: Alarm | None, condition: Condition, now: Instant, alert_id: str
) -> Alarm:
    if before is None:
        return Alarm(alert_id, condition, raised=now)
    # Back soon: the same alarm, but a new occurrence needs a new acknowledgement.
    return Alarm(
        before.alert_id, condition, raised=before.raised, count=before.count + 1
    )
