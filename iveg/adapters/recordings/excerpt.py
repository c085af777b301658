"""A part of the recordings, as a recording of its own."""

from collections.abc import Iterator
from pathlib import Path

import orjson
from mcap.exceptions import McapError
from mcap.reader import make_reader

from iveg.adapters.recordings.mcap_file import PADDING, Channel, McapFile
from iveg.adapters.recordings.reading import RecordedMessage, read_messages
from iveg.domain.errors import DataFileError, HopError
from iveg.domain.observations import Instant

_NS = 10**9


def write_excerpt(folder: Path, target: Path, since: float, until: float) -> int:
    """Copy what came in between two moments (Unix s); how many messages.

    A file that is damaged gives what can be read of it.

    Raises:
        HopError: the disk is full or away.
    """
    first, last = round(since * _NS), round(until * _NS)
    copied = 0
    try:
        excerpt = McapFile(target, Instant(0.0, since))
        for path in sorted(folder.glob("*.mcap*")):
            for channel, log_time, payload in _between(path, first, last):
                excerpt.add_at(channel, log_time, payload)
                copied += 1
        excerpt.finish()
    except OSError as error:
        raise HopError("disk", error.strerror or str(error)) from error
    return copied


def _between(path: Path, first: int, last: int) -> Iterator[RecordedMessage]:
    try:
        if path.suffix == ".mcap":
            yield from _by_index(path, first, last)
            return
        with read_messages(path) as reading:
            yield from (one for one in reading if first <= one[1] < last)
    except (DataFileError, McapError):
        return


def _by_index(path: Path, first: int, last: int) -> Iterator[RecordedMessage]:
    """Of a finished file only the chunks that are asked for."""
    with path.open("rb") as stream:
        reader = make_reader(stream)
        found = reader.iter_messages(start_time=first, end_time=last)
        for schema, channel, message in found:
            if schema is not None and channel.topic != PADDING.topic:
                shape = orjson.loads(schema.data)
                name = Channel(channel.topic, schema.name, shape)
                yield name, message.log_time, message.data
