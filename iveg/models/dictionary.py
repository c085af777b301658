"""The data dictionary of exports: every column of every list, from the records.

    python -m iveg.models.dictionary

prints docs/interfaces/columns.md.
"""

import sys
from dataclasses import asdict
from typing import Final

from iveg.domain.records import LISTS, SHOWN_COLUMNS, ColumnType
from iveg.models.base import Model

_HEAD: Final = """\
# Columns of exports

This page is generated: `python -m iveg.models.dictionary > docs/interfaces/columns.md`.
"""
_TABLE: Final = """
## {}

| column | type | unit | frame | clock | meaning | joins |
|---|---|---|---|---|---|---|
"""


class DictionaryColumn(Model):
    """One column of an exported list; empty where nothing is to be said.

    Attributes:
        list: List, as in its address.
        column: Name.
        type: Of its values.
        unit: Unit or range.
        frame: Frame of coordinates.
        clock: Whose clock a time is by.
        means: Meaning.
        joins: How its rows find those of other lists.
    """

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
        for name, kind in LISTS.items()
        for one in SHOWN_COLUMNS[kind]
    ]


def describe() -> str:
    """The whole of docs/interfaces/columns.md."""
    page = _HEAD
    for name, kind in LISTS.items():
        page += _TABLE.format(name)
        for one in SHOWN_COLUMNS[kind]:
            said = one.meaning
            cells = one.type, said.unit, said.frame, said.clock, said.means, said.joins
            page += f"| `{one.name}` | {' | '.join(cells)} |\n"
    return page


if __name__ == "__main__":
    sys.stdout.write(describe())
