"""Alerts after ISA-18.2: raised, acknowledged, cleared (docs/dashboard.md, "Alerts").

The conditions that hold are found anew each time; the book compares them with the
alerts that it keeps.  A condition that ends clears its alert; one that returns is the
same alert, one occurrence more.  One row stands for all of them, but never for less
than the gravest unacknowledged occurrence: grouping cannot hide an escalation.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from iveg.domain.events import Condition
from iveg.domain.messages import MessageDelivery, Priority, newest
from iveg.domain.observations import Instant

GROUPING_S = 600.0
"""A condition that returns within this time is the same alert, counted once more."""
MOST_KEPT = 200
"""Beyond this number even an unacknowledged P1 is left to the history."""
MEMBERS_KEPT = 100
"""Occurrences that an alert lists one by one; older ones are counted."""


@dataclass(frozen=True, slots=True)
class AlertOccurrence:
    """One period in which a condition held, with recipients and acknowledgement."""

    priority: Priority
    raised: Instant
    cleared: Instant | None = None
    acknowledged: Instant | None = None
    acknowledged_by: str | None = None
    note: str = ""
    deliveries: tuple[MessageDelivery, ...] = ()


@dataclass(frozen=True, slots=True)
class BookedAlert:
    """One alert with its life: every occurrence of one condition.

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
    members: tuple[AlertOccurrence, ...]
    unseen: Priority | None
    count: int = 1

    @property
    def last(self) -> AlertOccurrence:
        """The newest occurrence."""
        return self.members[-1]

    @property
    def cleared(self) -> Instant | None:
        """When the condition went; None while it holds."""
        return self.last.cleared

    @property
    def waits(self) -> bool:
        """Whether people should see it: it is active, or an unacknowledged P1."""
        return self.cleared is None or self.unseen == "P1"

    @property
    def priority(self) -> Priority:
        """Shown priority: never less than the gravest unacknowledged one."""
        return graver(self.condition.priority, self.unseen)


def graver(one: Priority, other: Priority | None) -> Priority:
    """The priority that must not be hidden by the other."""
    return one if other is None else min(one, other)


class AlertBook:
    """All active alerts and the recently cleared ones."""

    def __init__(self) -> None:
        self._alerts: dict[tuple[str, str], BookedAlert] = {}

    @property
    def waiting(self) -> list[BookedAlert]:
        """Active alerts, and each P1 that cleared before it was acknowledged."""
        return [one for one in self._alerts.values() if one.waits]

    def sync(
        self, conditions: Iterable[Condition], now: Instant, new_id: str
    ) -> list[BookedAlert]:
        """Take the conditions that hold now; returns the alerts that they changed."""
        wrong = _gravest(conditions)
        changed = []
        for key, alert in list(self._alerts.items()):
            if key in wrong or alert.cleared is not None:
                continue
            self._alerts[key] = _clear(alert, now)
            changed.append(self._alerts[key])
        for number, (key, condition) in enumerate(wrong.items()):
            before = self._alerts.get(key)
            if before is not None and _goes_on(before, condition):
                # What has not changed stays the very same for whoever draws it.
                if condition != before.condition:
                    self._alerts[key] = replace(before, condition=condition)
                continue
            self._alerts[key] = _raise(before, condition, now, f"{new_id}-{number}")
            changed.append(self._alerts[key])
        self._forget(now)
        return changed

    def acknowledge(
        self, alert_id: str, by: str, note: str, now: Instant
    ) -> BookedAlert | None:
        """Acknowledge all occurrences; None when there is no such alert."""
        alert = self.find(alert_id)
        return None if alert is None else self._keep(_see(alert, by, note, now))

    def record_deliveries(
        self, alert_id: str, raised: Instant, deliveries: Iterable[MessageDelivery]
    ) -> BookedAlert | None:
        """Record the recipients of one occurrence; None when it is forgotten."""
        alert = self.find(alert_id)
        if alert is None or all(one.raised != raised for one in alert.members):
            return None
        members = tuple(
            replace(one, deliveries=newest((*one.deliveries, *deliveries)))
            if one.raised == raised
            else one
            for one in alert.members
        )
        return self._keep(replace(alert, members=members))

    def remember(self, alerts: Iterable[BookedAlert]) -> None:
        """Take up cleared, unacknowledged alerts of an earlier run; known ones stay.

        If the condition holds again, a new alert of this run already stands beside it.
        """
        for alert in alerts:
            key = alert.condition.key, alert.condition.subject
            if key in self._alerts:
                named = replace(alert.condition, subject=alert.alert_id)
                alert = replace(alert, condition=named)
                key = named.key, named.subject
            self._alerts[key] = alert

    def find(self, alert_id: str) -> BookedAlert | None:
        """An alert that is active or recently cleared."""
        found = (one for one in self._alerts.values() if one.alert_id == alert_id)
        return next(found, None)

    def _keep(self, alert: BookedAlert) -> BookedAlert:
        """Store the new value of an alert."""
        self._alerts[alert.condition.key, alert.condition.subject] = alert
        return alert

    def _forget(self, now: Instant) -> None:
        for key, alert in list(self._alerts.items()):
            cleared = alert.cleared
            is_old = cleared is not None and now.mono - cleared.mono > GROUPING_S
            if is_old and (not alert.waits or len(self._alerts) > MOST_KEPT):
                del self._alerts[key]


def _gravest(conditions: Iterable[Condition]) -> dict[tuple[str, str], Condition]:
    """Conditions by kind and subject; of two alike the graver."""
    wrong: dict[tuple[str, str], Condition] = {}
    for one in conditions:
        known = wrong.setdefault((one.key, one.subject), one)
        if one.priority < known.priority:
            wrong[one.key, one.subject] = one
    return wrong


def _goes_on(before: BookedAlert, condition: Condition) -> bool:
    """Whether the occurrence continues: a graver one is a new occurrence."""
    return before.cleared is None and condition.priority >= before.condition.priority


def _clear(alert: BookedAlert, now: Instant) -> BookedAlert:
    last = replace(alert.last, cleared=now)
    return replace(alert, members=(*alert.members[:-1], last))


def _raise(
    before: BookedAlert | None, condition: Condition, now: Instant, alert_id: str
) -> BookedAlert:
    new = AlertOccurrence(condition.priority, now)
    if before is None:
        return BookedAlert(alert_id, condition, now, (new,), unseen=new.priority)
    past = before if before.cleared is not None else _clear(before, now)
    # The same alert, but a new occurrence needs a new acknowledgement.
    return replace(
        past,
        condition=condition,
        members=(*past.members, new)[-MEMBERS_KEPT:],
        unseen=graver(new.priority, past.unseen),
        count=past.count + 1,
    )


def _see(alert: BookedAlert, by: str, note: str, now: Instant) -> BookedAlert:
    members = tuple(
        one
        if one.acknowledged is not None
        else replace(one, acknowledged=now, acknowledged_by=by, note=note)
        for one in alert.members
    )
    return replace(alert, members=members, unseen=None)
