"""Greenhouse files: TOML in, a checked ``Greenhouse`` out.

An unusable file is refused with its line, its field and the reason, so that a grower
who measured a greenhouse can mend the file without reading this code.
"""

import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import TypeVar

from iveg.adapters.toml_positions import syntax_error
from iveg.domain.errors import DataFileError
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import DriveLane, Greenhouse, PlacedObstacle, StructuralPost

BUILT_IN = ("mvsim-20x20", "agroconnect", "none")
_LISTS = ("lanes", "rows", "posts", "obstacles", "starts")
_SIDES = ("xmin", "ymin", "xmax", "ymax")
_FARTHEST_M = 1e6
_LONGEST_TEXT = 64

_T = TypeVar("_T")


def load_greenhouse(name_or_file: str) -> Greenhouse:
    """Load one of ``BUILT_IN`` by name, or a file by its path.

    Raises:
        DataFileError: no such greenhouse, or one that cannot be used.
    """
    if name_or_file in BUILT_IN:
        file = resources.files("iveg") / "data" / "greenhouses" / f"{name_or_file}.toml"
        return read_greenhouse(file.read_text("utf-8"), f"{name_or_file}.toml")
    try:
        text = Path(name_or_file).read_text("utf-8")
    except UnicodeDecodeError as error:
        raise DataFileError(name_or_file, "", "is not text in UTF-8.") from error
    except OSError as error:
        known = ", ".join(BUILT_IN)
        reason = f"is neither a greenhouse of iVeg ({known}) nor a readable file."
        raise DataFileError(name_or_file, "", reason) from error
    return read_greenhouse(text, name_or_file)


def read_greenhouse(text: str, file: str) -> Greenhouse:
    """Read a greenhouse from TOML; ``file`` is its name in complaints.

    Raises:
        DataFileError: naming line, field and reason.
    """
    try:
        raw = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        line, _, why = syntax_error(error, text)
        raise DataFileError(file, f"line {line}", f"is not TOML: {why}.") from error
    page = _Page(file, text)
    _refuse_unknown(page, raw, "", 0, ("name", "bounds", *_LISTS))
    root = _Fields(page, raw, "", 0)
    greenhouse = Greenhouse(
        root.text("name"),
        root.table("bounds").rectangle(),
        _items(page, raw, "lanes", _lane, ("label", *_SIDES)),
        _items(page, raw, "rows", _Fields.rectangle, _SIDES),
        _items(page, raw, "posts", _post, ("x", "y", "radius")),
        _items(page, raw, "obstacles", _obstacle, ("kind", *_SIDES)),
        _items(page, raw, "starts", _start, ("x", "y", "yaw")),
    )
    _check_inside(page, greenhouse)
    return greenhouse


@dataclass(frozen=True, slots=True)
class _Page:
    """The text of a file, to find the line of what is wrong in it."""

    file: str
    text: str

    def line_of(self, path: str, index: int) -> int:
        """The line where item ``index`` of a list, or a key of the root, stands."""
        name = re.escape(path.partition(".")[0])
        tables = list(re.finditer(rf"(?m)^\s*\[\[\s*{name}\s*\]\]", self.text))
        if index < len(tables):
            return self._line(tables[index].start())
        start = re.search(rf"(?m)^\s*\[?\s*{name}\b(?:\s*=\s*\[)?", self.text)
        if start is None:
            return 1
        inside = self.text[start.end() :].partition("]")[0]
        items = list(re.finditer(r"\{", inside))
        in_list = start[0].endswith("[") and index < len(items)
        offset = start.end() + items[index].start() if in_list else start.start()
        return self._line(offset)

    def _line(self, offset: int) -> int:
        before = self.text[:offset]
        gap = re.match(r"\s*", self.text[offset:])
        skipped = "" if gap is None else gap[0]
        return before.count("\n") + skipped.count("\n") + 1

    def refuse(self, path: str, index: int, reason: str) -> DataFileError:
        """The complaint about one field."""
        where = f"line {self.line_of(path, index)}"
        return DataFileError(self.file, f"{where}, {path}" if path else where, reason)


