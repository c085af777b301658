"""The journal of orders: the desired state of each robot, and each step of an order.

A file of JSON lines that are on disk before an order is accepted; it outlives a crash
of iVeg, a lost database and a full disk.  A repeated desired state is not
written.  The history copies the rows of orders by their revision;
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
# Names of the classes stand in the file: a renamed one would be skipped as unreadable.
_KINDS = {kind.__name__: kind for kind in RECORD_TYPES}
# As many as a robot remembers to have released (`RELEASED_KEPT` in `robot/holds.py`).
_NAMED_KEPT = 64
_LEAST_COMPACTED = 2**18
"""Smallest file that is compacted while iVeg runs (bytes)."""
_MOST_WAITING = 10_000
"""Lines that wait for another attempt after the disk refused them; the newest stay."""


@dataclass(frozen=True, slots=True)
class _DesiredLine:
    """One line of a robot's desired state; its fields are the keys of the file.

    Attributes:
        at: Time of the order (Unix s).
        named: Holds that a release is about to name; None in a line of the earlier
            version, where they are unknown.
        ch: The challenge of that release.
    """

    robot_id: str
    desired: Literal["stopped", "run"]
    by: str
    at: float = 0.0
    hold_id: str | None = None
    named: tuple[str, ...] | None = None
    ch: str | None = None


_DESIRED_LINE: Final = TypeAdapter(_DesiredLine)
_Line = _DesiredLine | Waiting


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
        self._robots: dict[str, _RobotLines] = defaultdict(_RobotLines)
        self._rows: dict[int, Waiting] = {}
        """Rows on disk that the history may not hold, by revision."""
        self._newest: dict[str, _DesiredLine] = {}
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
        self._robots, self._rows = defaultdict(_RobotLines), {}
        lines = 0
        for number, line in self._lines():
            lines += 1
            try:
                self._add(_read(line))
            except (KeyError, TypeError, ValueError):
                _log.warning("%s, line %d: not readable, skipped", self._path, number)
        if not self._is_newer:
            self._compact(lines)
        records = {name: robot.desired() for name, robot in self._robots.items()}
        return {name: record for name, record in records.items() if record is not None}

    def left(self) -> Sequence[Waiting]:
        """Rows of orders that the history may not hold."""
        return list(self._rows.values())

    def _lines(self) -> Iterator[tuple[int, bytes]]:
        if self._spilled is not None:
            yield from read_lines(self._spilled, FORM)
        try:
            yield from read_lines(self._path, FORM)
        except DataFileError as error:
            # Its lines are the best knowledge of which robots are to stand.
            _log.error("%s  The file is read all the same and left as it is.", error)
            self._is_newer = True
            yield from enumerate(
                self._path.read_bytes().rstrip(b"\0").splitlines()[1:], 2
            )

    def _add(self, line: _Line) -> None:
        if isinstance(line, Waiting):
            self._rows[line.revision] = line
        else:
            self._robots[line.robot_id].add(line)

    def _compact(self, lines: int) -> None:
        """Rewrite the file where fewer than its ``lines`` still count, and open it."""
        kept, spilled = self._kept_lines(), self._spilled
        has_spilled = spilled is not None and spilled.exists()
        try:
            if has_spilled or len(kept) < lines:
                self._file.rewrite(b"".join(kept))
            self._file.open()
            if has_spilled and spilled is not None:
                # Last: until the rewrite is on disk only this file has its rows.
                spilled.unlink()
                spilled.with_name(f"{spilled.name}-reserve").unlink(missing_ok=True)
        except OSError as error:
            _log.warning("the command journal could not be compacted: %s", error)

    def _kept_lines(self) -> list[bytes]:
        """Lines that still count."""
        lines: list[_Line] = []
        for robot in self._robots.values():
            lines += robot.lines()
        return [_write(line) for line in (*lines, *self._rows.values())]

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

        ``named``: holds that a release is about to name.  A disk that fails is logged
        and does not hold up the STOP.
        """
        self._waiting.append(
            _DesiredLine(
                robot_id, desired, by, at.wall, hold_id, tuple(named), challenge
            )
        )
        await self.flushed()

    def note(self, row: Waiting) -> None:
        """Have a row of an order written with the next flush."""
        self._waiting.append(row)

    async def flushed(self) -> None:
        """Return when all waiting lines are on disk; callers at once share a write."""
        async with self._lock:
            # One turn, so that a press and its steps go to the disk together.
            await asyncio.sleep(0)
            batch, self._waiting = self._waiting, []
            fresh = [line for line in batch if self._is_new(line)]
            is_written = not fresh
            try:
                if fresh:
                    lines = b"".join(map(_write, fresh))
                    await self._in_thread(self._file.append, lines)
                is_written = True
            except OSError:
                _log.exception("the command journal could not be written")
            finally:
                # A cancelled write counts as failed: a line written twice is harmless.
                if not is_written:
                    # Else these lines would not be new at the next attempt.
                    self._newest.clear()
                    self._waiting = [*batch, *self._waiting][-_MOST_WAITING:]
            if is_written:
                for line in fresh:
                    self._add(line)

    async def committed(self, revisions: Collection[int]) -> None:
        """Drop rows that the history holds, and compact the file where it grew."""
        async with self._lock:
            for revision in revisions:
                self._rows.pop(revision, None)
            self._waiting = [
                line
                for line in self._waiting
                if not isinstance(line, Waiting) or line.revision not in revisions
            ]
            if self._file.size < self._compacts_at or self._is_newer:
                return
            try:
                await self._in_thread(self._file.rewrite, b"".join(self._kept_lines()))
            except OSError as error:
                _log.warning("the command journal could not be compacted: %s", error)
            # Twice, so that rewriting stays rare however many lines still count.
            self._compacts_at = max(_LEAST_COMPACTED, 2 * self._file.size)

    def close(self) -> None:
        """End the thread and close the file."""
        self._thread.shutdown()
        self._file.close()

    async def _in_thread(self, work: Callable[[bytes], None], lines: bytes) -> None:
        await asyncio.wrap_future(self._thread.submit(work, lines))

    def _is_new(self, line: _Line) -> bool:
        """Whether a line changes the desired state; each row of an order counts as new.

        The audit has author and time of a repetition.
        """
        if isinstance(line, Waiting):
            return True
        facts = replace(line, by="", at=0.0)
        is_new = self._newest.get(line.robot_id) != facts
        self._newest[line.robot_id] = facts
        return is_new


