"""Accounts of people and tokens of programs: known from memory, kept in a file."""

import asyncio
import logging
from contextlib import suppress
from typing import Final

from iveg.adapters.access_file import AccessFile, earlier_sessions
from iveg.adapters.history.queries import earlier_access, mark_moved
from iveg.adapters.identity_provider import IdentityProvider
from iveg.adapters.passwords import Passwords
from iveg.domain.accounts import (
    Access,
    AccessBook,
    AccessChange,
    ClaimReading,
    find_named,
)
from iveg.domain.audit import CONSOLE
from iveg.domain.errors import HopError, NameTakenError
from iveg.domain.events import Condition
from iveg.settings import Settings
from iveg.vital.audit import AuditTrail
from iveg.vital.ports import Clock
from iveg.vital.supervision import Supervision
from iveg.web.security.authentication import Authenticator, Credentials
from iveg.web.security.people import People
from iveg.web.security.single_sign_on import SingleSignOn

PART: Final = "accounts"
SET_UP_S: Final = 1800.0
"""Validity of the first invitation of a new server (s)."""
FIRST_ADMIN: Final = "admin"
_LOOK_S, _COPY_AGAIN_S = 0.4, 5.0
_log = logging.getLogger(__name__)


class Accounts:
    """People with accounts and programs with tokens.

    Args:
        file: Remembers them.
        database_url: Of the history, where earlier versions kept them.
        trail: Told of each change.
        supervision: Told of a file that is damaged or cannot be written.
        clock: Read at each question.
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
        """``ok``, ``damaged`` (somebody has to look) or ``unwritten``."""
        if self._file.failing:
            return "unwritten"
        return "damaged" if self._file.aside else "ok"

    def ways_in(
        self,
        settings: Settings,
        sign_in_token: str,
        provider: IdentityProvider | None,
    ) -> tuple[Authenticator, SingleSignOn | None]:
        """Authentication of people and programs, and sign-on at the identity provider.

        Args:
            settings: An operator's choices.
            sign_in_token: Of the link; empty: there is none.
            provider: Vouches for people; None: nobody does.
        """
        credentials = Credentials(
            sign_in_token, settings.api_token, settings.sign_in_name
        )
        authenticator = Authenticator(credentials, self.people, self._trail)
        if provider is None:
            return authenticator, None
        reading = ClaimReading(
            settings.sso_role_claim, settings.sso_name_claim, settings.sso_role_map
        )
        return authenticator, SingleSignOn(provider, reading, authenticator)

    def first_invitation(self) -> str | None:
        """An invitation for the first admin; None where somebody is admin already.

        Raises:
            HopError: nobody knows yet who was in an earlier version's database.
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
        """Look after the file until cancelled."""
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
        """Have changes of the console count."""
        left = await asyncio.to_thread(self._file.left)
        for _, change in left:
            try:
                self.book.apply(change)
            except NameTakenError as error:
                _log.warning("a change of the console is left out: %s", error)
        if left:
            await self._file.drop([path for path, _ in left])

    async def copy_earlier(self) -> None:
        """Copy who was known to an earlier version, once. Raises HopError."""
        if self._file.copied:
            return
        found = await asyncio.to_thread(earlier_access, self._url)
        self._file.copied = True
        self.book.add(found or Access())
        await self._file.look()
        if found is not None and not self._file.failing:
            await asyncio.to_thread(mark_moved, self._url, self._clock().wall)

    def _note(self, change: AccessChange) -> None:
        name, details, at = change.row.name, change.details, self._clock()
        self._trail.note(change.by, change.action, name, details, at=at)

    def _report(self) -> None:
        """Tell people what is wrong with the file."""
        wrong: list[Condition] = []
        if self._file.aside:
            file = {"file": self._file.aside[-1]}
            wrong.append(Condition("P1", "alert.accounts_damaged", PART, None, file))
        if self._file.failing:
            wrong.append(Condition("P2", "alert.accounts_unwritten", PART))
        self._supervision.report(PART, wrong)

    def close(self) -> None:
        """Return when the newest is on disk."""
        self.people.close()
        self._file.close()
