"""Who is told outside iVeg, in a small file that its owner alone may read.

It holds passwords and addresses, so that nothing of it is logged.  A file that cannot
be read is put aside: nobody is told until an operator says whom, and iVeg starts all
the same, for STOP does not depend on mail.
"""

import asyncio
from dataclasses import asdict
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from iveg.adapters.files import Form, put_aside, read_lines, write_lines
from iveg.domain.errors import DataFileError, HopError
from iveg.domain.messages import Contacts

FORM = Form("contacts")
_READER = TypeAdapter(Contacts)


class FileContacts:
    """The contacts in one file; implements ``pipeline.ports.ContactStore``."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def load(self) -> Contacts:
        """Those of last time; nobody where there is no file."""
        try:
            lines = [line for _, line in read_lines(self._path, FORM)]
            return _READER.validate_json(lines[-1]) if lines else Contacts()
        except (ValidationError, DataFileError, OSError) as error:
            put_aside(self._path, type(error).__name__)
            return Contacts()

    async def save(self, contacts: Contacts) -> None:
        """Put them in the place of those before; returns when they are on disk.

        Raises:
            HopError: the disk did not take them.
        """
        try:
            await asyncio.to_thread(write_lines, self._path, FORM, [asdict(contacts)])
        except OSError as error:
            raise HopError("disk", str(error)) from error
