"""Pictures of the past: what pages were sent, found in files by its moment.

A file begins with a whole picture and has another every ten seconds; between two of
them, five times a second, stands what changed.  Chunks are passed over by their heads,
so that the file that is still written is read like all others.
"""

import contextlib
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Final, NamedTuple

from mcap.records import Chunk, Message
from mcap.stream_reader import StreamReader

from iveg.adapters.recordings.directory import NAME
from iveg.adapters.recordings.incoming import CHANGED, WHOLE, WHOLE_S
from iveg.adapters.recordings.mcap_file import BROKEN, LONGEST_RECORD, unpack
from iveg.adapters.recordings.writer import PICTURES_S
from iveg.domain.errors import HopError, NotRecordedError

_NS = 10**9
_GAP_NS: Final = 2 * _NS
"""Where there is no picture for longer, nothing was recorded."""
_REACH_NS: Final = 2 * round(WHOLE_S) * _NS
_SLACK_S: Final = 30.0
"""A name may differ so much from the first moment of its file (s)."""
_MOST_KNOWN = 64


class Pictures(NamedTuple):
    """A whole picture and the changes since, oldest first.

    Attributes:
        at: The moment of the newest (Unix s).
        payloads: As they were written.
        is_twice: Whether another file has this moment, too.
    """

    at: float
    payloads: Sequence[bytes]
    is_twice: bool


class _Place(NamedTuple):
    """A chunk: its first and last moment (ns), and where it begins in the file."""

    first: int
    last: int
    offset: int

    def read(self, path: Path) -> Iterable[tuple[int, bytes]]:
        """Moment and payload of its pictures; raises one of ``BROKEN``."""
        with path.open("rb") as stream:
            stream.seek(self.offset)
            chunk = next(iter(_records(stream, is_inside=True)))
        for record in unpack(chunk) if isinstance(chunk, Chunk) else ():
            if not isinstance(record, Message):
                continue
            if record.data.startswith((WHOLE, CHANGED)):
                yield record.log_time, record.data


@dataclass(slots=True)
class _File:
    """Chunks of one file, which may grow."""

    chunks: list[_Place] = field(default_factory=list)
    behind: int = 0
    """Where the next record begins (bytes)."""

    def look(self, path: Path) -> None:
        """Find chunks that were added; what is cut off is looked for again."""
        with path.open("rb") as stream:
            stream.seek(self.behind)
            try:
                for record in _records(stream, is_inside=self.behind > 0):
                    if isinstance(record, Chunk):
                        first, last = record.message_start_time, record.message_end_time
                        self.chunks.append(_Place(first, last, self.behind))
                    self.behind = stream.tell()
            except BROKEN:
                return

    def pictures(self, path: Path, at: int) -> list[tuple[int, bytes]]:
        """Moment and payload of the last whole picture by ``at`` and of what follows.

        A damaged chunk breaks the chain: what follows it has lost its beginning.
        """
        found: list[tuple[int, bytes]] = []
        for place in self.chunks:
            if place.last < at - _REACH_NS or place.first > at:
                continue
            try:
                for moment, payload in place.read(path):
                    if moment > at:
                        break
                    if payload.startswith(WHOLE):
                        found.clear()
                    elif not found:
                        continue
                    found.append((moment, payload))
            except BROKEN:
                found.clear()
        return found

    def moments(self, path: Path, at: int) -> Iterable[int]:
        """Moments of pictures, among them the nearest before and after ``at``."""
        for place in self.chunks:
            yield from (place.first, place.last)
            if place.first <= at <= place.last:
                with contextlib.suppress(*BROKEN):
                    yield from [moment for moment, _ in place.read(path)]

    @property
    def first(self) -> int:
        """The first moment (ns)."""
        return self.chunks[0].first

    @property
    def last(self) -> int:
        """The last moment so far (ns)."""
        return self.chunks[-1].last


class PictureFiles:
    """The pictures of a folder; blocking, for one thread at a time.

    Args:
        folder: May be missing.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._known: dict[tuple[str, int], _File] = {}
        """By name and inode, which a file keeps when it is finished."""

    def by(self, wall: float) -> Pictures:
        """Pictures that lead to that of a moment (Unix s).

        Where the wall clock was set back, two files have the same moments: the one
        that began at the later time counts.

        Raises:
            NotRecordedError: there is none.
            HopError: the disk refuses.
        """
        # A file that was finished meanwhile has another name.
        with contextlib.suppress(OSError):
            return self._find(wall)
        try:
            return self._find(wall)
        except OSError as error:
            raise HopError("disk", error.strerror or str(error)) from error

    def _find(self, wall: float) -> Pictures:
        at = round(wall * _NS)
        after, files = self._near(wall)
        for path, file in reversed(files):
            pictures = file.pictures(path, at) if file.first <= at else []
            if pictures and at - pictures[-1][0] <= _GAP_NS:
                holding = sum(one.first <= at <= one.last for _, one in files)
                payloads = [payload for _, payload in pictures]
                return Pictures(pictures[-1][0] / _NS, payloads, holding > 1)
        known = [one for path, file in files for one in file.moments(path, at)]
        before = max((one / _NS for one in known if one <= at), default=None)
        after = min((one / _NS for one in known if one > at), default=after)
        raise NotRecordedError(wall, before, after)

    def _near(self, wall: float) -> tuple[float | None, list[tuple[Path, _File]]]:
        """When the next file begins, and the files that may have a moment.

        With the last before, whose end is the beginning of a gap.
        """
        paths = {
            path.name.partition(".mcap")[0]: path
            for ends in ("*.mcap.open", "*.mcap")
            for path in self._folder.glob(ends)
        }
        stems = sorted(paths)
        behind = bisect_right(stems, _stem(wall + _SLACK_S))
        begins = bisect_left(stems, _stem(wall - PICTURES_S - _SLACK_S))
        found = []
        for stem in stems[min(begins, max(0, behind - 1)) : behind]:
            path = paths[stem]
            file = self._known.setdefault((stem, path.stat().st_ino), _File())
            file.look(path)
            if file.chunks:
                found.append((path, file))
        while len(self._known) > _MOST_KNOWN:
            del self._known[next(iter(self._known))]
        after = _begin_of(stems[behind]) if behind < len(stems) else None
        return after, sorted(found, key=lambda one: one[1].first)


def _records(stream: object, *, is_inside: bool) -> Iterable[object]:
    reader = StreamReader(
        stream,  # type: ignore[arg-type]
        skip_magic=is_inside,
        emit_chunks=True,
        record_size_limit=LONGEST_RECORD,
    )
    return reader.records


def _stem(wall: float) -> str:
    """Name that the file of a moment (Unix s) would have."""
    return datetime.fromtimestamp(wall, UTC).strftime(NAME)


def _begin_of(stem: str) -> float | None:
    """The first moment of a file by its name (Unix s); None of a strange one."""
    try:
        day, hour = stem.split("T")
        return datetime.fromisoformat(f"{day}T{hour.replace('-', ':')}").timestamp()
    except ValueError:
        return None
