"""Accounts of people and tokens of programs: in memory, and in a file."""

import asyncio
import logging
from contextlib import suppress
from typing import Final

from iveg.adapters.access_file import AccessFile, earlier_sessions
from iveg.adapters.history.queries import earlier_access, mark_moved
from iveg.adapters.passwords import Passwords
from iveg.domain.accounts import (
    Access,
    AccessBook,
    AccessChange,
    find_named,
)
from iveg.domain.audit import CONSOLE
from iveg.domain.errors import HopError, NameTakenError
from iveg.domain.events import Condition
from iveg.vital.audit import AuditTrail
from iveg.vital.ports import Clock
from iveg.vital.supervision import Supervision
from iveg.web.security.people import People

PART: Final = "accounts"
SET_UP_S: Final = 1800.0
"""Validity of the first invitation of a new server (s)."""
FIRST_ADMIN: Final = "admin"
_LOOK_S, _COPY_AGAIN_S = 0.4, 5.0
_log = logging.getLogger(__name__)


class Accounts:
    """People with accounts and programs with tokens.

    Args:
        file: Stores them.
        database_url: Address of the history, where earlier versions kept them.
        trail: Audit of each change.
        supervision: Raises alerts of a file that is damaged or cannot be written.
        clock: Read at each request.
    """

    def __init__(
        self,
        file: AccessFile,
        database_url: str,
        trail: AuditTrail,
        supervision: Supervision,
        clock: Clock,
    ) -> None:
        self._file, self._url = file, database_url
        self._trail, self._supervision, self._clock = trail, supervision, clock
        is_first = not file.exists
        self.book = AccessBook(file.load())
        if is_first:
            before = earlier_sessions(file.beside("sessions.jsonl"))
            self.book.add(Access(sessions=before))
        self.book.on_change.append(self._note)
        self.book.on_keep.append(lambda: file.save(self.book.picture()))
        self.people = People(self.book, Passwords(), clock)

    @property
    def state(self) -> str:
        """``ok``, ``damaged`` (a person must examine the file) or ``unwritten``."""
        if self._file.failing:
            return "unwritten"
        return "damaged" if self._file.aside else "ok"

    def first_invitation(self) -> str | None:
        """Invitation for the first admin; None where there is an admin.

        Raises:
            HopError: accounts of an earlier version's database are not read yet.
        """
        if not self._file.copied:
            raise HopError("database", "accounts of earlier versions are not read yet")
        if self.people.is_led():
            return None
        admission = self.people.admission(CONSOLE)
        known = find_named(self.people.known.values(), FIRST_ADMIN)
        if known is not None:
            return admission.reset(known, SET_UP_S)[0]
        return admission.add(FIRST_ADMIN, "admin", waits_s=SET_UP_S)[0]

    # --- beside the requests ------------------------------------------------------

    async def run(self) -> None:
        """Maintain the file until cancelled."""
        self.book.keep()
        while not self._file.copied:
            with suppress(HopError):
                await self.copy_earlier()
                break
            await asyncio.sleep(_COPY_AGAIN_S)
        while True:
            await self._file.look()
            self._report()
            await self._take_changes()
            await asyncio.sleep(_LOOK_S)

    async def _take_changes(self) -> None:
        """Take up changes of the console."""
        left = await asyncio.to_thread(self._file.left)
        for _, change in left:
            try:
                self.book.apply(change)
            except NameTakenError as error:
                _log.warning("a change by `iveg user` is left out: %s", error)
        # Deleted once they are applied: a crash must lose no change.
        if left:
            await self._file.drop([path for path, _ in left])

    async def copy_earlier(self) -> None:
        """Copy accounts and tokens of an earlier version, once.  Raises HopError."""
        if self._file.copied:
            return
        access = await asyncio.to_thread(earlier_access, self._url)
        self._file.copied = True
        self.book.add(access or Access())
        await self._file.look()
        # Marked as copied only where the file has them.
        if access is not None and not self._file.failing:
            await asyncio.to_thread(mark_moved, self._url, self._clock().wall)

    def _note(self, change: AccessChange) -> None:
        name, details, at = change.row.name, change.details, self._clock()
        self._trail.note(change.by, change.action, name, details, at=at)

    def _report(self) -> None:
        """Raise or clear the alerts of the file."""
        wrong: list[Condition] = []
        if self._file.aside:
            file = self._file.aside[-1]
            wrong.append(
                Condition.filled("P1", "alert.accounts_damaged", PART, file=file)
            )
        if self._file.failing:
            wrong.append(Condition("P2", "alert.accounts_unwritten", PART))
        self._supervision.report(PART, wrong)

    def close(self) -> None:
        """Return when the newest state is on disk."""
        self.people.close()
        self._file.close()
