"""The journal of orders: the desired state of each robot, and each step of an order.

A file of JSON lines that are on disk before an order is accepted; it outlives a crash
of iVeg, a lost database and a full disk.  A line of a robot's desired state that says
nothing new is not written.  The history copies the rows of orders by their revision;
once it holds them, the file is compacted to the lines that still count.
"""

import asyncio
import logging
from collections import defaultdict
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Final, Literal

import orjson
from pydantic import TypeAdapter

from iveg.adapters.files import Form, ReservedFile, read_lines
from iveg.domain.errors import DataFileError
from iveg.domain.observations import Instant
from iveg.domain.records import RECORD_TYPES, Json
from iveg.domain.stop import DesiredRecord
from iveg.vital.record import Waiting

_log = logging.getLogger(__name__)

FORM = Form("stop-journal")
_KINDS = {kind.__name__: kind for kind in RECORD_TYPES}
_NAMED_KEPT = 64
"""As many as a robot remembers to have released."""
_LEAST_COMPACTED = 2**18
"""Bytes: a smaller file is left as it is while iVeg runs."""
_MOST_WAITING = 10_000
"""Lines that a disk has refused are written again later: the newest of them."""


@dataclass(frozen=True, slots=True)
class _Wish:
    """One line of a robot's desired state.

    Attributes:
        named: Holds that a release is about to name; None in a line of the earlier
            version, which does not say what a release has named.
        ch: The challenge of that release.
    """

    robot_id: str
    desired: Literal["stopped", "run"]
    by: str
    at: float = 0.0
    hold_id: str | None = None
    named: tuple[str, ...] | None = None
    ch: str | None = None


_WISH: Final = TypeAdapter(_Wish)
_Line = _Wish | Waiting


class FileJournal:
    """The journal in one file; implements ``vital.ports.StopJournal``.

    Args:
        path: The file.
        spilled: Rows that an earlier version left for its history, taken over once.
    """

    def __init__(self, path: Path, spilled: Path | None = None) -> None:
        self._path = path
        self._spilled = spilled
        self._file = ReservedFile(path, FORM)
        self._lock = asyncio.Lock()
        self._is_newer = False
        # Of its own: the default threads may all be busy with files of comfort.
        self._thread = ThreadPoolExecutor(1, "stop-journal")
        self._memory: dict[str, _Memory] = defaultdict(_Memory)
        self._rows: dict[int, Waiting] = {}
        """Rows on disk that the history may not hold, by revision."""
        self._newest: dict[str, _Wish] = {}
        """Each robot's newest line of this run, without its author and time."""
        self._waiting: list[_Line] = []
        """Lines that are not on disk yet, oldest first."""
        self._compacts_at = _LEAST_COMPACTED

    # --- at the start -------------------------------------------------------------

    def read(self) -> dict[str, DesiredRecord]:
        """Robots that were to stand when iVeg last ran, with their desired state.

        A line that a crash cut short is skipped.  The file is compacted unless a newer
        iVeg wrote it.
        """
        self._memory, self._rows = defaultdict(_Memory), {}
        lines = 0
        for number, line in self._lines():
            lines += 1
            try:
                self._take(_read(line))
            except (KeyError, TypeError, ValueError):
                _log.warning("%s, line %d: not readable, skipped", self._path, number)
        if not self._is_newer:
            self._tidy(lines)
        found = {name: memory.wanted() for name, memory in self._memory.items()}
        return {name: wanted for name, wanted in found.items() if wanted is not None}

    def left(self) -> Sequence[Waiting]:
        """Rows of orders that the history may not hold."""
        return list(self._rows.values())

    def _lines(self) -> Iterator[tuple[int, bytes]]:
        if self._spilled is not None:
            yield from read_lines(self._spilled, FORM)
        try:
            yield from read_lines(self._path, FORM)
        except DataFileError as error:
            # Its lines are still the best that is known of what is to stand.
            _log.error("%s  It is read all the same and left as it is.", error)
            self._is_newer = True
            yield from enumerate(
                self._path.read_bytes().rstrip(b"\0").splitlines()[1:], 2
            )

    def _take(self, line: _Line) -> None:
        if isinstance(line, Waiting):
            self._rows[line.revision] = line
        else:
            self._memory[line.robot_id].take(line)

    def _tidy(self, lines: int) -> None:
        fewest, spilled = self._fewest(), self._spilled
        has_spilled = spilled is not None and spilled.exists()
        try:
            if has_spilled or len(fewest) < lines:
                self._file.rewrite(b"".join(fewest))
            self._file.open()
            if has_spilled and spilled is not None:
                spilled.unlink()
                spilled.with_name(f"{spilled.name}-reserve").unlink(missing_ok=True)
        except OSError as error:
            _log.warning("the command journal could not be compacted: %s", error)

    def _fewest(self) -> list[bytes]:
        """The lines that still count."""
        lines: list[_Line] = []
        for memory in self._memory.values():
            lines += memory.lines()
        return [_line_of(line) for line in (*lines, *self._rows.values())]

    # --- while iVeg runs ----------------------------------------------------------

    async def log_desired(
        self,
        robot_id: str,
        desired: Literal["stopped", "run"],
        hold_id: str | None,
        by: str,
        at: Instant,
        *,
        named: Sequence[str] = (),
        challenge: str | None = None,
    ) -> None:
        """Append one line; returns when it is on disk.

        ``named``: STOPs that a release is about to name.  A disk that fails is logged
        and does not hold up the STOP.
        """
        wish = _Wish(robot_id, desired, by, at.wall, hold_id, tuple(named), challenge)
        self._waiting.append(wish)
        await self.flushed()

    def note(self, row: Waiting) -> None:
        """Have a row of an order written with what is flushed next."""
        self._waiting.append(row)

    async def flushed(self) -> None:
        """Return when all that waits is on disk; who asks at once shares one write."""
        async with self._lock:
            # One turn, so that a press and its steps go to the disk together.
            await asyncio.sleep(0)
            batch, self._waiting = self._waiting, []
            fresh = [one for one in batch if self._is_news(one)]
            is_written = not fresh
            try:
                if fresh:
                    lines = b"".join(_line_of(one) for one in fresh)
                    await self._in_thread(self._file.append, lines)
                is_written = True
            except OSError:
                _log.exception("the command journal could not be written")
            finally:
                # Cancelled half-way counts as not written: twice is harmless.
                if not is_written:
                    self._newest.clear()
                    self._waiting = [*batch, *self._waiting][-_MOST_WAITING:]
            if is_written:
                for line in fresh:
                    self._take(line)

    async def committed(self, revisions: Collection[int]) -> None:
        """Let go of rows that the history holds, and compact the file where it grew."""
        async with self._lock:
            for one in revisions:
                self._rows.pop(one, None)
            self._waiting = [
                one
                for one in self._waiting
                if not isinstance(one, Waiting) or one.revision not in revisions
            ]
            if self._file.size < self._compacts_at or self._is_newer:
                return
            try:
                fewest = b"".join(self._fewest())
                await self._in_thread(self._file.rewrite, fewest)
            except OSError as error:
                _log.warning("the command journal could not be compacted: %s", error)
            self._compacts_at = max(_LEAST_COMPACTED, 2 * self._file.size)

    def close(self) -> None:
        """Let thread and file go."""
        self._thread.shutdown()
        self._file.close()

    async def _in_thread(self, work: Callable[[bytes], None], lines: bytes) -> None:
        await asyncio.get_running_loop().run_in_executor(self._thread, work, lines)

    def _is_news(self, line: _Line) -> bool:
        """Whether a line says anything new; each row of an order does.

        The audit has who said it again, and when.
        """
        if isinstance(line, Waiting):
            return True
        facts = replace(line, by="", at=0.0)
        is_news = self._newest.get(line.robot_id) != facts
        self._newest[line.robot_id] = facts
        return is_news


