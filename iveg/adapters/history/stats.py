"""Size of the history: rows, bytes and ages of each table."""

from dataclasses import dataclass

from sqlalchemy import Connection, Integer, Table, cast, func, select, text
from sqlalchemy.exc import OperationalError

from iveg.adapters.history.tables import AGES, metadata, odometry

_MINUTE_S, _HOUR_S = 60.0, 3600.0
_PAGES_OF = """
SELECT m.tbl_name, sum(d.pgsize) FROM dbstat AS d JOIN sqlite_master AS m USING (name)
WHERE d.aggregate = TRUE GROUP BY m.tbl_name
"""
_SIZE_OF = text(
    "SELECT sum(pg_total_relation_size(one)) FROM ("
    "SELECT to_regclass(:name)::oid "
    "UNION SELECT relid FROM pg_partition_tree(to_regclass(:name))) AS parts (one)"
)


@dataclass(frozen=True, slots=True)
class TableStats:
    """Size of one table with its indexes.

    Attributes:
        size: (bytes); where SQLite does not say, the table's share of all rows.
        oldest: (Unix s); None of an empty table, as ``newest``.
        hourly: Bytes for each hour of each robot, of rows since the oldest odometry;
            None without any.
    """

    name: str
    rows: int
    size: int
    oldest: float | None
    newest: float | None
    hourly: float | None


@dataclass(frozen=True, slots=True)
class HistoryStats:
    """Size of the history.

    Attributes:
        tables: The largest first.
        robot_hours: Hours in which odometry of a robot came, of all robots.
    """

    tables: tuple[TableStats, ...]
    robot_hours: float


def read_stats(connection: Connection) -> HistoryStats:
    """Measure the history; reads all of it."""
    counted = {one: _count(connection, one) for one in metadata.sorted_tables}
    sizes = _sizes(connection, {one.name: n for one, n in counted.items()})
    hours = _robot_hours(connection)
    since = connection.scalar(select(func.min(odometry.c.at)))
    found = [
        _stats(connection, table, rows, sizes.get(table.name, 0), since, hours)
        for table, rows in counted.items()
    ]
    return HistoryStats(tuple(sorted(found, key=lambda one: -one.size)), hours)


def _count(connection: Connection, table: Table) -> int:
    return connection.scalar(select(func.count()).select_from(table)) or 0


def _stats(
    connection: Connection,
    table: Table,
    rows: int,
    size: int,
    since: float | None,
    hours: float,
) -> TableStats:
    at = AGES[table.name]
    oldest, newest = (
        connection.scalar(select(one(at))) for one in (func.min, func.max)
    )
    hourly = None
    if hours and rows:
        recent = connection.scalar(select(func.count()).where(at >= since)) or 0
        hourly = size / rows * recent / hours
    return TableStats(table.name, rows, size, oldest, newest, hourly)


def _robot_hours(connection: Connection) -> float:
    # Rounded, not cut, on PostgreSQL: still one for each minute.
    minute = cast(odometry.c.at / _MINUTE_S, Integer)
    each = select(odometry.c.robot_id, minute).distinct().subquery()
    minutes = connection.scalar(select(func.count()).select_from(each)) or 0
    return minutes * _MINUTE_S / _HOUR_S


def _sizes(connection: Connection, rows: dict[str, int]) -> dict[str, int]:
    if connection.dialect.name == "postgresql":
        return {n: int(connection.scalar(_SIZE_OF, {"name": n}) or 0) for n in rows}
    try:
        return {row[0]: row[1] for row in connection.execute(text(_PAGES_OF))}
    except OperationalError:
        # Some builds of SQLite have no size of each table.
        pages, page = (
            connection.exec_driver_sql(f"PRAGMA {one}").scalar() or 0
            for one in ("page_count", "page_size")
        )
        total = max(1, sum(rows.values()))
        return {name: int(pages) * int(page) * n // total for name, n in rows.items()}
