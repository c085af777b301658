"""Sessions of people: their duration, and the role that age leaves each.

Only digests of their tokens are kept.  Ages follow the wall clock, because no other
clock goes on counting while iVeg is down::

    signed in ──12 h, a viewer 30 days──> expired: STOP alone ──12 h──> gone
        └─────────────── signed out ──────────────────────────────────> gone
"""

import secrets
from dataclasses import replace
from typing import cast

from iveg.domain.accounts import (
    ACCOUNT_METHODS,
    AccessBook,
    PersonRole,
    Session,
    SignInMethod,
    digest_of,
)
from iveg.vital.ports import Clock
from iveg.web.security.roles import Principal, Role

LASTS_S, STOP_ONLY_S = 12 * 3600.0, 12 * 3600.0
VIEWER_S = 30 * 86400.0
"""Age of a viewer's session (s): nobody signs shared screens in each morning."""


def role_at(session: Session, now: float) -> Role | None:
    """The role that age leaves a session at ``now`` (Unix s); None: it is over."""
    # The provider gives a role anew at each sign-in.
    is_long = session.role == "viewer" and session.method != "sso"
    overdue_s = now - session.began - (VIEWER_S if is_long else LASTS_S)
    if overdue_s <= 0:
        return session.role
    return "expired" if overdue_s <= STOP_ONLY_S else None


class Sessions:
    """People who are signed in, from memory alone.

    Args:
        clock: Read at each question.
        book: Has the sessions, and the accounts that they belong to.
    """

    def __init__(self, clock: Clock, book: AccessBook) -> None:
        self._clock, self._book = clock, book
        now = clock().wall
        for digest, session in [*self._book.sessions.items()]:
            # A clock that was ahead must not have made a session that never ends.
            self._book.sessions[digest] = replace(
                session, began=min(session.began, now)
            )

    def open(
        self,
        name: str,
        role: Role,
        person: str = "",
        method: SignInMethod = "link",
    ) -> str:
        """Begin a session; returns its token, which is stored nowhere.

        Args:
            name: Name of the person.
            role: Role of the person.
            person: Id of the account.
            method: How the person signed in.
        """
        token = secrets.token_urlsafe(32)
        now = self._clock().wall
        person_role = cast("PersonRole", role)
        began = Session(digest_of(token), name, person_role, now, person, method)
        self._book.open(began)
        return token

    def find(self, token: str) -> Principal | None:
        """The owner of a session's token; None: unknown, or the session is over."""
        return self._principal(digest_of(token))

    def standing(self) -> list[tuple[Session, Role]]:
        """Sessions that are not over, each with its remaining role."""
        standing = []
        for digest in [*self._book.sessions]:
            principal = self._principal(digest)
            if principal is not None:
                standing.append((self._book.sessions[digest], principal.role))
        return standing

    def end(self, digest: str) -> None:
        """End the session of this digest at once, STOP included."""
        self._book.sessions.pop(digest, None)
        self._book.keep()

    def _principal(self, digest: str) -> Principal | None:
        session = self._book.sessions.get(digest)
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
        if role is None or session.method not in ACCOUNT_METHODS:
            return role
        account = self._book.accounts.get(session.person)
        if account is None:
            # No account is ever deleted: its line was damaged, and STOP outlives that.
            return "expired"
        is_theirs = session.role in (account.role, "viewer")
        is_theirs &= account.is_open(now) and session.began >= account.since
        return role if is_theirs else None
