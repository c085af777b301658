"""Programs with tokens of their own: what each may do, and when it was here last.

Read anew twice a second, as accounts are, so that a token that is revoked at the
console is none within a second; use is written down once a minute at most.
"""

import contextlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Final, Protocol, TypeVar

from iveg.adapters.program_admission import ChangingTokens
from iveg.domain.accounts import ApiToken, TokenScope, digest_of
from iveg.domain.audit import Actor
from iveg.domain.errors import HopError
from iveg.pipeline.ports import Clock
from iveg.web.security.rereading import Rereading
from iveg.web.security.roles import Principal, Role

_T = TypeVar("_T")
_ROLES: Final[Mapping[TokenScope, Role]] = {
    "read": "reader",
    "stop": "program",
    "operate": "controller",
}
_USED_S = 60.0


class ApiTokens(ChangingTokens, Protocol):
    """Storage of tokens; blocks, and raises HopError while it is away."""

    def read(self) -> Mapping[str, ApiToken]:
        """All tokens, by their digests."""

    def revoke(self, name: str, by: Actor) -> None:
        """Delete a token. Raises UnknownNameError."""

    def used(self, digests: Mapping[str, float]) -> None:
        """Keep when tokens were used last (Unix s)."""


class Programs(Rereading):
    """Knows the tokens of programs.

    Args:
        store: Where they are kept.
        clock: Read at each question.
    """

    def __init__(self, store: ApiTokens, clock: Clock) -> None:
        super().__init__("api-tokens")
        self._store = store
        self._clock = clock
        self._known: Mapping[str, ApiToken] = {}
        self._used: dict[str, float] = {}
        self._kept_at = clock().mono

    async def refresh(self) -> None:
        """Read them once, and keep what was used. Raises HopError."""
        now = self._clock().mono
        if self._used and now - self._kept_at >= _USED_S:
            used, self._used, self._kept_at = self._used, {}, now
            await self._apart(partial(self._store.used, used))
        self._known = await self._apart(self._store.read)

    async def known(self) -> list[ApiToken]:
        """All tokens as they are kept now, with their newest use. Raises HopError."""
        await self.refresh()
        return [
            replace(one, used_at=self._used.get(digest, one.used_at))
            for digest, one in self._known.items()
        ]

    async def change(self, work: Callable[[ApiTokens], _T]) -> _T:
        """Change tokens; counts at once, here and for every caller.

        Args:
            work: Called in a thread, one after the other, with their storage.

        Raises:
            HopError: the database is away; nothing was changed.
        """
        done = await self._apart(lambda: work(self._store))
        with contextlib.suppress(HopError):
            await self.refresh()
        return done

    def find(self, token: str) -> Principal | None:
        """Whose token this is; None: nobody's, or nobody's any more."""
        digest = digest_of(token)
        known, now = self._known.get(digest), self._clock().wall
        if known is None or not known.is_open(now):
            return None
        self._used[digest] = now
        return _principal(known)

    def current(self, principal: Principal) -> Principal | None:
        """The same program as of now; None where its token has ended."""
        known, now = self._known.values(), self._clock().wall
        same = (one for one in known if one.token_id == principal.person)
        return next((_principal(one) for one in same if one.is_open(now)), None)


def _principal(token: ApiToken) -> Principal:
    return Principal(
        token.name, _ROLES[token.scope], person=token.token_id, method="token"
    )
