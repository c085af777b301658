"""Telemetry as a table for each day (UTC), on PostgreSQL alone.

What is over goes by dropping a table, in a moment, however many rows it had.
``odometry_20261125`` holds a day, ``odometry_before_20261125`` all that is older than
the first of them, and ``odometry_rest`` what came for a day without a table: no row is
refused for its time.
"""

from collections.abc import Sequence
from datetime import date

from sqlalchemy import Connection, text

from iveg.domain.retention import DAY_S

PARTITIONED = ("odometry", "detections")
"""Two rows a second of each robot, and of each subject that it sees; the others of a
day are thousands, which batches take in seconds."""
AHEAD_DAYS = 7
"""Tables are there so long before their day: an upkeep that fails is noticed first."""
_EPOCH = date(1970, 1, 1).toordinal()
_PATIENCE = "SET LOCAL lock_timeout = '200ms'"
"""Readers wait behind one who waits to drop or attach: not for longer than this."""
_PARTS = text(
    "SELECT inhrelid::regclass::text FROM pg_inherits "
    "WHERE inhparent = to_regclass(:name)"
)


def is_partitioned(connection: Connection, table: str) -> bool:
    """Whether each day of a table is one of its own."""
    return connection.dialect.name == "postgresql" and table in PARTITIONED


def days_of(connection: Connection, table: str) -> Sequence[int]:
    """Days (UTC, since 1970) that have a table of their own, oldest first."""
    if not is_partitioned(connection, table):
        return ()
    names = connection.scalars(_PARTS, {"name": table})
    ends = (name.removeprefix(f"{table}_") for name in names)
    return sorted(_day(end) for end in ends if end.isdecimal())


def prepare_days(connection: Connection, now: float) -> None:
    """Make the tables of today and of days to come, and of rows that found none.

    Args:
        connection: Of the one writer, in a transaction.
        now: The wall clock (Unix s).
    """
    first = int(now // DAY_S)
    end = first + AHEAD_DAYS + 1
    for table in PARTITIONED:
        if not is_partitioned(connection, table):
            return
        wanted = {*range(max(first, start_of(connection, table)), end)}
        missed = f"SELECT DISTINCT floor(at / {DAY_S})::integer FROM {table}_rest"  # noqa: S608 - names of ours
        wanted.update(connection.scalars(text(f"{missed} WHERE at < {end * DAY_S}")))
        for day in sorted(wanted.difference(days_of(connection, table))):
            _make(connection, table, day)


def drop_day(connection: Connection, table: str, before: float) -> int | None:
    """Drop the oldest day that is wholly over; None where there is none.

    Args:
        connection: Of the one writer, in a transaction.
        table: Which one.
        before: Rows that are older than this may go (Unix s).

    Returns:
        Number of rows that went.

    Raises:
        OperationalError: somebody reads the table for long.
    """
    oldest = next(iter(days_of(connection, table)), None)
    if oldest is None or (oldest + 1) * DAY_S > before:
        return None
    name = part_of(table, oldest)
    rows = connection.scalar(text(f"SELECT count(*) FROM {name}"))  # noqa: S608
    connection.execute(text(_PATIENCE))
    connection.execute(text(f"DROP TABLE {name}"))
    return rows or 0


def over_before(connection: Connection, table: str, before: float) -> float:
    """The moment before which rows go now: days go as a whole, older rows one by one.

    Args:
        connection: To the history.
        table: Which one.
        before: Rows that are older than this may go (Unix s).
    """
    if not is_partitioned(connection, table):
        return before
    start = start_of(connection, table) * DAY_S
    return max(before // DAY_S * DAY_S, min(before, start))


def start_of(connection: Connection, table: str) -> int:
    """The first day (UTC, since 1970) that can have a table of its own."""
    older = f"{table}_before_"
    names = connection.scalars(_PARTS, {"name": table})
    return max(
        (_day(name.removeprefix(older)) for name in names if name.startswith(older)),
        default=0,
    )


def _make(connection: Connection, table: str, day: int) -> None:
    name, since, until = part_of(table, day), day * DAY_S, (day + 1) * DAY_S
    for statement in (
        _PATIENCE,
        f"CREATE TABLE {name} (LIKE {table} INCLUDING DEFAULTS)",
        # A table cannot have a day of which the rest still has rows.
        f"WITH moved AS (DELETE FROM {table}_rest "  # noqa: S608 - as above
        f"WHERE at >= {since} AND at < {until} RETURNING *) "
        f"INSERT INTO {name} SELECT * FROM moved",
        f"ALTER TABLE {table} ATTACH PARTITION {name} "
        f"FOR VALUES FROM ({since}) TO ({until})",
    ):
        connection.execute(text(statement))


def part_of(table: str, day: int) -> str:
    """Name of the table of a day (UTC, since 1970)."""
    return f"{table}_{date.fromordinal(_EPOCH + day):%Y%m%d}"


def _day(digits: str) -> int:
    return date.fromisoformat(digits).toordinal() - _EPOCH
