"""The journal of orders: what is wanted of each robot, and each step of an order.

A file of JSON lines that are on disk before an order is accepted; it outlives a crash
of iVeg, a lost database and a full disk.  A line of a robot's desired state that says
nothing new is not written.  The history copies the rows of orders by their revision;
once it holds them, the file is compacted to the lines that still count.
"""

import asyncio
import logging
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, fields
from pathlib import Path
from typing import Literal

import orjson

from iveg.adapters.files import Form, ReservedFile, read_lines
from iveg.domain.errors import DataFileError
from iveg.domain.observations import Instant
from iveg.domain.records import RECORD_TYPES, Json
from iveg.domain.stop import DesiredRecord
from iveg.vital.record import Waiting

_log = logging.getLogger(__name__)

FORM = Form("stop-journal")
_STOPPED = {"stopped": True, "run": False}
_Facts = tuple[str, str | None, tuple[str, ...], str | None]
_KINDS = {kind.__name__: kind for kind in RECORD_TYPES}
_NAMED_KEPT = 64
"""As many as a robot remembers to have released."""
_LEAST_COMPACTED = 2**18
"""Bytes: a smaller file is left as it is while iVeg runs."""
_MOST_WAITING = 10_000
"""Lines that a disk has refused are written again later: the newest of them."""


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
        self._newest: dict[str, _Facts] = {}
        """The facts of each robot's newest line of this run."""
        self._waiting: list[Json | Waiting] = []
        """What is not on disk yet, oldest first."""
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
                self._take(orjson.loads(line))
            except (KeyError, TypeError, ValueError):
                _log.warning("%s, line %d: not readable, skipped", self._path, number)
        if not self._is_newer:
            self._tidy(lines)
        return {
            robot_id: one.wanted
            for robot_id, one in self._memory.items()
            if one.wanted is not None
        }

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

    def _take(self, entry: Json) -> None:
        if "kind" in entry:
            row = _read_row(entry)
            self._rows[row.revision] = row
            return
        robot_id, stopped = str(entry["robot_id"]), _STOPPED[entry["desired"]]
        self._memory[robot_id].read_line(entry, str(entry["by"]), stopped=stopped)

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
        counting: list[Json | Waiting] = [
            entry
            for robot_id, one in self._memory.items()
            for entry in one.entries(robot_id)
        ]
        return [_line_of(one) for one in (*counting, *self._rows.values())]

    # --- while iVeg runs ----------------------------------------------------------

    async def log_desired(
        self,
        robot_id: str,
        desired: Literal["stopped", "run"],
        hold_id: str | None,
        by: str,
        at: Instant,
    ) -> None:
        """Append one line; returns when it is on disk.

        A disk that fails is logged and does not hold up the STOP.
        """
        self._waiting.append(_entry(robot_id, desired, hold_id, by, at.wall))
        await self.flushed()

    async def log_release(
        self,
        robot_id: str,
        hold_id: str,
        ids: Sequence[str],
        challenge: str,
        by: str,
        at: Instant,
    ) -> None:
        """Append the STOPs that a release is about to name; likewise."""
        entry = _entry(robot_id, "stopped", hold_id, by, at.wall, ids, challenge)
        self._waiting.append(entry)
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
                self._remember(fresh)

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

    def _is_news(self, one: Json | Waiting) -> bool:
        """Whether a line says anything new; each row of an order does."""
        if isinstance(one, Waiting):
            return True
        robot_id, facts = one["robot_id"], _facts_of(one)
        is_news = self._newest.get(robot_id) != facts
        self._newest[robot_id] = facts
        return is_news

    def _remember(self, written: Iterable[Json | Waiting]) -> None:
        for one in written:
            if isinstance(one, Waiting):
                self._rows[one.revision] = one
            else:
                self._take(one)


def _line_of(one: Json | Waiting) -> bytes:
    if not isinstance(one, Waiting):
        return orjson.dumps(one) + b"\n"
    head = {"kind": type(one.record).__name__, "revision": one.revision}
    try:
        return orjson.dumps(head | {"record": asdict(one.record)}) + b"\n"
    except orjson.JSONEncodeError as error:
        _log.error("the command journal cannot hold a %s: %s", head["kind"], error)
        return b""


def _read_row(entry: Json) -> Waiting:
    kind, members = _KINDS[entry["kind"]], entry["record"]
    known = {one.name: members[one.name] for one in fields(kind) if one.name in members}
    return Waiting(kind(**known), int(entry["revision"]), 0.0)


def _facts_of(entry: Json) -> _Facts:
    """What a line says of its robot; who said it again, and when, is in the audit."""
    return entry["desired"], entry["hold_id"], tuple(entry["named"]), entry["ch"]


def _entry(
    robot_id: str,
    desired: Literal["stopped", "run"],
    hold_id: str | None,
    by: str,
    wall: float,
    named: Sequence[str] = (),
    challenge: str | None = None,
) -> dict[str, object]:
    return {
        "at": wall,
        "robot_id": robot_id,
        "desired": desired,
        "hold_id": hold_id,
        "by": by,
        "named": list(named),
        "ch": challenge,
    }


class _Memory:
    """The content of one robot's lines so far."""

    def __init__(self) -> None:
        self.wanted: DesiredRecord | None = None
        self._by, self._at = "", 0.0
        self._named: tuple[str, ...] = ()
        self._asked: tuple[str, ...] = ()
        self._challenge: str | None = None

    def read_line(self, entry: Json, by: str, *, stopped: bool) -> None:
        """Read one line more."""
        # A line of the earlier version does not say what a release has named.
        named = entry.get("named")
        hold_id = None if named is None else entry["hold_id"]
        self._by, self._at = by, entry.get("at", 0.0)
        if named:
            self._asked, self._challenge = tuple(named), entry["ch"]
            fresh = tuple(one for one in self._named if one not in named)
            self._named = (*fresh, *named)[-_NAMED_KEPT:]
        if not stopped:
            self.wanted, self._asked, self._challenge = None, (), None
            return
        self.wanted = DesiredRecord(
            by, hold_id, self._named, self._asked, self._challenge
        )

    def entries(self, robot_id: str) -> Iterator[dict[str, object]]:
        """The fewest lines with the same content."""
        by, at, hold_id = self._by, self._at, None
        if self.wanted is not None:
            hold_id = self.wanted.hold_id
        older = [one for one in self._named if one not in self._asked]
        if older:
            # Named, and since then over.
            yield _entry(robot_id, "run", None, by, at, older)
        if self._asked:
            asked = self._asked
            yield _entry(robot_id, "stopped", hold_id, by, at, asked, self._challenge)
        desired: Literal["stopped", "run"] = "run" if self.wanted is None else "stopped"
        yield _entry(robot_id, desired, hold_id, by, at)
