"""Lists and charts of a robot's day in a large history on PostgreSQL.

    python -m benchmarks.history_size --rows 1000000,10000000

Telemetry of 250,000 rows a robot and day (odometry twice a second, and detections),
of at most 20 robots, is made on the server; log and decisions come on top.  Each
question of the history's routes is asked as the server asks it (``Queries``), of the
middle day, each time of another robot.  Goal: 300 ms at 100 million rows.

``--url`` keeps the database, and goes on with days that are there; else a server of its
own is started.  ``--explain`` prints what PostgreSQL does for each question.
"""

import argparse
import asyncio
import contextlib
import time
from collections.abc import Awaitable, Callable, Iterator, Mapping
from dataclasses import replace

from sqlalchemy import Connection, Engine, event, text
from sqlalchemy.engine.interfaces import DBAPICursor

from benchmarks.process import machine, percentile, print_table
from iveg.adapters.history import cursors, listings
from iveg.adapters.history.ages import lost_of
from iveg.adapters.history.command_latencies import command_latencies
from iveg.adapters.history.confidence import confidence_counts
from iveg.adapters.history.cost import cost_rows
from iveg.adapters.history.day_partitions import (
    PARTITIONED,
    days_of,
    part_of,
    start_of,
)
from iveg.adapters.history.engine import writing_engine
from iveg.adapters.history.lists import Filter
from iveg.adapters.history.migrate import upgrade
from iveg.adapters.history.places import people_seen, poses_of
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.series import speed_series
from iveg.domain.retention import DAY_S
from tests.fakes.postgresql import programs, running_postgresql

A_DAY = {"odometry": 172_800, "detections": 77_200, "log": 5_000, "decisions": 1_000}
"""Rows of one robot."""
MOST_ROBOTS = 20
PLACED_DAYS = 7
GOAL_MS = 300
Question = Callable[[Queries, Filter, float], Awaitable[object]]
"""Asked of the history, about a robot's day, which begins then (Unix s)."""

# i: number of the row in its robot's day; r: number of the robot; :at, :first of the
# day (Unix s; row id).  Numbers are floats throughout: numeric ones are slow.
_ROWS = {
    "odometry": """
INSERT INTO {into} (row_id, at, robot_id, x, y, yaw, linear, angular, limit_factor,
  applied_factor, link, margin_m)
SELECT :first + i * :robots + r, :at + i * 0.5::float8 + r * 0.02::float8,
  (ARRAY[{names}])[r + 1], i % 977 / 20::float8, (i + r * 13) % 991 / 20::float8, 1.5,
  CASE WHEN i % 40 < 4 THEN 0 ELSE 0.5::float8 END, 0, factor, factor, 'LIVE',
  CASE WHEN i % 400 = 7 THEN -0.1::float8 ELSE 3 + i % 50 / 10::float8 END
FROM generate_series(0, :rows - 1) i, generate_series(0, :robots - 1) r,
  LATERAL (SELECT CASE WHEN (i + r * 997) % 2400 < 120 THEN 0.5::float8 ELSE 1 END)
    AS slow (factor)""",
    "detections": """
INSERT INTO {into} (row_id, at, robot_id, class_id, probability, x, y, z, confident,
  transport, stamp, class, person_id)
SELECT :first + i * :robots + r, :at + i * (86400 / 77200::float8) + r * 0.02::float8,
  (ARRAY[{names}])[r + 1],
  (ARRAY['person', 'human', 'robot', 'crate', 'crate'])[i % 5 + 1],
  0.3::float8 + i % 70 / 100::float8, CASE WHEN :placed THEN i % 977 / 20::float8 END,
  CASE WHEN :placed THEN i % 991 / 20::float8 END, CASE WHEN :placed THEN 0.9 END,
  i % 70 >= 20, 'fiware', '2026-11-25T10:42:07.123Z',
  (ARRAY['person', 'person', 'robot'])[i % 5 + 1],
  CASE WHEN i % 5 < 2 THEN 'P' || i / 600 END
FROM generate_series(0, :rows - 1) i, generate_series(0, :robots - 1) r""",
    "log": """
INSERT INTO log (id, at, kind, key, slots, robot_id, class)
SELECT :first + i * :robots + r, :at + i * 17.28::float8,
  (ARRAY['detection', 'speed'])[i % 2 + 1], 'log.detection',
  CASE WHEN :placed THEN '{{"x": 1.5, "y": 2.5, "confidence": 0.9}}'
    ELSE '{{"confidence": 0.9}}' END::jsonb, (ARRAY[{names}])[r + 1], 'person'
FROM generate_series(0, :rows - 1) i, generate_series(0, :robots - 1) r""",
    "decisions": """
INSERT INTO decisions (decision_id, kind, robot_id, started_at, person_id, class,
  confidence, x, y, distance_m, reason, rule_parameters, ended_at, links, revision)
SELECT 'D' || (:first + i * :robots + r), 'mandate', (ARRAY[{names}])[r + 1],
  :at + i * 86.4::float8, 'P' || i, 'person', 0.9, CASE WHEN :placed THEN 1.5 END,
  CASE WHEN :placed THEN 2.5 END, 1.25, 'person', '{{"radius_m": 2.0}}'::jsonb,
  :at + i * 86.4::float8 + 5, '[]'::jsonb, 1
FROM generate_series(0, :rows - 1) i, generate_series(0, :robots - 1) r""",
}


