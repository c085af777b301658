"""Notices to people, after ISA-18.2: raised, acknowledged, cleared (product.md §3).

What is wrong is a set of conditions, found anew each time; the book compares it with
what it holds.  A condition that goes clears its alarm; one that comes back is the same
alarm, one occurrence more.  One row stands for all of them, but never for less than
the gravest that nobody has seen: grouping cannot hide an escalation.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from iveg.domain.events import Slot
from iveg.domain.observations import Instant

Priority = Literal["P1", "P2", "P3"]

GROUPING_S = 600.0
"""The same condition back within this time is the same alarm, counted once more."""
MOST_KEPT = 200
"""More alarms than this, and even a P1 that nobody saw is left to the history."""
MEMBERS_KEPT = 100
"""Occurrences that an alarm can still tell one by one; the others are counted."""


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
class Occurrence:
    """One time that a condition held, and who has seen it."""

    priority: Priority
    raised: Instant
    cleared: Instant | None = None
    acknowledged: Instant | None = None
    acknowledged_by: str | None = None
    note: str = ""


@dataclass(frozen=True, slots=True)
class Alarm:
    """One notice with its life: every occurrence of one condition.

    Attributes:
        condition: As it is now, or was when it cleared.
        raised: The first occurrence.
        members: The newest occurrences, oldest first; at least one.
        unseen: Gravest priority that nobody has acknowledged; None when all are seen.
        count: All occurrences.
    """

    alert_id: str
    condition: Condition
    raised: Instant
    members: tuple[Occurrence, ...]
    unseen: Priority | None
    count: int = 1

    @property
    def last(self) -> Occurrence:
        """The newest occurrence."""
        return self.members[-1]

    @property
    def cleared(self) -> Instant | None:
        """When the condition went; None while it holds."""
        return self.last.cleared

    @property
    def waits(self) -> bool:
        """Whether it is for people to see: it holds, or was a P1 that nobody saw."""
        return self.cleared is None or self.unseen == "P1"

    @property
    def priority(self) -> Priority:
        """What it is shown and sounds as: never less than the gravest unseen."""
        return graver(self.condition.priority, self.unseen)


def graver(one: Priority, other: Priority | None) -> Priority:
    """The priority that must not be hidden by the other."""
    return one if other is None else min(one, other)


class AlarmBook:
    """All active alarms and the recently cleared ones."""

    def __init__(self) -> None:
        self._alarms: dict[tuple[str, str], Alarm] = {}

    @property
    def waiting(self) -> list[Alarm]:
        """What is wrong now, seen or not, and each P1 that went before it was seen."""
        return [one for one in self._alarms.values() if one.waits]

    def sync(
        self, conditions: Iterable[Condition], now: Instant, new_id: str
    ) -> list[Alarm]:
        """Take what is wrong now; returns the alarms that were raised or cleared."""
        wrong = _gravest(conditions)
        changed = []
        for key, alarm in list(self._alarms.items()):
            if key in wrong or alarm.cleared is not None:
                continue
            self._alarms[key] = _clear(alarm, now)
            changed.append(self._alarms[key])
        for number, (key, condition) in enumerate(wrong.items()):
            before = self._alarms.get(key)
            if before is not None and _goes_on(before, condition):
                self._alarms[key] = replace(before, condition=condition)
                continue
            self._alarms[key] = _raise(before, condition, now, f"{new_id}-{number}")
            changed.append(self._alarms[key])
        self._forget(now)
        return changed

    def acknowledge(
        self, alert_id: str, by: str, note: str, now: Instant
    ) -> Alarm | None:
        """Somebody has seen all of it; None when there is no such alarm."""
        alarm = self.find(alert_id)
        if alarm is not None:
            alarm = _see(alarm, by, note, now)
            self._alarms[alarm.condition.key, alarm.condition.subject] = alarm
        return alarm

    def remember(self, alarms: Iterable[Alarm]) -> None:
        """Take up alarms that are over and that nobody has seen; what is known stays.

        One whose condition holds again already stands beside it under its own name.
        """
        for alarm in alarms:
            key = alarm.condition.key, alarm.condition.subject
            if key in self._alarms:
                named = replace(alarm.condition, subject=alarm.alert_id)
                alarm = replace(alarm, condition=named)
                key = named.key, named.subject
            self._alarms[key] = alarm

    def find(self, alert_id: str) -> Alarm | None:
        """An alarm that is active or was not long ago."""
        found = (one for one in self._alarms.values() if one.alert_id == alert_id)
        return next(found, None)

    def _forget(self, now: Instant) -> None:
        for key, alarm in list(self._alarms.items()):
            cleared = alarm.cleared
            is_old = cleared is not None and now.mono - cleared.mono > GROUPING_S
            if is_old and (not alarm.waits or len(self._alarms) > MOST_KEPT):
                del self._alarms[key]


def _gravest(conditions: Iterable[Condition]) -> dict[tuple[str, str], Condition]:
    """What is wrong by kind and subject; of two of the same the graver."""
    wrong: dict[tuple[str, str], Condition] = {}
    for one in conditions:
        known = wrong.setdefault((one.key, one.subject), one)
        if one.priority < known.priority:
            wrong[one.key, one.subject] = one
    return wrong


def _goes_on(before: Alarm, condition: Condition) -> bool:
    """Whether it is the same occurrence: one that gets graver is a new one."""
    return before.cleared is None and condition.priority >= before.condition.priority


def _clear(alarm: Alarm, now: Instant) -> Alarm:
    last = replace(alarm.last, cleared=now)
    return replace(alarm, members=(*alarm.members[:-1], last))


def _raise(
    before: Alarm | None, condition: Condition, now: Instant, alert_id: str
) -> Alarm:
    new = Occurrence(condition.priority, now)
    if before is None:
        return Alarm(alert_id, condition, now, (new,), unseen=new.priority)
    past = before if before.cleared is not None else _clear(before, now)
    # The same alarm, but a new occurrence needs a new acknowledgement.
    return replace(
        past,
        condition=condition,
        members=(*past.members, new)[-MEMBERS_KEPT:],
        unseen=graver(new.priority, past.unseen),
        count=past.count + 1,
    )


def _see(alarm: Alarm, by: str, note: str, now: Instant) -> Alarm:
    members = tuple(
        one
        if one.acknowledged is not None
        else replace(one, acknowledged=now, acknowledged_by=by, note=note)
        for one in alarm.members
    )
    return replace(alarm, members=members, unseen=None)
