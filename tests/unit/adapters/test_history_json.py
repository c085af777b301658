"""What is JSON is kept as JSON, also what the version before kept as a text."""

from collections.abc import Iterator

import pytest
from alembic import command
from sqlalchemy import text

from iveg.adapters.history import lists
from iveg.adapters.history.engine import alembic_config, upgrade, writing_engine
from iveg.adapters.history.lists import Filter
from iveg.adapters.history.queries import Queries

BEFORE = "keep_readings"
OLD_ROWS = (
    "INSERT INTO decisions (decision_id, kind, robot_id, started_at, rule_parameters,"
    " links, revision) VALUES ('D1', 'mandate', 'AGI', 1.0, '{\"radius_m\": 2.0}',"
    ' \'[{"link": "detection", "verdict": "ok"}]\', 1)',
    "INSERT INTO detections (at, robot_id, class_id, probability, x, y, z, confident,"
    " road, box) VALUES (1.0, 'AGI', 'farmer', 0.9, 1.0, 2.0, 0.9, true, 'mqtt',"
    ' \'{"xmin": -4.0, "frame_id": "map"}\'), '
    "(2.0, 'AGI', 'farmer', 0.9, 1.0, 2.0, 0.9, true, 'orion', NULL)",
    "INSERT INTO odometry (at, robot_id, x, y, yaw, linear, angular, mandated_factor,"
    " link) VALUES (1.0, 'AGI', 0.0, 0.0, 0.0, 0.8, 0.0, 0.5, 'LIVE')",
    "INSERT INTO alerts (alert_id, priority, key, raised_at, last_raised_at, slots,"
    " members, count, revision) VALUES ('A1', 'P2', 'alert.robot_lost', 1.0, 1.0,"
    ' \'{"robot": "AGI"}\', \'[{"priority": "P2", "raised_at": 1.0}]\', 1, 1)',
    "INSERT INTO commands (command_id, robot_id, kind, state, requested_by,"
    " requested_at, sent_fiware_at, sent_direct_at, answer_direct_at, tries, revision)"
    " VALUES ('C1', 'AGI', 'stop', 'STANDING', 'ana', 1700000000.123456,"
    " 1700000000.223456, 1700000000.133457, 1700000000.153, 1, 1)",
    "INSERT INTO log (id, at, kind, key, slots) VALUES "
    "(1, 1.0, 'speed', 'log.speed_up', '{\"robot\": \"Túnel\"}'), "
    "(2, 2.0, 'speed', 'log.speed_up', '{\"factor\": NaN}'), "
    "(3, 3.0, 'speed', 'log.speed_up', '[\"a list\"]')",
)


@pytest.fixture
def old(empty_url: str) -> str:
    """A history that the version before wrote, with rows that are spoilt."""
    engine = writing_engine(empty_url)
    with engine.begin() as connection:
        command.upgrade(alembic_config(connection), BEFORE)
        for row in OLD_ROWS:
            connection.execute(text(row.replace(":", "\\:")))
    engine.dispose()
    return empty_url


@pytest.fixture
def queries(empty_url: str) -> Iterator[Queries]:
    queries = Queries(empty_url)
    yield queries
    queries.close()


async def test_rows_of_the_version_before_read_as_values(
    old: str, queries: Queries
) -> None:
    upgrade(old)

    [decision] = (await queries.page(lists.DECISIONS, Filter())).items
    [unboxed, boxed] = (await queries.page(lists.DETECTIONS, Filter())).items
    [alert] = (await queries.page(lists.ALERTS, Filter())).items
    [another, spoilt, line] = (await queries.page(lists.LOG, Filter())).items
    [order] = (await queries.page(lists.COMMANDS, Filter())).items
    assert order.sent_at == {"fiware": 1700000000.223456, "direct": 1700000000.133457}
    assert order.answer_at == {"direct": 1700000000.153}
    assert decision.rule_parameters == {"radius_m": 2.0}
    assert list(decision.links) == [{"link": "detection", "verdict": "ok"}]
    assert (boxed.transport, unboxed.transport) == ("direct", "fiware")
    assert (boxed.box, unboxed.box) == ({"xmin": -4.0, "frame_id": "map"}, None)
    assert alert.slots == {"robot": "AGI"}
    assert line.slots == {"robot": "Túnel"}
    assert spoilt.slots == another.slots == {}
