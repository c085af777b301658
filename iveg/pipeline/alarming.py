"""What people are told of what is wrong: alarms, their lines, how fast they come."""

from collections.abc import Iterable

from iveg.domain.alarms import Alarm, AlarmBook, Condition
from iveg.domain.events import LogEvent, Slot
from iveg.domain.flood import Flood, FloodGauge
from iveg.domain.observations import Instant
from iveg.pipeline import topics
from iveg.pipeline.minutes import Minutes
from iveg.pipeline.ports import Ids
from iveg.pipeline.publish import Hub
from iveg.pipeline.wording import alarm_line, flood_line


class Alarming:
    """Raises, clears and acknowledges, and writes each of it down."""

    def __init__(self, minutes: Minutes, hub: Hub, new_id: Ids) -> None:
        self._minutes = minutes
        self._hub = hub
        self._new_id = new_id
        self._book = AlarmBook()
        self._gauge = FloodGauge()

    @property
    def waiting(self) -> list[Alarm]:
        """What is wrong now, and each P1 that went before anybody saw it."""
        return self._book.waiting

    @property
    def flood(self) -> Flood:
        """How fast alarms come."""
        return self._gauge.flood

    def knows(self, alert_id: str) -> bool:
        """Whether an alarm is of this run, active or over not long ago."""
        return self._book.find(alert_id) is not None

    def remember(self, earlier: Iterable[Alarm]) -> None:
        """Take up what nobody saw in an earlier run."""
        self._book.remember(one for one in earlier if not self.knows(one.alert_id))
        self._hub.changed(topics.ALERTS.name)

    def sync(self, wrong: Iterable[Condition], now: Instant) -> None:
        """Take what is wrong now."""
        changed = self._book.sync(wrong, now, self._new_id())
        for alarm in changed:
            self._minutes.alarm(alarm)
            self._minutes.log(alarm_line(alarm), now)
        self._watch_flood(sum(one.cleared is None for one in changed), now)

    def acknowledge(
        self, alert_id: str, by: str, note: str, now: Instant
    ) -> Alarm | None:
        """Somebody has seen an alarm; None when there is no such one."""
        alarm = self._book.acknowledge(alert_id, by, note, now)
        if alarm is not None:
            self._minutes.alarm(alarm)
            slots: dict[str, Slot] = {
                **alarm.condition.slots,
                "alert": alarm.condition.key,
                "by": by,
                "priority": alarm.priority,
            }
            self._minutes.log(LogEvent("alert", "log.alert.acknowledged", slots), now)
        return alarm

    def _watch_flood(self, raised: int, now: Instant) -> None:
        before = self.flood
        after = self._gauge.take(raised, now)
        if after == before:
            return
        self._hub.changed(topics.FLOOD.name)
        line = flood_line(before, after)
        if line is not None:
            self._minutes.log(line, now)
