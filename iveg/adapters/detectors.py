"""Detectors out of service, in a small file of JSON lines that is replaced as a whole.

A file that cannot be read is put aside: then every detector is waited for, which is the
safe side.
"""

import asyncio
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from iveg.adapters.files import Form, put_aside, read_lines, write_lines
from iveg.domain.detector import OutOfService
from iveg.domain.errors import DataFileError, HopError

FORM = Form("detectors")
_READER = TypeAdapter(tuple[str, OutOfService])


class FileDetectors:
    """Who said so of which robot; implements ``pipeline.ports.DetectorStore``."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def load(self) -> Mapping[str, OutOfService]:
        """Those of last time, by robot."""
        try:
            lines = [line for _, line in read_lines(self._path, FORM)]
            return dict(map(_READER.validate_json, lines))
        except (ValidationError, DataFileError, OSError) as error:
            put_aside(self._path, type(error).__name__)
            return {}

    async def save(self, out: Mapping[str, OutOfService]) -> None:
        """Put them in the place of those before; returns when they are on disk.

        Raises:
            HopError: the disk did not take them.
        """
        lines = [(robot_id, asdict(word)) for robot_id, word in out.items()]
        try:
            await asyncio.to_thread(write_lines, self._path, FORM, lines)
        except OSError as error:
            raise HopError("disk", str(error)) from error
