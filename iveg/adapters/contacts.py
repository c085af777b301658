"""Recipients of messages, in a small file that its owner alone may read.

It holds passwords and addresses, so that nothing of it is logged.  A file that cannot
be read is put aside: nobody gets messages until an operator enters recipients anew,
and iVeg starts all the same, for STOP does not depend on mail.
"""

from pathlib import Path

from pydantic import TypeAdapter

from iveg.adapters.files import Form, load_lines, save_lines
from iveg.domain.contacts import Contacts

FORM = Form("contacts")
_READER = TypeAdapter(Contacts)


class FileContacts:
    """The contacts in one file; implements ``pipeline.ports.ChoiceStore``."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def load(self) -> Contacts:
        """The stored contacts; nobody where there is no file."""
        known = load_lines(self._path, FORM, _READER.validate_json)
        return known[-1] if known else Contacts()

    async def save(self, contacts: Contacts) -> None:
        """Replace the stored contacts; returns when they are on disk.

        Raises:
            HopError: the disk did not take them.
        """
        await save_lines(self._path, FORM, [contacts])
