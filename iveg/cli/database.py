"""``iveg db``: the schema and size of the history's database."""

from collections.abc import Iterable

from iveg.adapters.database_check import check_database
from iveg.adapters.history.engine import history_url, upgrade
from iveg.adapters.history.queries import ask_once
from iveg.adapters.history.upkeep import TableStats, read_stats
from iveg.cli.arguments import CommandCall
from iveg.domain.stamps import format_stamp


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
    tables, size = ask_once(url, read_stats)
    print(*_lines(tables), sep="\n")
    print(f"{size / 10**6:.1f} MB in all.")
    return 0


def _lines(tables: Iterable[TableStats]) -> Iterable[str]:
    stamp_width = len(format_stamp(0.0))
    yield f"{'table':<16}{'rows':>12}  {'oldest':<{stamp_width}}  newest"
    for one in tables:
        oldest, newest = _moment(one.oldest), _moment(one.newest)
        yield f"{one.name:<16}{one.rows:>12}  {oldest:<{stamp_width}}  {newest}"


def _moment(at: float | None) -> str:
    return "-" if at is None else format_stamp(at)
