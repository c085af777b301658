"""``iveg export``: a list of the history as a file, whatever its length."""

import argparse
import asyncio
import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from iveg.adapters.database_check import check_database
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
        IvegError: it cannot be done.  Then there is no file.
    """
    options = call.options
    url = history_url(call.settings.database_url, call.data)
    since = _moment("--since", options.since)
    until = _moment("--until", options.until)
    if since is not None and until is not None and since > until:
        raise SettingsError("--since", options.since, "a moment before --until")
    wanted = Filter(since=since, until=until, robot=options.robot, limit=MOST_ROWS)
    check_database(url)
    try:
        with contextlib.closing(Queries(url)) as queries, _opened(options.out) as file:
            asyncio.run(_export(options, queries, wanted, file))
    except OSError as error:
        hop = "output" if options.out is None else "disk"
        raise HopError(hop, error.strerror or str(error)) from error
    return 0


def _moment(option: str, text: str | None) -> float | None:
    if text is None:
        return None
    found = parse_stamp(text)
    if found is None:
        wanted = "a moment as ISO-8601, in UTC unless it says otherwise"
        raise SettingsError(option, text, wanted)
    return found


@contextlib.contextmanager
def _opened(out: Path | None) -> Iterator[BinaryIO]:
    """The output, or a file that takes its place once it is whole."""
    if out is None:
        # A buffer of its own: what a closed pipe left in it fails here, not at exit.
        with open(sys.stdout.fileno(), "wb", closefd=False) as file:
            yield file
        return
    if out.exists() and not out.is_file():
        # Whatever writes to it would find a file in its place.
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
    (one,) = (one for one in lists_of(queries) if one.path == options.list)
    first = await queries.page(one.source, wanted)
    pages = queries.pages(one.source, first, wanted)
    async for part in file_parts(one, pages, options.format, asyncio.to_thread):
        file.write(part)
