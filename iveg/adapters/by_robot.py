"""One value for each robot, in a small file of JSON lines that is replaced as a whole.

A file that cannot be read is put aside, and nothing of it counts: each detector is
waited for then, and no robot is revoked until somebody says so anew.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Generic, TypeVar

from pydantic import TypeAdapter

from iveg.adapters.files import Form, load_lines, save_lines

_T = TypeVar("_T")


class FileByRobot(Generic[_T]):
    """Implements ``pipeline.ports.ChoiceStore``.

    Args:
        path: The file.
        name: What it holds; stands in its first line.
        reader: Reads a robot's id and value.
    """

    def __init__(
        self, path: Path, name: str, reader: TypeAdapter[tuple[str, _T]]
    ) -> None:
        self._path = path
        self._form = Form(name)
        self._reader = reader

    def load(self) -> Mapping[str, _T]:
        """The stored ones, by robot."""
        return dict(load_lines(self._path, self._form, self._reader.validate_json))

    async def save(self, known: Mapping[str, _T]) -> None:
        """Replace the stored ones; returns when they are on disk.

        Raises:
            HopError: the disk did not take them.
        """
        await save_lines(self._path, self._form, known.items())
