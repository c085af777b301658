"""``iveg db``: the schema and size of the history's database."""

from collections.abc import Iterable

from iveg.adapters.database_check import check_database
from iveg.adapters.history.engine import history_url, upgrade
from iveg.adapters.history.queries import ask_once
from iveg.adapters.history.upkeep import HistoryStats, TableStats, read_stats
from iveg.cli.arguments import CommandCall
from iveg.domain.stamps import format_stamp

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
    print(*_lines(ask_once(url, read_stats)), sep="\n")
    return 0


def _lines(stats: HistoryStats) -> Iterable[str]:
    rows = [_HEAD, *(_row(one) for one in stats.tables), _total(stats)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for first, *others in rows:
        cells = (
            one.rjust(width) for one, width in zip(others, widths[1:], strict=True)
        )
        yield "  ".join((first.ljust(widths[0]), *cells))
    yield f"{stats.robot_hours:.1f} robot-hours of odometry."


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
