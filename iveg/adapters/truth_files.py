"""Ground truth as ``iveg emulator --truth`` writes it: how near who really was.

Only the heads of lines are read where a line is not wanted; a range is found by halving
the file, whose lines are in order of time.
"""

import math
import os
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import IO

import orjson

from iveg.domain.errors import DataFileError
from iveg.domain.what_if.truth import Nearest, nearest_of

_HEAD = re.compile(rb'\{"robot":"([^"]*)","at":(-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?)')
_EVERY_S = 0.15
"""Looks of one robot nearer in time than this are passed over."""
_SLACK_S = 5.0
"""Lines of several robots may be so far out of order."""


def read_nearest(path: Path, since: float, until: float) -> Mapping[str, Nearest]:
    """How near the nearest person was to each robot in a range (Unix s).

    Raises:
        DataFileError: the file cannot be read, or has no line of the truth.
    """
    rows: dict[str, list[tuple[float, float]]] = defaultdict(list)
    try:
        with path.open("rb") as file:
            _check(path, file)
            for robot, at, line in _lines(file, since - _SLACK_S):
                if at >= until + _SLACK_S:
                    break
                of = rows[robot]
                is_next = not of or at - of[-1][0] >= _EVERY_S
                if since <= at < until and is_next:
                    of.extend(_nearest(at, line))
    except OSError as error:
        raise DataFileError(str(path), "", f"cannot be read: {error}.") from error
    return {robot: nearest_of(of) for robot, of in rows.items() if of}


def _check(path: Path, file: IO[bytes]) -> None:
    """A file that begins as none of these is not read as one without people."""
    begun = file.read(1 << 16).splitlines()
    if begun and not any(_HEAD.match(line) for line in begun):
        raise DataFileError(str(path), "", "cannot be read: no line of the truth.")


def _lines(file: IO[bytes], since: float) -> Iterator[tuple[str, float, bytes]]:
    """Robot, moment and text of each line from about then on."""
    low, high = 0, file.seek(0, os.SEEK_END)
    while high - low > 1 << 16:
        middle = (low + high) // 2
        file.seek(middle)
        file.readline()
        head = _HEAD.match(file.readline())
        if head is None or float(head[2]) >= since:
            high = middle
        else:
            low = middle
    file.seek(low)
    if low:
        file.readline()
    for line in file:
        # The last line may not be whole yet.
        if (head := _HEAD.match(line)) is not None:
            yield head[1].decode(), float(head[2]), line


def _nearest(at: float, line: bytes) -> Iterator[tuple[float, float]]:
    """The moment, and how near somebody is (m); nothing of what is no such line."""
    try:
        row = orjson.loads(line)
        x, y = row["pose"]["x"], row["pose"]["y"]
        away = (math.hypot(one["x"] - x, one["y"] - y) for one in row["people"])
        yield at, min(away, default=math.inf)
    except (orjson.JSONDecodeError, KeyError, TypeError):
        return