async def _charts(queries: Queries, asked: Filter, since: float) -> object:
    """All that the page's charts of a robot ask, at once, as ``/figures`` does."""
    charts = (one for name, one in QUESTIONS.items() if name.startswith("*"))
    return await asyncio.gather(*(one(queries, asked, since) for one in charts))


async def _evening(queries: Queries, _: Filter, since: float) -> object:
    """What the evening sheet asks for most."""
    await queries.ask(poses_of, since, since + DAY_S)
    return await queries.ask(people_seen, since, since + DAY_S)


QUESTIONS: Mapping[str, Question] = {
    "odometry": lambda q, f, _: q.page(listings.ODOMETRY, f),
    "odometry, 1000 in the middle": lambda q, f, at: q.page(
        listings.ODOMETRY,
        replace(f, limit=1000, cursor=cursors.Cursor(at + DAY_S / 2, 0)),
    ),
    "odometry, oldest first": lambda q, f, _: q.page(
        listings.ODOMETRY, replace(f, sort="at")
    ),
    "odometry, newest of all days": lambda q, f, _: q.page(
        listings.ODOMETRY, Filter(robot=f.robot)
    ),
    "detections": lambda q, f, _: q.page(listings.DETECTIONS, f),
    "detections of a class": lambda q, f, _: q.page(
        listings.DETECTIONS, replace(f, class_="robot")
    ),
    "detections of no class": lambda q, f, _: q.page(
        listings.DETECTIONS, replace(f, class_="bird")
    ),
    "detections, 90 % at least": lambda q, f, _: q.page(
        listings.DETECTIONS, replace(f, min_probability=0.9)
    ),
    "tracks of a person": lambda q, f, _: q.page(
        listings.TRACKS, replace(f, person="P64")
    ),
    "decisions": lambda q, f, _: q.page(listings.DECISIONS, f),
    "log": lambda q, f, _: q.page(listings.LOG, f),
    "log of no class": lambda q, f, _: q.page(listings.LOG, replace(f, class_="bird")),
    "log by kind": lambda q, f, _: q.page(listings.LOG, replace(f, sort="kind")),
    "commands": lambda q, f, _: q.page(listings.COMMANDS, f),
    "alerts": lambda q, f, _: q.page(listings.ALERTS, f),
    "* speed": lambda q, f, at: q.ask(speed_series, at, at + DAY_S, f.robot),
    "* confidence": lambda q, f, at: q.ask(confidence_counts, at, at + DAY_S, f.robot),
    "* STOPs": lambda q, f, at: q.ask(command_latencies, at, at + DAY_S, f.robot),
    "the three charts at once": _charts,
    "what is lost of the day": lambda q, _, at: q.ask(lost_of, at, at + DAY_S),
}
FLEET: Mapping[str, Question] = {
    "speed of all robots": lambda q, _, at: q.ask(speed_series, at, at + DAY_S),
    "confidence of all robots": lambda q, _, at: q.ask(
        confidence_counts, at, at + DAY_S
    ),
    "odometry of all robots": lambda q, f, _: q.page(
        listings.ODOMETRY, replace(f, robot=None)
    ),
    "cost": lambda q, f, at: q.ask(cost_rows, at, at + DAY_S, {str(f.robot): 0.5}),
    "evening sheet": _evening,
}
"""Of all robots' day: told beside, without a goal."""


