"""``iveg export``: a list of the history as a file, whatever its length."""

import argparse
import asyncio
import contextlib
import os
import sys
from collections.abc import Callable, Coroutine
from datetime import UTC, datetime
from functools import partial
from typing import Any, BinaryIO

from iveg.adapters.database_check import check_database
from iveg.adapters.history.engine import history_url
from iveg.adapters.history.lists import MOST_ROWS, Filter
from iveg.adapters.history.queries import Queries
from iveg.cli.arguments import CommandCall
from iveg.domain.errors import HopError, SettingsError
from iveg.domain.stamps import parse_stamp
from iveg.web.api import exports
from iveg.web.api.history import HistoryList, lists_of
from iveg.web.api.history_filters import NO_DAY, is_kept

_MOMENT = "a moment as ISO-8601, in UTC unless it says otherwise"


def run(call: CommandCall) -> int:
    """Write the file; returns the exit code.

    Raises:
        IvegError: it cannot be done.  Then there is no file.
    """
    options = call.options
    url = history_url(call.settings.database_url, call.data)
    since = _moment("--since", options.since)
    until = _moment("--until", options.until)
    if since is not None and until is not None and since > until:
        raise SettingsError("--since", options.since, "a moment before --until")
    asked = Filter(since=since, until=until, robot=options.robot, limit=MOST_ROWS)
    check_database(url)
    with contextlib.closing(Queries(url)) as queries:
        _write(options, queries, asked)
    return 0


def _moment(option: str, text: str | None) -> float | None:
    if text is None:
        return None
    found = parse_stamp(text)
    if found is None:
        raise SettingsError(option, text, _MOMENT)
    if not _is_of_history(found):
        raise SettingsError(option, text, f"{_MOMENT}; that is {NO_DAY}")
    return found


def _is_of_history(moment: float) -> bool:
    try:
        return is_kept(datetime.fromtimestamp(moment, UTC).date())
    except (OverflowError, ValueError):
        return False


def _write(options: argparse.Namespace, queries: Queries, asked: Filter) -> None:
    (one,) = (one for one in lists_of(queries) if one.path == options.list)
    work = partial(_export, queries, one, asked, options.format)
    if options.out is None:
        _print(work)
        return
    if options.out.exists() and not options.out.is_file():
        # Whatever writes to it would find a file in its place.
        raise HopError("disk", f"{options.out} is there and no file")
    part = options.out.with_name(options.out.name + ".part")
    try:
        with part.open("wb") as file:
            asyncio.run(work(file))
        part.replace(options.out)
    except OSError as error:
        raise HopError("disk", error.strerror or str(error)) from error
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def _print(work: Callable[[BinaryIO], Coroutine[Any, Any, None]]) -> None:
    try:
        asyncio.run(work(sys.stdout.buffer))
        sys.stdout.buffer.flush()
    except OSError as error:
        # What is left in the buffer would fail once more when the program ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise HopError("output", error.strerror or str(error)) from error


async def _export(
    queries: Queries, one: HistoryList[Any], asked: Filter, form: str, file: BinaryIO
) -> None:
    first = await queries.page(one.of, asked)
    if form == "csv":
        file.write(exports.csv_head(one.of.kind))
    async for records in queries.pages(one.of, first, asked):
        if form == "csv":
            file.write(exports.csv_rows(one.of.kind, records))
        else:
            file.write(exports.ndjson_rows(one.model, await one.rows(records)))
