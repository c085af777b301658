"""The data dictionary of exports: every column of every list, from the records.

    python -m iveg.models.dictionary

writes the tables of docs/interfaces/exports.md.
"""

import sys
import typing
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from functools import partial
from operator import attrgetter
from types import MappingProxyType, UnionType
from typing import Any, Final, Literal

from iveg.domain.records import (
    AlertRecord,
    AuditRecord,
    ByTransport,
    CommandRecord,
    DecisionRecord,
    DetectionRecord,
    LogRecord,
    MeasurementRecord,
    OdometryRecord,
    ReadingRecord,
    Record,
)
from iveg.domain.transports import TRANSPORTS, TransportId
from iveg.models.base import Model
from iveg.models.column_meanings import MEANINGS, MEANINGS_APART, Meaning

LISTS: Final[Mapping[str, type[Record]]] = MappingProxyType(
    {
        "decisions": DecisionRecord,
        "commands": CommandRecord,
        "alerts": AlertRecord,
        "log": LogRecord,
        "detections": DetectionRecord,
        "tracks": DetectionRecord,
        "odometry": OdometryRecord,
        "readings": ReadingRecord,
        "measurements": MeasurementRecord,
        "audit": AuditRecord,
    }
)
"""Lists that are exported, by name."""

ColumnType = Literal["time", "number", "integer", "flag", "text", "json"]
_PLAIN_TYPES: Final[Mapping[object, ColumnType]] = MappingProxyType(
    {bool: "flag", int: "integer", str: "text"}
)


@dataclass(frozen=True, slots=True)
class Column:
    """One column of one list: its name, type and meaning, and how a record has it."""

    name: str
    type: ColumnType
    meaning: Meaning
    read: Callable[[Record], object]


def columns_of(name: str) -> Sequence[Column]:
    """The columns of a list, in the order in which files have them."""
    return tuple(_columns(name, LISTS[name]))


def _columns(name: str, kind: type[Record]) -> Iterator[Column]:
    hints = typing.get_type_hints(kind)
    for column, read in readers_of(kind):
        hint = hints.get(column, float | None)
        shown = column.rstrip("_")
        meaning = MEANINGS_APART.get((name, shown)) or MEANINGS[shown]
        yield Column(shown, _type_of(shown, hint), meaning, read)


def readers_of(kind: type[Any]) -> Iterator[tuple[str, Callable[[Any], object]]]:
    """A column a field; of what is kept by transport one for each of the table."""
    for one in fields(kind):
        if one.type != ByTransport:
            yield one.name, attrgetter(one.name)
            continue
        # Programs that read by position know this order.
        for transport in reversed(TRANSPORTS):
            name = one.name.replace("_at", f"_{transport.id}_at")
            yield name, partial(_of_transport, one.name, transport.id)


def _of_transport(name: str, transport: TransportId, record: Record) -> object:
    return getattr(record, name).get(transport)


def _type_of(name: str, hint: object) -> ColumnType:
    is_union = typing.get_origin(hint) in (UnionType, typing.Union)
    parts = set(typing.get_args(hint)) if is_union else {hint}
    if float in parts:
        return "time" if name == "at" or name.endswith("_at") else "number"
    for type_, called in _PLAIN_TYPES.items():
        if type_ in parts:
            return called
    return "text" if typing.get_origin(hint) is Literal else "json"


class DictionaryColumn(Model):
    """One column of an exported list; empty where nothing is to be said."""

    list: str
    column: str
    type: ColumnType
    unit: str
    frame: str
    clock: str
    means: str
    joins: str


def dictionary_columns() -> list[DictionaryColumn]:
    """All columns of all lists."""
    return [
        DictionaryColumn(
            list=name, column=one.name, type=one.type, **asdict(one.meaning)
        )
        for name in LISTS
        for one in columns_of(name)
    ]


def describe() -> str:
    """The tables of docs/interfaces/exports.md."""
    lines = []
    for name in LISTS:
        lines += [
            f"### {name}",
            "",
            "| column | type | unit | frame | clock | meaning | joins |",
            "|---|---|---|---|---|---|---|",
        ]
        for one in columns_of(name):
            meant = one.meaning
            cells = (f"`{one.name}`", one.type, meant.unit, meant.frame, meant.clock)
            lines.append(f"| {' | '.join((*cells, meant.means, meant.joins))} |")
        lines.append("")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.stdout.write(describe())
