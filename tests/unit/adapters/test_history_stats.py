"""The size of the history."""

from iveg.adapters.history.queries import ask_once
from iveg.adapters.history.upkeep import TableStats, read_stats
from tests.databases import remember
from tests.fakes.records import NOON, odometry_record


def test_each_table_is_counted_and_aged(database_url: str) -> None:
    remember(database_url, *(odometry_record(at=NOON + n) for n in range(600)))

    tables, size = ask_once(database_url, read_stats)

    assert TableStats("odometry", 600, NOON, NOON + 599.0) in tables
    assert TableStats("alerts", 0, None, None) in tables
    assert size > 50_000