def _write(line: _Line) -> bytes:
    if isinstance(line, _DesiredLine):
        return orjson.dumps(line) + b"\n"
    head = {"kind": type(line.record).__name__, "revision": line.revision}
    try:
        return orjson.dumps(head | {"record": asdict(line.record)}) + b"\n"
    except orjson.JSONEncodeError as error:
        # Left out: raised, it would keep the other lines of its batch off the disk.
        _log.error("the command journal cannot hold a %s: %s", head["kind"], error)
        return b""


def _read(line: bytes) -> _Line:
    entry: Json = orjson.loads(line)
    if "kind" not in entry:
        return _DESIRED_LINE.validate_python(entry)
    kind, members = _KINDS[entry["kind"]], entry["record"]
    # A record of another version may have fewer or more members.
    known = {key.name: members[key.name] for key in fields(kind) if key.name in members}
    return Waiting(kind(**known), int(entry["revision"]), 0.0)


class _RobotLines:
    """Content of one robot's lines so far."""

    def __init__(self) -> None:
        self._newest: _DesiredLine | None = None
        self._named: tuple[str, ...] = ()
        """Holds that a release has named, newest last."""
        self._release: _DesiredLine | None = None
        """The newest release, if nothing has confirmed it."""

    def add(self, line: _DesiredLine) -> None:
        """Take one more line into account."""
        if line.named is None:
            # A release may have named its hold, so that iVeg stops under a new id.
            line = replace(line, hold_id=None)
        self._newest, named = line, line.named or ()
        if named:
            self._release = line
            older = tuple(hold_id for hold_id in self._named if hold_id not in named)
            self._named = (*older, *named)[-_NAMED_KEPT:]
        if line.desired == "run":
            self._release = None

    def desired(self) -> DesiredRecord | None:
        """Desired state of a robot that is to stand; None where it may drive."""
        newest, release = self._newest, self._release
        if newest is None or newest.desired == "run":
            return None
        challenge = None if release is None else release.ch
        return DesiredRecord(
            newest.by, newest.hold_id, self._named, self._unconfirmed(), challenge
        )

    def lines(self) -> Iterator[_DesiredLine]:
        """The fewest lines with the same content."""
        if self._newest is None:
            return
        last, named = replace(self._newest, named=(), ch=None), self._unconfirmed()
        older = tuple(hold_id for hold_id in self._named if hold_id not in named)
        if older:
            # A line with `run` ends their release and keeps their names.
            yield replace(last, desired="run", hold_id=None, named=older)
        if self._release is not None:
            yield replace(last, named=named, ch=self._release.ch)
        yield last

    def _unconfirmed(self) -> tuple[str, ...]:
        """Holds that the unconfirmed release has named."""
        return () if self._release is None else self._release.named or ()