def main() -> None:
    """Measure what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", default="1000000")
    parser.add_argument("--url", help="a database that stays")
    parser.add_argument("--tries", type=int, default=20)
    parser.add_argument("--explain", action="store_true")
    parser.add_argument("--fleet", action="store_true", help="questions of all robots")
    asked = parser.parse_args()
    for rows in map(int, asked.rows.split(",")):
        with contextlib.nullcontext(asked.url) if asked.url else own_database() as url:
            days = max(1, rows // (MOST_ROBOTS * 250_000))
            robots = max(1, rows // (days * 250_000))
            fill(url, robots, days)
            questions = FLEET if asked.fleet else QUESTIONS
            times = asyncio.run(
                measure(url, robots, days, asked.tries, questions, asked.explain)
            )
            print_table(
                f"{rows:,} rows, {robots} robots, {days} days; {machine()}",
                ("question", "P50 ms", "P95 ms", "most ms"),
                [
                    (name, *(f"{percentile(one, p):.1f}" for p in (0.5, 0.95, 1.0)))
                    for name, one in times.items()
                ],
            )


@contextlib.contextmanager
def own_database() -> Iterator[str]:
    """An empty database of a server that ends with it."""
    bin_ = programs()
    if bin_ is None:
        raise SystemExit("PostgreSQL is not installed.")
    with running_postgresql(bin_) as server:
        yield server.empty_database()


def robot_names(robots: int) -> list[str]:
    """Ids of robots."""
    return [f"R{n:02d}" for n in range(robots)]


def first_day(days: int) -> int:
    """The first of so many days that end yesterday (UTC, since 1970)."""
    return int(time.time() // DAY_S) - days


def fill(url: str, robots: int, days: int) -> None:
    """Make what is not there yet."""
    upgrade(url)
    engine = writing_engine(url)
    start = first_day(days)
    for table in PARTITIONED:
        with engine.begin() as connection:
            begin_at(connection, table, start)
    for day in range(start, start + days):
        began = time.monotonic()
        with engine.begin() as connection:
            has = {table: day in days_of(connection, table) for table in PARTITIONED}
            if all(has.values()):
                continue
            for table in PARTITIONED:
                if not has[table]:
                    _fill_day(connection, table, day, robots, start)
            for table in ("log", "decisions"):
                _insert(connection, table, table, day, robots, start)
        for table in PARTITIONED:
            run_alone(engine, f"VACUUM (ANALYZE) {part_of(table, day)}")
        print(f"day {day - start + 1} of {days}: {time.monotonic() - began:.0f} s")
    for table in ("log", "decisions"):
        run_alone(engine, f"VACUUM (ANALYZE) {table}")
    engine.dispose()


def begin_at(connection: Connection, table: str, day: int) -> None:
    """Have days since this one, where a new database has those since today."""
    before = f"{table}_before"
    older, wanted = (part_of(before, one) for one in (start_of(connection, table), day))
    if older == wanted:
        return
    for statement in (
        f"ALTER TABLE {table} DETACH PARTITION {older}",
        f"ALTER TABLE {older} RENAME TO {wanted}",
        f"ALTER TABLE {table} ATTACH PARTITION {wanted} "
        f"FOR VALUES FROM (MINVALUE) TO ({day * DAY_S})",
    ):
        connection.execute(text(statement))


def _fill_day(
    connection: Connection, table: str, day: int, robots: int, start: int
) -> None:
    part = part_of(table, day)
    if connection.scalar(text("SELECT to_regclass(:name)"), {"name": part}) is None:
        copy = f"CREATE TABLE {part} (LIKE {table} INCLUDING DEFAULTS)"
        connection.execute(text(copy))
        _insert(connection, table, part, day, robots, start)
    connection.execute(
        text(
            f"ALTER TABLE {table} ATTACH PARTITION {part} "
            f"FOR VALUES FROM ({day * DAY_S}) TO ({(day + 1) * DAY_S})"
        )
    )


def _insert(
    connection: Connection, table: str, into: str, day: int, robots: int, start: int
) -> None:
    rows = A_DAY[table]
    names = ", ".join(f"'{one}'" for one in robot_names(robots))
    values = {
        "at": day * DAY_S,
        "first": (day - start) * rows * robots + 1,
        "rows": rows,
        "robots": robots,
        "placed": day >= first_day(PLACED_DAYS),
    }
    connection.execute(text(_ROWS[table].format(into=into, names=names)), values)


def run_alone(engine: Engine, statement: str) -> None:
    """Outside of a transaction: what autovacuum does, which may not have come yet."""
    with engine.connect() as connection:
        alone = connection.execution_options(isolation_level="AUTOCOMMIT")
        alone.exec_driver_sql(statement)


async def measure(
    url: str,
    robots: int,
    days: int,
    tries: int,
    questions: Mapping[str, Question],
    explain: bool,
) -> dict[str, list[float]]:
    """Milliseconds of each question, rising; the first try of each does not count."""
    queries = Queries(url)
    since = (first_day(days) + days // 2) * DAY_S
    names = robot_names(robots)
    times: dict[str, list[float]] = {}
    for name, question in questions.items():
        took = []
        for n in range(-1, tries):
            robot = names[n % robots]
            asked = Filter(since=since, until=since + DAY_S, robot=robot)
            explains = explain and n < 0
            began = time.perf_counter()
            with explained(name) if explains else contextlib.nullcontext():
                await question(queries, asked, since)
            if n >= 0:
                took.append(1000 * (time.perf_counter() - began))
        times[name] = sorted(took)
    queries.close()
    return times


@contextlib.contextmanager
def explained(name: str) -> Iterator[None]:
    """Print what PostgreSQL does for each statement within."""

    def explain(
        _: Connection,
        cursor: DBAPICursor,
        statement: str,
        parameters: Mapping[str, object],
        *_others: object,
    ) -> None:
        if statement.startswith("SELECT"):
            cursor.execute(f"EXPLAIN (ANALYZE, BUFFERS) {statement}", parameters)
            print(f"\n{name}\n{' '.join(statement.split())[:300]}")
            print(*(line for (line,) in cursor.fetchall()), sep="\n")

    event.listen(Engine, "before_cursor_execute", explain)
    try:
        yield
    finally:
        event.remove(Engine, "before_cursor_execute", explain)


if __name__ == "__main__":
    main()
