"""The data dictionary of exports: every column of every list, from the records.

    python -m iveg.models.dictionary

prints docs/interfaces/columns.md.
"""

import sys
from typing import Final

from iveg.domain.records import LISTS, SHOWN_COLUMNS

_HEAD: Final = """\
# Columns of exports

This page is generated: `python -m iveg.models.dictionary > docs/interfaces/columns.md`.
"""
_TABLE: Final = """
## {}

| column | type | unit | frame | clock | meaning | joins |
|---|---|---|---|---|---|---|
"""


def describe() -> str:
    """The whole of docs/interfaces/columns.md."""
    page = _HEAD
    for name, kind in LISTS.items():
        page += _TABLE.format(name)
        for column in SHOWN_COLUMNS[kind]:
            row = column.meaning
            cells = column.type, row.unit, row.frame, row.clock, row.means, row.joins
            page += f"| `{column.name}` | {' | '.join(cells)} |\n"
    return page


if __name__ == "__main__":
    sys.stdout.write(describe())
