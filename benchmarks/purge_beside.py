"""Feedback while a million rows leave the history, beside ten robots.

    python -m benchmarks.purge_beside --rows 1000000 --robots 10 --hz 10

Real programs (``serve``, ``fiware``) and a fleet that only talks (``tests.fleet``).
Feedback goes out at 10 Hz and never below 5 Hz: a gap of more than 200 ms between two
of one robot is late.  Each database is measured twice: with rows of odometry that are
over, which the server takes by itself, and with nothing to purge.

``days``: PostgreSQL with a table for each day; ``before``: rows that were there before
that version, which go in batches, as on SQLite.
"""

import argparse
import asyncio
import contextlib
import re
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import aiomqtt
from sqlalchemy import Connection, func, insert, select, text

import iveg.pipeline.retention
from benchmarks.history_size import begin_at, own_database, run_alone
from benchmarks.process import machine, percentile, print_table
from iveg.adapters.broker_address import BrokerAddress
from iveg.adapters.history import tables
from iveg.adapters.history.day_partitions import prepare_days
from iveg.adapters.history.engine import reading_engine, sqlite_file, writing_engine
from iveg.adapters.history.migrate import upgrade
from iveg.cli import main as run_iveg
from iveg.domain.retention import DAY_S
from tests.fleet import names
from tests.processes import Site, site

KINDS = ("sqlite", "before", "days")
LATE_MS = 200.0
SETTLES_S, LOOK_S = 10.0, 5.0
"""Of the server's upkeep here, so that its purge is not waited for."""
AGE_DAYS = 40
LEAST_S = 20.0
"""Of listening, also where rows are gone at once."""
DELETED = re.compile(r'name="history_deleted"} (\d+)')


@dataclass
class Gaps:
    """Between two feedbacks of one robot (ms)."""

    last: dict[str, float] = field(default_factory=dict)
    found: list[float] = field(default_factory=list)

    def take(self, topic: str, at: float) -> None:
        """One feedback came (s, monotonic)."""
        if topic in self.last:
            self.found.append(1000.0 * (at - self.last[topic]))
        self.last[topic] = at

    def row(self) -> list[str]:
        """P50, P95, most, late."""
        rising = sorted(self.found)
        shares = (f"{percentile(rising, one):.0f}" for one in (0.5, 0.95, 1.0))
        return [*shares, f"{sum(one > LATE_MS for one in rising)} of {len(rising)}"]


