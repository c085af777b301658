"""Pictures of the past: what pages were sent, found in files by its moment.

A file begins with a whole picture and has another every ten seconds; between two of
them, five times a second, stands what changed.
"""

import contextlib
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from iveg.adapters.recordings.directory import name_of
from iveg.adapters.recordings.mcap_file import FOREVER, Channel, read_messages
from iveg.domain.errors import DataFileError, HopError, NotRecordedError

PICTURES: Final = Channel("/iveg/pictures", "iveg.Picture")
WHOLE, CHANGED = b'{"whole":true,', b'{"whole":false,'
"""Beginnings of pictures."""
WHOLE_S: Final = 10.0
"""Between two whole pictures."""
PICTURES_S: Final = 300.0
"""Length of a file; short where the one that is written is read through."""
_NS: Final = 10**9
_GAP_S: Final = 2.0
"""Where there is no picture for longer, nothing was recorded."""
_SLACK_S: Final = 30.0
"""A name may differ so much from the first moment of its file (s)."""


class Pictures(NamedTuple):
    """A whole picture and the changes since, oldest first.

    Attributes:
        at: The moment of the newest (Unix s).
        payloads: As they were written.
    """

    at: float
    payloads: Sequence[bytes]


class PictureFiles:
    """The pictures of a folder; blocking.

    Args:
        folder: May be missing.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def by(self, wall: float) -> Pictures:
        """Pictures that lead to that of a moment (Unix s).

        Where the wall clock was set back, two files have the same moments: the one
        that began at the later time counts.

        Raises:
            NotRecordedError: there is none.
            HopError: the disk refuses.
        """
        try:
            return self._find(wall)
        except OSError as error:
            raise HopError("disk", error.strerror or str(error)) from error

    def _find(self, wall: float) -> Pictures:
        paths = self._near(wall)
        for path in reversed(paths):
            pictures = _chain(path, wall)
            if pictures is not None and wall - pictures.at <= _GAP_S:
                return pictures
        moments = [at / _NS for path in paths for at, _ in _messages(path)]
        before = max((at for at in moments if at <= wall), default=None)
        after = min((at for at in moments if at > wall), default=None)
        raise NotRecordedError(wall, before, after)

    def _near(self, wall: float) -> Sequence[Path]:
        """Files that may have a moment, with the last before and the first after."""
        paths = sorted(self._folder.glob("*.mcap*"))
        names = [path.name for path in paths]
        began = bisect_right(names, name_of(wall - PICTURES_S - _SLACK_S))
        begins_later = bisect_right(names, name_of(wall + _SLACK_S))
        return paths[max(0, began - 1) : begins_later + 1]


def _chain(path: Path, wall: float) -> Pictures | None:
    """The last whole picture by a moment and what follows; None: there is none.

    A damaged chunk breaks the chain: what follows it has lost its beginning.
    """
    chain: list[tuple[int, bytes]] = []
    # The moment itself counts.
    until = wall + 0.001
    for at, payload in _messages(path, wall - WHOLE_S - _GAP_S, until):
        if payload.startswith(WHOLE):
            chain.clear()
        if chain or payload.startswith(WHOLE):
            chain.append((at, payload))
    if not chain:
        return None
    moments, payloads = zip(*chain, strict=True)
    return Pictures(moments[-1] / _NS, payloads)


def _messages(
    path: Path, since: float = 0.0, until: float = FOREVER
) -> Iterator[tuple[int, bytes]]:
    """Moments (ns) and payloads of pictures, as far as a file can be read."""
    # A file that was finished meanwhile has another name.
    path = path if path.exists() else path.with_suffix("")
    with contextlib.suppress(DataFileError):
        for channel, at, payload in read_messages(path, since, until):
            if channel.topic == PICTURES.topic:
                yield at, payload
