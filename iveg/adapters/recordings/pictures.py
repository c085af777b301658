"""Pictures of the past: data that pages were sent, found in files by time.

A file begins with a whole picture and has another every ten seconds.  Five times a
second between them it has the changes.
"""

import contextlib
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from iveg.adapters.files import disk_errors
from iveg.adapters.recordings.directory import file_name
from iveg.adapters.recordings.mcap_file import FOREVER, Channel, read_messages
from iveg.domain.errors import DataFileError, NotRecordedError

PICTURES: Final = Channel("/iveg/pictures", "iveg.Picture")
WHOLE, CHANGED = b'{"whole":true,', b'{"whole":false,'
"""First bytes of a whole picture and of changes."""
WHOLE_S: Final = 10.0
"""Time between two whole pictures (s)."""
FOLDER: Final = "pictures"
"""Folder of pictures in that of the recordings of inputs."""
PICTURES_S: Final = 300.0
"""Length of a file (s): short, as the open file has no index and is read through."""
_NS: Final = 10**9
_GAP_S: Final = 2.0
"""Longest time without a picture that still counts as recorded (s)."""
_SLACK_S: Final = 30.0
"""Greatest difference between a file's name and its first moment (s)."""


class Pictures(NamedTuple):
    """A whole picture and the changes after it, oldest first.

    Attributes:
        at: Time of the newest (Unix s).
        payloads: Their JSON, as written.
    """

    at: float
    payloads: Sequence[bytes]


class PictureFiles:
    """Pictures of a folder; blocking.

    Args:
        folder: Folder, which may be missing.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    @disk_errors()
    def by(self, wall: float) -> Pictures:
        """Pictures from which the picture of a moment is made (Unix s).

        Where the wall clock was set back, two files have the same moments: the file
        with the later beginning counts.

        Raises:
            NotRecordedError: nothing was recorded then.
            HopError: the disk refuses.
        """
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
        """Files that may hold a moment, with the last before and the first after."""
        paths = sorted(self._folder.glob("*.mcap*"))
        names = [path.name for path in paths]
        began = bisect_right(names, file_name(wall - PICTURES_S - _SLACK_S))
        begins_later = bisect_right(names, file_name(wall + _SLACK_S))
        return paths[max(0, began - 1) : begins_later + 1]


def _chain(path: Path, wall: float) -> Pictures | None:
    """The last whole picture before a moment and its changes; None: there is none.

    A damaged chunk ends the chain: later changes have lost their whole picture.
    """
    chain: list[tuple[int, bytes]] = []
    # The end is exclusive, and the moment itself counts.
    for at, payload in _messages(path, wall - WHOLE_S - _GAP_S, wall + 0.001):
        if payload.startswith(WHOLE):
            chain.clear()
        if chain or payload.startswith(WHOLE):
            chain.append((at, payload))
    if not chain:
        return None
    return Pictures(chain[-1][0] / _NS, [payload for _, payload in chain])


def _messages(
    path: Path, since: float = 0.0, until: float = FOREVER
) -> Iterator[tuple[int, bytes]]:
    """Moments (ns) and payloads of pictures, as far as a file can be read."""
    # A file that has been finished since was renamed.
    path = path if path.exists() else path.with_suffix("")
    with contextlib.suppress(DataFileError):
        for channel, at, payload in read_messages(path, since, until):
            if channel.topic == PICTURES.topic:
                yield at, payload
