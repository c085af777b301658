"""Repair of recordings that a dead process left open."""

from pathlib import Path

from iveg.adapters.recordings.directory import _log
from iveg.adapters.recordings.mcap_file import McapFile
from iveg.adapters.recordings.reading import read_messages
from iveg.domain.errors import DataFileError, HopError


def finish_broken(path: Path) -> None:
    """Put in the place of a file without an end what can be read of it, with an index.

    Takes minutes for an hour of many robots: not for the server's own process.

    Raises:
        HopError: the disk is full or away.
    """
    rescued = path.with_suffix(".rescued")
    try:
        rescued.unlink(missing_ok=True)
        with read_messages(path) as reading:
            file = McapFile(rescued, reading.start)
            for channel, log_time, payload in reading:
                file.add_at(channel, log_time, payload)
            file.finish()
        rescued.rename(path.with_suffix(""))
    except DataFileError as error:
        # Not even its beginning was on the disk.
        _log.info("%s", error)
    except OSError as error:
        # A disk that is full needs the room.
        rescued.unlink(missing_ok=True)
        raise HopError("disk", error.strerror or str(error)) from error
    path.unlink()
