"""Passkeys of people: registered by who is signed in, and a proof of who comes.

A challenge is random, kept here, and good for one answer within five minutes.  Uses are
written down beside the requests; while the database is away what was read last counts.
"""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from ipaddress import ip_address
from typing import Final, Protocol

from starlette.requests import Request

from iveg.adapters import webauthn
from iveg.adapters.bounded_thread import BoundedThread
from iveg.adapters.webauthn import Asking, Credential, PasskeyRefusedError, Site
from iveg.domain.accounts import Account
from iveg.domain.audit import Actor
from iveg.domain.errors import HopError
from iveg.domain.passkeys import Challenges, Passkey
from iveg.pipeline.ports import Clock
from iveg.web.errors import PasskeyAddressError
from iveg.web.security.rereading import Rereading

SIGN_IN: Final = "sign in"
"""Purpose of an answer that says who comes."""
_REGISTER: Final = "register "


class StoredPasskeys(Protocol):
    """Storage of passkeys; blocks, and raises HopError while it is away."""

    def read(self) -> Mapping[str, Passkey]:
        """All of them, by credential id."""

    def add(self, passkey: Passkey, by: Actor) -> None:
        """Keep a new one. Raises NameTakenError."""

    def remove(self, account_id: str, credential_id: str, by: Actor) -> None:
        """Forget one of this person. Raises UnknownNameError."""

    def used(self, passkeys: Iterable[Passkey]) -> None:
        """Keep counts and times of use."""


class Passkeys(Rereading):
    """Knows the passkeys of people, and what was asked of them.

    Args:
        store: Where they are kept.
        clock: Read at each question.
    """

    def __init__(self, store: StoredPasskeys, clock: Clock) -> None:
        super().__init__("passkeys")
        self._store = store
        self._clock = clock
        self._ceremonies = BoundedThread("ceremonies")
        self._challenges = Challenges()
        self._known: Mapping[str, Passkey] = {}
        self._used: dict[str, Passkey] = {}

    async def refresh(self) -> None:
        """Keep what was used, and read them once. Raises HopError."""
        if kept := tuple(self._used.values()):
            await self._apart(partial(self._store.used, kept))
        known = await self._apart(self._store.read)
        for one in kept:
            if self._used.get(one.credential_id) == one:
                del self._used[one.credential_id]
        # One that was used while this was read is newer here.
        newer = {key: one for key, one in self._used.items() if key in known}
        self._known = {**known, **newer}

    def of(self, account_id: str) -> list[Passkey]:
        """Those of one person, the oldest first."""
        own = (one for one in self._known.values() if one.account_id == account_id)
        return sorted(own, key=lambda one: one.made_at)

    # --- a new one ----------------------------------------------------------------

    async def ask_to_register(self, site: Site, account: Account) -> dict[str, object]:
        """Options of a new passkey, as ``parseCreationOptionsFromJSON`` reads them.

        Raises:
            MissingExtraError: ``iveg[passkeys]`` is not installed.
            BusyError: too many ask at once.
        """
        webauthn.require_passkeys()
        own = self.of(account.account_id)
        asking = await self._ceremonies.run(
            webauthn.ask_to_register, site, account, own
        )
        purpose = _REGISTER + account.account_id
        return self._await_answer(asking, account.account_id, purpose)

    async def register(
        self, site: Site, account: Account, name: str, credential: Credential, by: Actor
    ) -> Passkey | None:
        """Keep the passkey that an answer brings; None where it is none.

        Raises:
            NameTakenError: it is kept already.
            BusyError: too many ask at once.
            HopError: the database is away.
        """
        try:
            await self._answered(credential, _REGISTER + account.account_id)
            now = self._clock().wall
            made = await self._ceremonies.run(
                webauthn.register, site, account, name, credential, now
            )
        except PasskeyRefusedError:
            return None
        await self._apart(partial(self._store.add, made, by))
        await self._refreshed()
        return made

    async def remove(self, account: Account, credential_id: str, by: Actor) -> None:
        """Forget one. Raises UnknownNameError, HopError."""
        work = partial(self._store.remove, account.account_id, credential_id, by)
        await self._apart(work)
        self._used.pop(credential_id, None)
        await self._refreshed()

    # --- a proof ------------------------------------------------------------------

    async def ask_to_prove(
        self, site: Site, of: str, purpose: str, known: Iterable[Passkey] = ()
    ) -> dict[str, object]:
        """Options of a proof, as ``parseRequestOptionsFromJSON`` reads them.

        Args:
            site: Where the browser is.
            of: Who asks: an address or an account.
            purpose: What the answer will be used for.
            known: Passkeys that may answer; none: any that the device has.

        Raises:
            MissingExtraError: ``iveg[passkeys]`` is not installed.
            BusyError: too many ask at once.
        """
        webauthn.require_passkeys()
        asking = await self._ceremonies.run(webauthn.ask_to_prove, site, tuple(known))
        return self._await_answer(asking, of, purpose)

    async def prove(
        self, site: Site, credential: Credential, purpose: str
    ) -> Passkey | None:
        """The passkey that has answered; None where it proves nothing.

        Raises:
            BusyError: too many ask at once.
        """
        try:
            await self._answered(credential, purpose)
            passkey = self._named(credential, site)
            count = await self._ceremonies.run(
                webauthn.prove, site, passkey, credential
            )
        except PasskeyRefusedError:
            return None
        used = replace(passkey, sign_count=count, used_at=self._clock().wall)
        self._used[used.credential_id] = used
        self._known = {**self._known, used.credential_id: used}
        return used

    def _named(self, credential: Credential, site: Site) -> Passkey:
        passkey = self._known.get(str(credential.get("id")))
        if passkey is None or passkey.rp_id != site.rp_id:
            raise PasskeyRefusedError
        return passkey

    # --- challenges ---------------------------------------------------------------

    def _await_answer(self, asking: Asking, of: str, purpose: str) -> dict[str, object]:
        now = self._clock().mono
        self._challenges.add(asking.challenge, of, purpose, now)
        return asking.options

    async def _answered(self, credential: Credential, purpose: str) -> None:
        if not webauthn.has_passkeys():
            raise PasskeyRefusedError
        challenge = await self._ceremonies.run(webauthn.challenge_in, credential)
        if not self._challenges.redeem(challenge, purpose, self._clock().mono):
            raise PasskeyRefusedError

    async def _refreshed(self) -> None:
        with suppress(HopError):
            await self.refresh()

    def close(self) -> None:
        """End the threads."""
        super().close()
        self._ceremonies.close()


def site_of(request: Request) -> Site:
    """The place that a browser has reached iVeg at.

    A passkey is bound to it, so a request that names another host has none.

    Raises:
        PasskeyAddressError: an address in numbers, for which browsers make none.
    """
    host = request.url.hostname or ""
    with suppress(ValueError):
        ip_address(host)
        raise PasskeyAddressError
    return Site(str(request.base_url).rstrip("/"), host)
