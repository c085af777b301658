from dataclasses import replace
from typing import Any

import pytest

from iveg.adapters.history import lists
from iveg.adapters.history.lists import Cursor, Filter, read_cursor, write_cursor
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.series import AIR, SPEEDS, series_of
from iveg.domain.errors import UnreadableError
from iveg.domain.records import DetectionRecord, Record
from tests.databases import remember
from tests.fakes.records import (
    NOON,
    alert_record,
    climate_record,
    command_record,
    decision_record,
    detection_record,
    log_record,
    odometry_record,
)


async def detections(queries: Queries, asked: Filter) -> list[DetectionRecord]:
    """Every page, one after the other."""
    page = await queries.page(lists.DETECTIONS, asked)
    found = list(page.items)
    while page.next is not None:
        page = await queries.page(lists.DETECTIONS, replace(asked, cursor=page.next))
        found += page.items
    return found


async def test_what_was_stored_comes_back_as_it_was(
    queries: Queries, database_url: str
) -> None:
    stored: dict[lists.ListOf[Any], Record] = {
        lists.ALERTS: alert_record(),
        lists.COMMANDS: command_record(),
        lists.DECISIONS: decision_record(),
        lists.DETECTIONS: detection_record(),
        lists.LOG: log_record(),
    }
    remember(database_url, *stored.values())

    for listed, record in stored.items():
        assert (await queries.page(listed, Filter())).items == (record,)


async def test_pages_hold_every_row_once_though_times_are_equal_and_rows_arrive(
    queries: Queries, database_url: str
) -> None:
    rows = [detection_record(at=NOON + n // 4, x=float(n)) for n in range(25)]
    remember(database_url, *rows)

    first = await queries.page(lists.DETECTIONS, Filter(limit=7))
    remember(database_url, detection_record(at=NOON + 99.0, x=99.0))
    rest = await detections(queries, Filter(limit=7, cursor=first.next))

    assert [*first.items, *rest] == rows[::-1]


@pytest.mark.parametrize(
    ("asked", "xs"),
    [
        (Filter(robot="AGII"), [2.0]),
        (Filter(class_="farmer"), [1.0]),
        (Filter(class_="crate"), [2.0]),
        (Filter(min_probability=0.8), [1.0]),
        (Filter(min_probability=0.81), []),
        (Filter(person="P1"), [1.0]),
        (Filter(robot="AGI' OR 1=1 --"), []),
    ],
)
async def test_filters_leave_what_was_asked_for(
    queries: Queries, database_url: str, asked: Filter, xs: list[float]
) -> None:
    remember(
        database_url,
        detection_record(x=1.0, probability=0.8, person_id="P1"),
        detection_record(
            x=2.0, robot_id="AGII", class_=None, class_id="crate", probability=0.3
        ),
    )

    assert [row.x for row in await detections(queries, asked)] == xs


@pytest.mark.parametrize(
    "text",
    [
        "é",
        "e30",
        "WzEsMl0",
        write_cursor(Cursor(NOON, "D1")),
        write_cursor(Cursor(NOON, 2**63)),
    ],
)
def test_a_cursor_of_nobody_or_of_another_list_is_refused(text: str) -> None:
    with pytest.raises(UnreadableError):
        read_cursor(text, lists.DETECTIONS)


async def test_what_goes_on_is_found_by_its_last_row(
    queries: Queries, database_url: str
) -> None:
    going_on = (
        command_record(command_id="S1", state="STANDING"),
        command_record(command_id="S2", state="READY", requested_at=NOON + 1.0),
        command_record(command_id="R1", kind="release", state="RELEASING"),
    )
    refused_or_over = (
        command_record(command_id="S3", state="REPLACED"),
        command_record(command_id="S4", state="RUNNING"),
        command_record(command_id="R2", kind="release", state="STANDING"),
        command_record(command_id="R3", kind="resume", state="EXPIRED"),
    )
    remember(database_url, *going_on, *refused_or_over)
    remember(
        database_url,
        decision_record(),
        decision_record(decision_id="D2", ended_at=NOON + 2.0),
        alert_record(),
        alert_record(alert_id="A2", cleared_at=NOON + 2.0),
    )

    found = await queries.left_open(lists.COMMANDS)

    assert [row.command_id for row in found] == ["R1", "S1", "S2"]
    assert await queries.left_open(lists.DECISIONS) == (decision_record(),)
    assert await queries.left_open(lists.ALERTS) == (alert_record(),)


async def test_a_long_series_is_thinned_and_keeps_a_short_slow_down(
    queries: Queries, database_url: str
) -> None:
    rows = [odometry_record(at=NOON + n / 2, linear=1.0) for n in range(5000)]
    rows[2500] = replace(rows[2500], limit_factor=0.5)
    remember(database_url, *rows)

    found = await queries.ask(series_of, SPEEDS, NOON, NOON + 2500)

    series = found["AGI",]
    assert 1000 < len(series.at) <= 2000
    assert list(series.at) == sorted(series.at)
    assert series.values["limit_factor"].count(0.5) == 1
    assert set(series.values["linear"]) == {1.0}
    assert series.slice_s == 1.25


async def test_a_day_of_the_air_is_means_of_five_minutes(
    queries: Queries, database_url: str
) -> None:
    rows = [climate_record(at=NOON + 60 * n, co2=400 + n % 5) for n in range(1440)]
    remember(database_url, *rows)

    found = await queries.ask(series_of, AIR, NOON, NOON + 86_400)

    air = found[()]
    assert (len(air.at), air.slice_s) == (288, 300.0)
    assert set(air.values["co2"]) == {402.0}
