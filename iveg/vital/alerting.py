"""Alerts: raised, cleared, acknowledged, logged."""

from collections.abc import Iterable

from iveg.domain.alerts import AlertBook, BookedAlert
from iveg.domain.events import Condition
from iveg.domain.observations import Instant
from iveg.vital import topics
from iveg.vital.core import Core
from iveg.vital.evidence import alert_line


class Alerting:
    """Raises, clears and acknowledges alerts, and records each step."""

    def __init__(self, core: Core) -> None:
        self._event_log, self._new_id = core.event_log, core.ports.new_id
        self._tell = core.supervision.tell
        self._book = AlertBook()

    @property
    def waiting(self) -> list[BookedAlert]:
        """Active alerts, and each P1 that cleared before anybody saw it."""
        return self._book.waiting

    def knows(self, alert_id: str) -> bool:
        """Whether an alert is of this run, active or recently cleared."""
        return self._book.find(alert_id) is not None

    def remember(self, earlier: Iterable[BookedAlert]) -> None:
        """Take up unacknowledged alerts of an earlier run."""
        self._book.remember(
            alert for alert in earlier if not self.knows(alert.alert_id)
        )
        self._event_log.changed(topics.ALERTS.name)

    def sync(self, conditions: Iterable[Condition], now: Instant) -> None:
        """Take the conditions that hold now."""
        changed = self._book.sync(conditions, now, self._new_id())
        for alert in changed:
            self._event_log.alert(alert)
            step = "raised" if alert.cleared is None else "cleared"
            self._event_log.log(alert_line(step, alert), now)
            if alert.condition.robot_id is not None:
                # The robot's situation rests on its alerts, so its card changes too.
                self._event_log.changed(topics.ROBOT.for_id(alert.condition.robot_id))
        raised = [alert for alert in changed if alert.cleared is None]
        if raised:
            self._tell("raised", raised)

    def acknowledge(
        self, alert_id: str, by: str, note: str, now: Instant
    ) -> BookedAlert | None:
        """Acknowledge an alert for a person; None when there is no such alert."""
        alert = self._book.acknowledge(alert_id, by, note, now)
        if alert is not None:
            self._event_log.alert(alert)
            self._event_log.log(alert_line("acknowledged", alert, by=by), now)
        return alert

    def acknowledge_together(
        self, alert_ids: Iterable[str], by: str, note: str, now: Instant
    ) -> list[BookedAlert]:
        """Acknowledge a list except its P1s; returns the alerts that changed.

        A P1 is about somebody in danger: it sounds until it is acknowledged singly.
        """
        alerts = (self._book.find(alert_id) for alert_id in alert_ids)
        lesser = [
            alert.alert_id
            for alert in alerts
            if alert is not None
            and alert.priority != "P1"
            and not alert.last.acknowledged
        ]
        changed = (self.acknowledge(alert_id, by, note, now) for alert_id in lesser)
        return [alert for alert in changed if alert is not None]
