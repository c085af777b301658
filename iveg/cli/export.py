"""``iveg export``: writes a list of the history to a file, page by page."""

import argparse
import asyncio
import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from iveg.adapters.database_check import check_database
from iveg.adapters.files import disk_errors
from iveg.adapters.history.engine import history_url
from iveg.adapters.history.lists import MOST_ROWS, Filter
from iveg.adapters.history.queries import Queries
from iveg.cli.arguments import CommandCall
from iveg.domain.errors import HopError, SettingsError
from iveg.domain.stamps import parse_stamp
from iveg.web.api.history import file_parts, lists_of


def run(call: CommandCall) -> int:
    """Write the file; returns the exit code.

    Raises:
        IvegError: it cannot be done.  Then no file is written.
    """
    options = call.options
    url = history_url(call.settings.database_url, call.data)
    since = _moment("--since", options.since)
    until = _moment("--until", options.until)
    if since is not None and until is not None and since > until:
        raise SettingsError("--since", options.since, "a moment before --until")
    filters = Filter(since=since, until=until, robot=options.robot, limit=MOST_ROWS)
    check_database(url)
    with (
        disk_errors("output" if options.out is None else "disk"),
        contextlib.closing(Queries(url)) as queries,
        _opened(options.out) as file,
    ):
        asyncio.run(_export(options, queries, filters, file))
    return 0


def _moment(option: str, text: str | None) -> float | None:
    if text is None:
        return None
    moment = parse_stamp(text)
    if moment is None:
        form = "a moment as ISO-8601, in UTC unless it says otherwise"
        raise SettingsError(option, text, form)
    return moment


@contextlib.contextmanager
def _opened(out: Path | None) -> Iterator[BinaryIO]:
    """Standard output, or a file that gets its name once it is whole."""
    if out is None:
        # A buffer of its own: a closed pipe fails here, and not at the exit of Python.
        with open(sys.stdout.fileno(), "wb", closefd=False) as file:
            yield file
        return
    if out.exists() and not out.is_file():
        # Replacing a pipe or a device would take it from the programs that use it.
        raise HopError("disk", f"{out} is there and no file")
    part = out.with_name(out.name + ".part")
    try:
        with part.open("wb") as file:
            yield file
        part.replace(out)
    finally:
        part.unlink(missing_ok=True)


async def _export(
    options: argparse.Namespace, queries: Queries, wanted: Filter, file: BinaryIO
) -> None:
    (row,) = (row for row in lists_of(queries) if row.path == options.list)
    pages = queries.pages(row.source, await queries.page(row.source, wanted), wanted)
    async for part in file_parts(row, pages, options.format, asyncio.to_thread):
        file.write(part)
