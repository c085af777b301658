"""A restart forgets no P1 that nobody saw."""

import asyncio
from typing import Any, cast

from iveg.adapters.history.lists import ALERTS, COMMANDS, ListOf
from iveg.adapters.history.queries import Queries
from iveg.app import remember
from iveg.domain.alerts import MOST_KEPT, read_alert
from iveg.domain.errors import HopError
from iveg.domain.records import AlertRecord
from tests.builders import at
from tests.fakes.records import alert_record
from tests.unit.vital.desk import Desk


class LeftBehind:
    """A history that answers at the n-th time that it is asked."""

    def __init__(
        self,
        alerts: tuple[AlertRecord, ...] = (),
        silent_times: int = 0,
    ) -> None:
        self._alerts = alerts
        self._silent_times = silent_times

    async def left_open(self, listed: ListOf[Any]) -> tuple[AlertRecord, ...]:
        if listed is ALERTS:
            return tuple(one for one in self._alerts if one.cleared_at is None)
        self._silent_times -= listed is COMMANDS
        if self._silent_times >= 0:
            raise HopError("database", "away")
        return ()

    async def unseen_alerts(self) -> tuple[AlertRecord, ...]:
        return self._alerts[:MOST_KEPT]


async def take_up(desk: Desk, left: LeftBehind) -> None:
    await remember(cast("Queries", left), desk.parts)


def unseen(alert_id: str, cleared_at: float | None = None) -> AlertRecord:
    return alert_record(
        alert_id=alert_id,
        priority="P1",
        cleared_at=cleared_at,
        acknowledged_at=None,
        acknowledged_by=None,
    )


async def test_unacknowledged_p1s_come_back_and_can_be_acknowledged() -> None:
    desk = Desk()
    await take_up(desk, LeftBehind((unseen("A1", at(-60).wall), unseen("A2"))))

    back = {one.alert_id for one in desk.evaluator.alerts.waiting}
    desk.evaluator.alerts.acknowledge("A1", "ana", "seen", desk.clock())

    assert back == {"A1", "A2"}
    assert [one.alert_id for one in desk.evaluator.alerts.waiting] == ["A2"]
    again = read_alert(desk.records(AlertRecord)[-1], at(5))
    assert (again.last.acknowledged_by, again.last.note) == ("ana", "seen")


def test_without_the_history_earlier_alerts_are_unknown_after_two_seconds() -> None:
    health_monitor = Desk().health_monitor

    said = [health_monitor.earlier(at(now)) for now in (0.0, 1.9, 2.0)]
    assert said == ["reading", "reading", "unknown"]


async def test_stop_serves_while_the_history_is_silent() -> None:
    desk = Desk()
    left = LeftBehind((unseen("A1"),), silent_times=10**6)
    waiting = asyncio.create_task(take_up(desk, left))

    await desk.commander.stop(["AGI"], "ana", desk.clock())

    waiting.cancel()
    assert desk.commander.machine("AGI").stop is not None
    assert not desk.health_monitor.earlier_read