def main() -> None:
    """Measure what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--hz", type=float, default=10.0)
    parser.add_argument("--most", type=float, default=120.0, help="seconds a run")
    parser.add_argument("--kinds", default=",".join(KINDS))
    asked = parser.parse_args()
    rows = []
    for kind in asked.kinds.split(","):
        for count in (asked.rows, 0):
            how = How(kind, count, asked.robots, asked.hz, asked.most)
            purged, took_s, gaps = _run(how)
            rows.append([kind, f"{purged:,}", f"{took_s:.0f}", *gaps.row()])
    head = ("history", "rows purged", "s", "P50 ms", "P95 ms", "most ms", "late")
    title = f"Between two feedbacks, {asked.robots} robots at {asked.hz:g} Hz"
    print_table(f"{title} ({machine()})", head, rows)


@dataclass(frozen=True, slots=True)
class How:
    """One run: a kind of history, rows that are over, the fleet, and its most time."""

    kind: str
    rows: int
    robots: int
    hz: float
    most_s: float


def _run(how: How) -> tuple[int, float, Gaps]:
    """Rows that went, the time of listening (s), and the gaps meanwhile."""
    with tempfile.TemporaryDirectory() as name, _database(how.kind, Path(name)) as url:
        _fill(url, how.kind, how.rows)
        fleet = ",".join(names(how.robots))
        settings = {"IVEG_DATABASE_URL": url, "IVEG_ROBOTS": fleet}
        settings |= {"IVEG_GREENHOUSE": "none", "IVEG_DIRECT_READ": "all"}
        with site(Path(name), **settings) as there:
            there.start("fiware")
            there.start("serve", module="benchmarks.purge_beside")
            there.wait_until_served()
            port = there.settings["IVEG_MQTT_URL"].rpartition(":")[2]
            words = "--port", port, "--robots", str(how.robots), "--hz", str(how.hz)
            there.start(*words, module="tests.fleet")
            there.wait_until_live(how.robots)
            took_s, gaps = asyncio.run(_listen(there, int(port), how))
        return how.rows - _left(url), took_s, gaps


@contextlib.contextmanager
def _database(kind: str, directory: Path) -> Iterator[str]:
    if kind == "sqlite":
        yield f"sqlite:///{directory / 'history.sqlite'}"
        return
    with own_database() as url:
        yield url


def _fill(url: str, kind: str, rows: int) -> None:
    """Odometry of one day that is over, and a line of the log each day since."""
    upgrade(url)
    engine = writing_engine(url)
    today = int(time.time() // DAY_S)
    old = today - AGE_DAYS
    with engine.begin() as connection:
        lines = [_line(day * DAY_S) for day in range(old, today)]
        connection.execute(insert(tables.log), lines)
        if kind == "days":
            begin_at(connection, "odometry", old)
            prepare_days(connection, old * DAY_S)
        if rows:
            _insert(connection, rows, old * DAY_S)
    if sqlite_file(url) is None:
        run_alone(engine, "ANALYZE")
    engine.dispose()


def _line(at: float) -> dict[str, object]:
    return {"id": int(at), "at": at, "kind": "system", "key": "log.history_kept"} | {
        "slots": {}
    }


def _insert(connection: Connection, rows: int, at: float) -> None:
    numbers = (
        "generate_series(1, :rows) AS n (n)"
        if connection.dialect.name == "postgresql"
        else "(WITH RECURSIVE n (n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM n "
        "WHERE n < :rows) SELECT n FROM n) AS n"
    )
    insertion = (
        "INSERT INTO odometry (at, robot_id, x, y, yaw, linear, angular, "  # noqa: S608 - one of two texts above
        "limit_factor, applied_factor, link, margin_m, late) SELECT :at + n * "
        ":apart_s, 'R01', 1.5, 2.5, 0, 0.5, 0, 1, 1, 'LIVE', 3.5, false "
        f"FROM {numbers}"
    )
    values = {"rows": rows, "at": at, "apart_s": 0.9 * DAY_S / rows}
    connection.execute(text(insertion), values)


def _left(url: str) -> int:
    """Rows that are over and still there."""
    engine = reading_engine(url)
    old = select(func.count()).where(tables.odometry.c.at < time.time() - 30 * DAY_S)
    with engine.connect() as connection:
        found = connection.scalar(old) or 0
    engine.dispose()
    return found


async def _listen(there: Site, port: int, how: How) -> tuple[float, Gaps]:
    """Hear feedback until the rows are gone, or for so long."""
    gaps = Gaps()
    address = BrokerAddress("127.0.0.1", port)
    async with aiomqtt.Client(address.host, address.port) as line:
        await line.subscribe("/+/mqtt_feedback")
        hearing = asyncio.create_task(_hear(line, gaps))
        began = time.monotonic()
        while True:
            await asyncio.sleep(1.0)
            gone = await asyncio.to_thread(_deleted, there)
            took_s = time.monotonic() - began
            is_over = gone >= how.rows and took_s >= LEAST_S
            if took_s >= how.most_s or (is_over and how.rows):
                break
        hearing.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await hearing
    return took_s, gaps


async def _hear(line: aiomqtt.Client, gaps: Gaps) -> None:
    async for message in line.messages:
        gaps.take(str(message.topic), time.monotonic())


def _deleted(there: Site) -> int:
    with there.api() as api:
        told = DELETED.search(api.get(f"{there.url}/metrics").text)
    return int(told[1]) if told else 0


def _serve() -> None:
    """``iveg serve`` whose upkeep begins at once."""
    iveg.pipeline.retention.SETTLES_S = SETTLES_S
    iveg.pipeline.retention.LOOK_S = LOOK_S
    sys.exit(run_iveg(["serve"]))


if __name__ == "__main__":
    _serve() if sys.argv[1:2] == ["serve"] else main()
