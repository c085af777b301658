"""Lists as Parquet: a table that is written while its rows are read.

Rows of some pages make one row group, so that any length takes the same memory.
"""

import io
from collections.abc import Iterable, Sequence
from types import ModuleType
from typing import Final

from typing_extensions import Buffer

from iveg.adapters.extras import require_extra
from iveg.domain.errors import HopError
from iveg.domain.records import Record
from iveg.models.base import write_json
from iveg.models.dictionary import Column, ColumnType, columns_of

ROWS_A_GROUP: Final = 50_000
MOST_OPEN: Final = 16
"""Exports at once; the oldest ends where one more begins."""
_MICROS: Final = 1e6


class ParquetTable:
    """One file; what each call returns is its next bytes.

    Args:
        name: Of the list (``models.dictionary.LISTS``).

    Raises:
        MissingExtraError: ``iveg[parquet]`` is not installed.
    """

    def __init__(self, name: str) -> None:
        require_extra("parquet", "an export as Parquet")
        import pyarrow
        from pyarrow import parquet

        self._arrow = pyarrow
        self._columns = columns_of(name)
        self._schema = pyarrow.schema(
            [(one.name, _arrow_type(pyarrow, one.type)) for one in self._columns]
        )
        self._sink = _Sink()
        self._writer = parquet.ParquetWriter(
            self._sink, self._schema, compression="zstd"
        )
        self._batches: list[object] = []
        self._rows = 0

    def add(self, records: Sequence[Record]) -> bytes:
        """Take rows."""
        arrays = [
            self._arrow.array(_cells(column, records), type=field.type)
            for column, field in zip(self._columns, self._schema, strict=True)
        ]
        batch = self._arrow.RecordBatch.from_arrays(arrays, schema=self._schema)
        self._batches.append(batch)
        self._rows += len(records)
        if self._rows >= ROWS_A_GROUP:
            self._write_group()
        return self._sink.drain()

    def end(self) -> bytes:
        """The rest of the file."""
        self._write_group()
        self._writer.close()
        return self._sink.drain()

    def _write_group(self) -> None:
        batches, self._batches, self._rows = self._batches, [], 0
        if batches:
            self._writer.write_table(self._arrow.Table.from_batches(batches))


_open: dict[str, tuple[ParquetTable, int]] = {}
"""In the worker: by key, with how many pages it has."""


def parquet_page(key: str, name: str, number: int, records: Sequence[Record]) -> bytes:
    """Page ``number`` of an export, from 0; its bytes.

    Raises:
        HopError: the process that had its beginning is gone.
        MissingExtraError: ``iveg[parquet]`` is not installed.
    """
    if number == 0:
        while len(_open) >= MOST_OPEN:
            del _open[next(iter(_open))]
        _open[key] = ParquetTable(name), 0
    table = _opened(key, number)
    _open[key] = table, number + 1
    return table.add(records)


def parquet_end(key: str, pages: int) -> bytes:
    """The end of an export of so many pages.  Raises HopError, as above."""
    table = _opened(key, pages)
    del _open[key]
    return table.end()


def _opened(key: str, pages: int) -> ParquetTable:
    table, has = _open.get(key, (None, 0))
    if table is None or has != pages:
        raise HopError("export", "its beginning is lost")
    return table


class _Sink(io.RawIOBase):
    """A file whose bytes are taken away as they come."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []
        self._size = 0

    def writable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._size

    def write(self, piece: Buffer) -> int:
        content = bytes(piece)
        self._pieces.append(content)
        self._size += len(content)
        return len(content)

    def drain(self) -> bytes:
        """What came since the last time."""
        pieces, self._pieces = self._pieces, []
        return b"".join(pieces)


def _arrow_type(arrow: ModuleType, type_: ColumnType) -> object:
    types = {
        "time": arrow.timestamp("us", tz="UTC"),
        "number": arrow.float64(),
        "integer": arrow.int64(),
        "flag": arrow.bool_(),
    }
    return types.get(type_, arrow.string())


def _cells(column: Column, records: Iterable[Record]) -> list[object]:
    return [_cell(column.type, column.read(one)) for one in records]


def _cell(type_: ColumnType, value: object) -> object:
    if value is None:
        return None
    if type_ == "time" and isinstance(value, float | int):
        return round(value * _MICROS)
    return write_json(value).decode() if type_ == "json" else value
