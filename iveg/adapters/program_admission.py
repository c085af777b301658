"""Programs that are let in by a token."""

import secrets
from typing import Protocol

from iveg.adapters.ids import new_id
from iveg.domain.accounts import ApiToken, TokenScope, digest_of, is_name
from iveg.domain.audit import Actor
from iveg.domain.errors import NotANameError


class ChangingTokens(Protocol):
    """Storage that takes changes of tokens; blocks, raises HopError."""

    def add(self, token: ApiToken, by: Actor) -> None:
        """Keep a new token. Raises NameTakenError."""


def admit_program(
    store: ChangingTokens,
    name: str,
    scope: TokenScope,
    ends_at: float | None = None,
    *,
    by: Actor,
    now: float,
) -> tuple[str, ApiToken]:
    """Let a program in by a token, which is returned here alone.

    Raises:
        NotANameError: no program may be called so.
        NameTakenError: one is called so already.
    """
    if not is_name(name):
        raise NotANameError(name)
    token = secrets.token_urlsafe(32)
    made = ApiToken(new_id(), name, scope, digest_of(token), now, ends_at=ends_at)
    store.add(made, by)
    return token, made
