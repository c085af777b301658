"""What is wanted of each robot, on disk before anybody is told that it was accepted.

An append-only file of JSON lines, flushed to the disk at each line; it outlives a
crash of iVeg and a lost database, and is read once at the start.
"""

import asyncio
import logging
import os
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any, Literal

import orjson

from iveg.domain.observations import Instant
from iveg.domain.stop import Wanted

_log = logging.getLogger(__name__)


_STOPPED = {"stopped": True, "run": False}
_NAMED_KEPT = 64
"""As many as a robot remembers to have released."""


class FileJournal:
    """The journal in one file; implements ``pipeline.ports.Journal``."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: IO[bytes] | None = None
        self._lock = asyncio.Lock()
        self._torn = False
        """The last line may be half written: the next one must not be glued to it."""

    def read(self) -> dict[str, Wanted]:
        """Robots that were to stand when iVeg last ran → what was wanted of them.

        A line that a crash cut short is skipped.
        """
        memory: dict[str, _Memory] = defaultdict(_Memory)
        try:
            lines = self._path.read_bytes().splitlines()
        except FileNotFoundError:
            return {}
        for number, line in enumerate(lines, 1):
            if not line:
                continue
            try:
                entry = orjson.loads(line)
                robot_id, by = str(entry["robot_id"]), str(entry["by"])
                stopped = _STOPPED[entry["desired"]]
                memory[robot_id].take(entry, by, stopped=stopped)
            except (orjson.JSONDecodeError, KeyError, TypeError):
                _log.warning("%s, line %d: not readable, skipped", self._path, number)
        return {
            robot_id: one.wanted
            for robot_id, one in memory.items()
            if one.wanted is not None
        }

    async def wanted(
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
        await self._write(robot_id, desired, hold_id, by, at, [], None)

    async def named(
        self,
        robot_id: str,
        hold_id: str,
        ids: Sequence[str],
        challenge: str,
        by: str,
        at: Instant,
    ) -> None:
        """Append what a release is about to name; likewise."""
        await self._write(robot_id, "stopped", hold_id, by, at, list(ids), challenge)

    async def _write(
        self,
        robot_id: str,
        desired: Literal["stopped", "run"],
        hold_id: str | None,
        by: str,
        at: Instant,
        named: list[str],
        challenge: str | None,
    ) -> None:
        line = orjson.dumps(
            {
                "at": at.wall,
                "robot_id": robot_id,
                "desired": desired,
                "hold_id": hold_id,
                "by": by,
                "named": named,
                "ch": challenge,
            }
        )
        async with self._lock:
            try:
                await asyncio.to_thread(self._append, line + b"\n")
            except OSError:
                _log.exception("the command journal could not be written")

    def _append(self, line: bytes) -> None:
        if self._file is None:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self._path.open("a+b", buffering=0)
            self._torn = not _ends_a_line(self._file)
        if self._torn:
            line = b"\n" + line
        self._torn = True
        written = self._file.write(line)
        os.fsync(self._file.fileno())
        if written != len(line):
            raise OSError(f"{written} of {len(line)} bytes written")
        self._torn = False

    def close(self) -> None:
        """Let the file go."""
        if self._file is not None:
            self._file.close()
            self._file = None


def _ends_a_line(file: IO[bytes]) -> bool:
    if file.seek(0, os.SEEK_END) == 0:
        return True
    file.seek(-1, os.SEEK_END)
    return file.read(1) == b"\n"


class _Memory:
    """What the lines of one robot have said so far."""

    def __init__(self) -> None:
        self.wanted: Wanted | None = None
        self._named: tuple[str, ...] = ()
        self._asked: tuple[str, ...] = ()
        self._challenge: str | None = None

    def take(self, entry: Mapping[str, Any], by: str, *, stopped: bool) -> None:
        """One line more."""
        # A line of the earlier version does not say what a release has named.
        told = entry.get("named")
        hold_id = None if told is None else entry["hold_id"]
        if told:
            self._asked, self._challenge = tuple(told), entry["ch"]
            fresh = tuple(one for one in self._named if one not in told)
            self._named = (*fresh, *told)[-_NAMED_KEPT:]
        if not stopped:
            self.wanted, self._asked, self._challenge = None, (), None
            return
        self.wanted = Wanted(by, hold_id, self._named, self._asked, self._challenge)
