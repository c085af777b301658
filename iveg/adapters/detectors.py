"""Detectors out of service, in a small file of JSON lines that is replaced as a whole.

A file that cannot be read is put aside: then every detector is waited for, which is the
safe side.
"""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

from pydantic import TypeAdapter

from iveg.adapters.files import Form, load_lines, save_lines
from iveg.domain.detector import OutOfService

FORM = Form("detectors")
_READER = TypeAdapter(tuple[str, OutOfService])


class FileDetectors:
    """Detectors out of service; implements ``pipeline.ports.DetectorStore``."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def load(self) -> Mapping[str, OutOfService]:
        """The stored ones, by robot."""
        return dict(load_lines(self._path, FORM, _READER.validate_json))

    async def save(self, out: Mapping[str, OutOfService]) -> None:
        """Replace the stored ones; returns when they are on disk.

        Raises:
            HopError: the disk did not take them.
        """
        lines = [(robot_id, asdict(word)) for robot_id, word in out.items()]
        await save_lines(self._path, FORM, lines)
