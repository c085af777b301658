"""The journal of STOP: each robot's desired state, on disk before it is accepted.

A file of JSON lines, flushed to the disk at each; it outlives a crash of iVeg and a
lost database.  It is read once, at the start, and then rewritten with the lines that
still count; a line that says nothing new of its robot is not written, so that nobody
who presses STOP for ever makes it grow for ever.
"""

import asyncio
import logging
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Literal

import orjson

from iveg.adapters.files import AppendedFile, Form, read_lines, write_lines
from iveg.domain.errors import DataFileError
from iveg.domain.observations import Instant
from iveg.domain.records import Json
from iveg.domain.stop import DesiredRecord

_log = logging.getLogger(__name__)

FORM = Form("stop-journal")
_STOPPED = {"stopped": True, "run": False}
_Facts = tuple[str, str | None, tuple[str, ...], str | None]
_NAMED_KEPT = 64
"""As many as a robot remembers to have released."""


class FileJournal:
    """The journal in one file; implements ``pipeline.ports.Journal``."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file = AppendedFile(path, FORM)
        self._lock = asyncio.Lock()
        self._is_newer = False
        # Of its own: the default threads may all be busy with files of comfort.
        self._thread = ThreadPoolExecutor(1, "stop-journal")
        self._newest: dict[str, _Facts] = {}
        """The facts of each robot's newest line of this run."""

    def read(self) -> dict[str, DesiredRecord]:
        """Robots that were to stand when iVeg last ran, with their desired state.

        A line that a crash cut short is skipped.  The file is compacted unless a newer
        iVeg wrote it.
        """
        memory: dict[str, _Memory] = defaultdict(_Memory)
        lines = 0
        for number, line in self._lines():
            lines += 1
            try:
                entry = orjson.loads(line)
                robot_id, by = str(entry["robot_id"]), str(entry["by"])
                stopped = _STOPPED[entry["desired"]]
                memory[robot_id].read_line(entry, by, stopped=stopped)
            except (orjson.JSONDecodeError, KeyError, TypeError):
                _log.warning("%s, line %d: not readable, skipped", self._path, number)
        if not self._is_newer:
            self._compact(memory, lines)
        return {
            robot_id: one.wanted
            for robot_id, one in memory.items()
            if one.wanted is not None
        }

    def _lines(self) -> Iterator[tuple[int, bytes]]:
        try:
            yield from read_lines(self._path, FORM)
        except DataFileError as error:
            # Its lines are still the best that is known of what is to stand.
            _log.error("%s  It is read all the same and left as it is.", error)
            self._is_newer = True
            yield from enumerate(self._path.read_bytes().splitlines()[1:], 2)

    def _compact(self, memory: Mapping[str, "_Memory"], lines: int) -> None:
        kept = [
            entry for robot_id, one in memory.items() for entry in one.entries(robot_id)
        ]
        if len(kept) >= lines:
            return
        try:
            write_lines(self._path, FORM, kept)
        except OSError as error:
            _log.warning("the command journal could not be compacted: %s", error)

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
        await self._write(_entry(robot_id, desired, hold_id, by, at.wall))

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
        await self._write(entry)

    async def _write(self, entry: Json) -> None:
        robot_id, facts = entry["robot_id"], _facts_of(entry)
        async with self._lock:
            if self._newest.pop(robot_id, None) != facts:
                try:
                    loop = asyncio.get_running_loop()
                    await loop.run_in_executor(self._thread, self._file.append, entry)
                except OSError:
                    _log.exception("the command journal could not be written")
                    return
            self._newest[robot_id] = facts

    def close(self) -> None:
        """Let thread and file go."""
        self._thread.shutdown()
        self._file.close()


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
