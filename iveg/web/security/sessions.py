"""Sessions of people: how long they last, and which role is left of each.

Only digests of their tokens are kept.  Ages follow the wall clock, because no other
goes on counting while iVeg is down::

    signed in ──12 h, a viewer 30 days──> expired: STOP alone ──12 h──> gone
        └─────────────── signed out ──────────────────────────────────> gone
"""

import hashlib
import secrets
from dataclasses import replace
from typing import cast

from iveg.domain.accounts import (
    OF_ACCOUNTS,
    AccessBook,
    PersonRole,
    Session,
    SignInMethod,
)
from iveg.vital.ports import Clock
from iveg.web.security.roles import Principal, Role

LASTS_S, STOP_ONLY_S = 12 * 3600.0, 12 * 3600.0
VIEWER_S = 30 * 86400.0
"""Shared screens look and stop, and nobody signs them in each morning."""


def role_at(session: Session, now: float) -> Role | None:
    """The role that is left at ``now`` (Unix s); None when all is over."""
    # The provider gives a role anew at each sign-in.
    is_long = session.role == "viewer" and session.method != "sso"
    over = now - session.began - (VIEWER_S if is_long else LASTS_S)
    if over <= 0:
        return session.role
    return "expired" if over <= STOP_ONLY_S else None


class Sessions:
    """People who are signed in, from memory alone.

    Args:
        clock: Read at each question.
        book: Where sessions are known, and the accounts that decide over them.
    """

    def __init__(self, clock: Clock, book: AccessBook) -> None:
        self._clock, self._book = clock, book
        now = clock().wall
        for digest, session in [*self._sessions.items()]:
            # A clock that was ahead must not have made a session that never ends.
            self._sessions[digest] = replace(session, began=min(session.began, now))

    @property
    def _sessions(self) -> dict[bytes, Session]:
        return self._book.sessions

    def open(
        self,
        name: str,
        role: Role,
        person: str = "",
        method: SignInMethod = "link",
    ) -> str:
        """Begin a session; returns its token, which is stored nowhere.

        Args:
            name: Of the person.
            role: What they are.
            person: Id of the account.
            method: How they signed in.
        """
        token = secrets.token_urlsafe(32)
        now = self._clock().wall
        digest = _digest(token)
        theirs = cast("PersonRole", role)
        began = Session(digest.hex(), name, theirs, now, person, method)
        self._book.open(began)
        return token

    def find(self, token: str) -> Principal | None:
        """The owner of this token; None: nobody's, or nobody's any more."""
        return self._principal(_digest(token))

    def standing(self) -> list[tuple[Session, Role]]:
        """Those that are not over, each with the role that is left of it."""
        found = []
        for digest in [*self._sessions]:
            who = self._principal(digest)
            if who is not None:
                found.append((self._sessions[digest], who.role))
        return found

    def end(self, digest: bytes) -> None:
        """End the one of this digest at once, STOP included."""
        self._sessions.pop(digest, None)
        self._book.keep()

    def _principal(self, digest: bytes) -> Principal | None:
        session = self._sessions.get(digest)
        if session is None:
            return None
        role = self._role(session, self._clock().wall)
        if role is None:
            self.end(digest)
            return None
        return Principal(
            session.name,
            role,
            session.person,
            session.method,
            digest,
            session.began,
        )

    def _role(self, session: Session, now: float) -> Role | None:
        """The role that age and account leave a session; None: it is over."""
        role = role_at(session, now)
        if role is None or session.method not in OF_ACCOUNTS:
            return role
        account = self._book.accounts.get(session.person)
        if account is None:
            # No account is ever deleted: its line was damaged, and STOP outlives that.
            return "expired"
        is_theirs = session.role in (account.role, "viewer")
        is_theirs &= account.is_open(now) and session.began >= account.since
        return role if is_theirs else None


def _digest(token: str) -> bytes:
    return hashlib.sha256(token.encode()).digest()