@dataclass(frozen=True, slots=True)
class _Fields:
    """One table of the file, read field by field."""

    page: _Page
    raw: Mapping[str, object]
    path: str
    index: int

    def _name(self, key: str) -> str:
        return f"{self.path}.{key}" if self.path else key

    def _get(self, key: str) -> object:
        if key not in self.raw:
            raise self.page.refuse(self._name(key), self.index, "is missing.")
        return self.raw[key]

    def text(self, key: str) -> str:
        value = self._get(key)
        if not isinstance(value, str) or not 0 < len(value.strip()) <= _LONGEST_TEXT:
            reason = f"must be a text of 1 to {_LONGEST_TEXT} characters."
            raise self.page.refuse(self._name(key), self.index, reason)
        return value

    def number(self, key: str, least: float = -_FARTHEST_M) -> float:
        value = self._get(key)
        number = float("nan")
        if isinstance(value, int | float) and not isinstance(value, bool):
            number = float(value)
        if least <= number <= _FARTHEST_M:
            return number
        reason = f"must be a number from {least:g} to {_FARTHEST_M:g}, not {value}."
        raise self.page.refuse(self._name(key), self.index, reason)

    def table(self, key: str) -> "_Fields":
        value = self._get(key)
        if not isinstance(value, dict):
            reason = "must be a table such as { xmin = 0, ymin = 0, … }."
            raise self.page.refuse(self._name(key), self.index, reason)
        _refuse_unknown(self.page, value, key, 0, _SIDES)
        return _Fields(self.page, value, key, 0)

    def rectangle(self) -> Rectangle:
        area = Rectangle(*(self.number(side) for side in _SIDES))
        for low, high in (("xmin", "xmax"), ("ymin", "ymax")):
            if not getattr(area, low) < getattr(area, high):
                reason = f"must be less than {high}."
                raise self.page.refuse(self._name(low), self.index, reason)
        return area


def _lane(fields: _Fields) -> DriveLane:
    return DriveLane(fields.text("label"), fields.rectangle())


def _post(fields: _Fields) -> StructuralPost:
    return StructuralPost(
        fields.number("x"), fields.number("y"), fields.number("radius", 0.001)
    )


def _obstacle(fields: _Fields) -> PlacedObstacle:
    return PlacedObstacle(fields.text("kind"), fields.rectangle())


def _start(fields: _Fields) -> Pose2D:
    return Pose2D(fields.number("x"), fields.number("y"), fields.number("yaw"))


def _items(
    page: _Page,
    raw: Mapping[str, object],
    name: str,
    read: Callable[[_Fields], _T],
    known: tuple[str, ...],
) -> tuple[_T, ...]:
    items = raw.get(name, [])
    if not isinstance(items, list):
        raise page.refuse(name, 0, "must be a list of tables.")
    found = []
    for index, item in enumerate(items):
        if not isinstance(item, dict):
            raise page.refuse(name, index, "must be a list of tables.")
        _refuse_unknown(page, item, name, index, known)
        found.append(read(_Fields(page, item, name, index)))
    return tuple(found)


def _refuse_unknown(
    page: _Page,
    raw: Mapping[str, object],
    path: str,
    index: int,
    known: tuple[str, ...],
) -> None:
    for key in raw:
        if key not in known:
            name = f"{path}.{key}" if path else key
            reason = f"is not a field here; known are {', '.join(known)}."
            raise page.refuse(name, index, reason)


def _check_inside(page: _Page, greenhouse: Greenhouse) -> None:
    """Everything stands within the outer wall; a typing slip seldom does."""
    corners: dict[str, list[tuple[tuple[float, float], ...]]] = {
        "lanes": [_corners(lane.area) for lane in greenhouse.lanes],
        "rows": [_corners(row) for row in greenhouse.rows],
        "posts": [((post.x, post.y),) for post in greenhouse.posts],
        "obstacles": [_corners(thing.area) for thing in greenhouse.obstacles],
        "starts": [((start.x, start.y),) for start in greenhouse.starts],
    }
    for name, places in corners.items():
        for index, points in enumerate(places):
            if not all(greenhouse.bounds.contains(x, y) for x, y in points):
                raise page.refuse(name, index, "lies outside bounds.")


def _corners(area: Rectangle) -> tuple[tuple[float, float], ...]:
    return ((area.xmin, area.ymin), (area.xmax, area.ymax))