def _line_of(line: _Line) -> bytes:
    if isinstance(line, _Wish):
        return orjson.dumps(line) + b"\n"
    head = {"kind": type(line.record).__name__, "revision": line.revision}
    try:
        return orjson.dumps(head | {"record": asdict(line.record)}) + b"\n"
    except orjson.JSONEncodeError as error:
        _log.error("the command journal cannot hold a %s: %s", head["kind"], error)
        return b""


def _read(line: bytes) -> _Line:
    entry: Json = orjson.loads(line)
    if "kind" not in entry:
        return _WISH.validate_python(entry)
    kind, members = _KINDS[entry["kind"]], entry["record"]
    known = {one.name: members[one.name] for one in fields(kind) if one.name in members}
    return Waiting(kind(**known), int(entry["revision"]), 0.0)


class _Memory:
    """The content of one robot's lines so far."""

    def __init__(self) -> None:
        self._newest: _Wish | None = None
        self._named: tuple[str, ...] = ()
        self._release: _Wish | None = None
        """The newest release, if nothing has confirmed it."""

    def take(self, wish: _Wish) -> None:
        """Read one line more."""
        if wish.named is None:
            # A release may have named its hold.
            wish = replace(wish, hold_id=None)
        self._newest, named = wish, wish.named or ()
        if named:
            self._release = wish
            fresh = tuple(one for one in self._named if one not in named)
            self._named = (*fresh, *named)[-_NAMED_KEPT:]
        if wish.desired == "run":
            self._release = None

    def wanted(self) -> DesiredRecord | None:
        """The desire that the robot stands; None where it may drive."""
        newest, release = self._newest, self._release
        if newest is None or newest.desired == "run":
            return None
        challenge = None if release is None else release.ch
        return DesiredRecord(
            newest.by, newest.hold_id, self._named, self._asked(), challenge
        )

    def lines(self) -> Iterator[_Wish]:
        """The fewest lines with the same content."""
        if self._newest is None:
            return
        last = replace(self._newest, named=(), ch=None)
        older = tuple(one for one in self._named if one not in self._asked())
        if older:
            # Named, and since then over.
            yield replace(last, desired="run", hold_id=None, named=older)
        if self._release is not None:
            yield replace(last, named=self._asked(), ch=self._release.ch)
        yield last

    def _asked(self) -> tuple[str, ...]:
        """Holds that the open release has named."""
        return () if self._release is None else self._release.named or ()
