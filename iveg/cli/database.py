"""``iveg db``: the schema, size and upkeep of the history's database."""

import asyncio
from collections.abc import Iterable
from functools import partial

from iveg.adapters import clock
from iveg.adapters.database_check import check_database
from iveg.adapters.history.ages import recorded_days
from iveg.adapters.history.asking import ask_once
from iveg.adapters.history.engine import history_url
from iveg.adapters.history.migrate import upgrade
from iveg.adapters.history.purge import count_due, purge_batch
from iveg.adapters.history.stats import HistoryStats, TableStats, read_stats
from iveg.adapters.history.store import Store
from iveg.adapters.history.vacuum import vacuum
from iveg.cli.arguments import CommandCall
from iveg.domain.retention import PURGE_STEPS, Cutoffs, PurgeStep, Retention
from iveg.domain.stamps import format_stamp

_PAUSE_S = 0.02
"""Between two batches: a server that records comes in between."""
_HEAD = ("table", "rows", "MB", "oldest", "newest", "bytes a robot-hour")


def run(call: CommandCall) -> int:
    """One action on the database; returns the exit code.

    Raises:
        IvegError: it cannot be done.
    """
    options, settings = call.options, call.settings
    url = history_url(settings.database_url, call.data)
    if options.action == "upgrade":
        call.data.mkdir(parents=True, exist_ok=True)
        upgrade(url)
        print("The database is up to date.")
        return 0
    check_database(url)
    if options.action == "stats":
        print(*_lines(ask_once(url, read_stats)), sep="\n")
    elif options.action == "purge":
        asyncio.run(_purge(url, settings.retention, dry_run=options.dry_run))
    else:
        vacuum(url)
        print("The room of deleted rows is given back.")
    return 0


async def _purge(url: str, retention: Retention, *, dry_run: bool) -> None:
    recorded = ask_once(url, recorded_days, retention.longest)
    cutoffs = retention.cutoffs(clock.wall(), recorded)
    store = Store(url)
    for step, before in _steps(cutoffs):
        if dry_run:
            rows = ask_once(url, count_due, step, before)
        else:
            rows = await _remove(store, step, before)
        done = "places of" if step.kind == "positions" else "rows of"
        print(f"{rows:>10} {done} {step.table} before {format_stamp(before)}")
    store.close()
    if dry_run:
        print("Nothing was deleted.")


def _steps(cutoffs: Cutoffs) -> Iterable[tuple[PurgeStep, float]]:
    return ((one, cutoffs[one.kind]) for one in PURGE_STEPS if one.kind in cutoffs)


async def _remove(store: Store, step: PurgeStep, before: float) -> int:
    rows = 0
    while True:
        batch = store.run(
            partial(purge_batch, step=step, before=before, stopwatch=clock.mono)
        )
        rows += batch.rows
        if batch.is_last:
            return rows
        await asyncio.sleep(_PAUSE_S)


def _lines(stats: HistoryStats) -> Iterable[str]:
    rows = [_HEAD, *(_row(one) for one in stats.tables), _total(stats)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for first, *others in rows:
        cells = (
            one.rjust(width) for one, width in zip(others, widths[1:], strict=True)
        )
        yield "  ".join((first.ljust(widths[0]), *cells))
    yield f"{stats.robot_hours:.1f} robot-hours of odometry."
    for one in stats.tables:
        if one.days:
            yield f"{one.name}: a table for each of {one.days} days."
    if stats.inside:
        yield f"{_megabytes(stats.inside)} MB of it are free for new rows."


def _row(one: TableStats) -> tuple[str, ...]:
    ages = (_moment(one.oldest), _moment(one.newest))
    return one.name, str(one.rows), _megabytes(one.size), *ages, _whole(one.hourly)


def _total(stats: HistoryStats) -> tuple[str, ...]:
    hourly = [one.hourly for one in stats.tables if one.hourly is not None]
    return (
        "all",
        str(sum(one.rows for one in stats.tables)),
        _megabytes(sum(one.size for one in stats.tables)),
        "",
        "",
        _whole(sum(hourly) if hourly else None),
    )


def _megabytes(size: int) -> str:
    return f"{size / 10**6:.1f}"


def _moment(at: float | None) -> str:
    return "-" if at is None else format_stamp(at)


def _whole(value: float | None) -> str:
    return "-" if value is None else f"{value:.0f}"
