"""Sessions of people: their tokens, and what each still allows.

Only digests of the tokens are kept, in memory and in a store that outlives a restart.
"""

import hashlib
import secrets
from collections.abc import Callable, Collection, Iterable
from dataclasses import replace
from typing import Any

from iveg.adapters.sessions import FileSessions, Session
from iveg.domain.accounts import (
    DEFAULT_NAME,
    LINK_PERSON,
    OF_ACCOUNTS,
    Account,
    SignInMethod,
)
from iveg.pipeline.ports import Clock
from iveg.web.security.roles import Principal, Role
from iveg.web.security.session_life import role_at
from iveg.web.security.tablets import TABLET, left_s, tablet_principal

_MOST_SESSIONS = 1000
_PEOPLE = frozenset({"viewer", "operator", "admin"})
_KEEP_SEEN_S = 60.0
"""A crash forgets at most this much of a sign of life."""


class Sessions:
    """People who are signed in.

    Bounded: when it is full, the session that was idle longest ends.

    Args:
        clock: Read at each question.
        store: Where they outlive this process; None forgets them with it.
        most: How many there may be.
        link_name: Name of whoever holds the link of the environment.
        role_now: The role that an account leaves a session of its person; None: over.
        account: Somebody's account while they may be here.
    """

    def __init__(
        self,
        clock: Clock,
        store: FileSessions | None = None,
        most: int = _MOST_SESSIONS,
        link_name: str = DEFAULT_NAME,
        role_now: Callable[[Session, Role], Role | None] | None = None,
        account: Callable[[str], Account | None] = lambda _: None,
    ) -> None:
        self._clock = clock
        self._store = store
        self._most = most
        self._link_name = link_name
        self._role_now = role_now
        self._account = account
        self._sessions: dict[bytes, Session] = {}
        self._kept_at = 0.0
        if store is not None:
            self._remember(store.load())

    def __len__(self) -> int:
        return len(self._sessions)

    def open_by_link(self) -> str:
        """Begin a session of whoever holds the link; returns its token."""
        return self.open(self._link_name, "operator", LINK_PERSON)

    def open(
        self,
        name: str,
        role: Role,
        person: str = "",
        method: SignInMethod = "link",
        until: float | None = None,
        proven: float | None = None,
    ) -> str:
        """Begin a session; returns its token, which is stored nowhere.

        Args:
            name: Of the person.
            role: What they are.
            person: Id of the account.
            method: How they signed in.
            until: When it is over at the latest (Unix s).
            proven: When the provider saw them prove who they are (Unix s); None: it
                does not say.  Every other way in is a proof by itself.
        """
        if len(self._sessions) >= self._most:
            idlest = min(self._sessions, key=lambda one: self._sessions[one].seen)
            del self._sessions[idlest]
        token = secrets.token_urlsafe(32)
        now = self._clock().wall
        digest = _digest(token)
        proven = proven if method == "sso" else now
        began = Session(
            digest.hex(), name, role, now, now, person, method, proven, until
        )
        self._sessions[digest] = began
        self._keep()
        return token

    def find(self, token: str) -> Principal | None:
        """The owner of this token; counts as a sign of life."""
        return self._principal(_digest(token), touch=True)

    def current(self, principal: Principal) -> Principal | None:
        """The same person as of now: with the role that is left, or gone."""
        if principal.session is None:
            return principal
        return self._principal(principal.session, touch=False)

    def revoke(self, principal: Principal) -> None:
        """End a session at once, STOP included."""
        if principal.session is not None:
            self._sessions.pop(principal.session, None)
            self._keep()

    def proven(self, principal: Principal) -> None:
        """Note that the person has proven anew who they are."""
        self._change(principal, proven=self._clock().wall)

    def standing(self) -> list[tuple[Session, Role]]:
        """Those that are not over, each with the role that is left of it."""
        found = []
        for digest in [*self._sessions]:
            who = self._principal(digest, touch=False)
            if who is not None:
                found.append((self._sessions[digest], who.role))
        return found

    def end(self, ended: Collection[Session]) -> None:
        """End some at once, STOP included."""
        for session in ended:
            self._sessions.pop(bytes.fromhex(session.digest), None)
        self._keep()

    # --- a shared tablet ----------------------------------------------------------

    def make_tablet(self, principal: Principal, name: str) -> None:
        """Make a browser a tablet; it keeps nothing of whoever did."""
        now = self._clock().wall
        self._change(
            principal,
            name=name,
            role="viewer",
            person=TABLET,
            method=TABLET,
            began=now,
            proven=None,
        )

    def unlock(self, principal: Principal, account_id: str) -> None:
        """Have a tablet act as somebody."""
        now = self._clock().wall
        self._change(principal, holder=account_id, acted=now, proven=now)

    def lock(self, principal: Principal) -> None:
        """Have a tablet act as nobody."""
        self._change(principal, holder="")

    def acted(self, principal: Principal) -> None:
        """Note that whoever unlocked a tablet has done something."""
        self._change(principal, acted=self._clock().wall)

    def unlocked_s(self, principal: Principal) -> float:
        """How long a tablet stays unlocked if nothing is done (s)."""
        session = self._sessions.get(principal.session or b"")
        return 0.0 if session is None else left_s(session, self._clock().wall)

    def tablet_name(self, principal: Principal) -> str:
        """What a tablet is called, whoever has unlocked it."""
        session = self._sessions.get(principal.session or b"")
        return "" if session is None else session.name

    # ------------------------------------------------------------------------------

    def lower(self, principal: Principal) -> None:
        """Leave a session what a viewer may do, until somebody signs in anew."""
        self._change(principal, role="viewer", wall=True)

    def _change(self, principal: Principal, **changes: Any) -> None:
        session = self._sessions.get(principal.session or b"")
        if session is not None:
            changed = replace(session, **changes)
            self._sessions[bytes.fromhex(session.digest)] = changed
            self._keep()

    def _principal(self, digest: bytes, *, touch: bool) -> Principal | None:
        session = self._sessions.get(digest)
        if session is None:
            return None
        now = self._clock().wall
        role = role_at(session, now)
        if role is not None and session.method in OF_ACCOUNTS:
            # Without accounts nobody can say whether the person still has one.
            role = self._role_now(session, role) if self._role_now else None
        if role is None:
            del self._sessions[digest]
            self._keep()
            return None
        if touch and role != "expired":
            self._sessions[digest] = replace(session, seen=now)
            if abs(now - self._kept_at) >= _KEEP_SEEN_S:
                self._keep()
        if session.method == TABLET and role != "expired":
            return tablet_principal(session, now, self._account)
        return Principal(
            session.name,
            role,
            digest,
            session.person,
            session.method,
            session.began,
            session.proven,
            session.wall,
        )

    def _remember(self, kept: Iterable[Session]) -> None:
        """Take in those of earlier runs that are not over; the newest of too many."""
        now = self._clock().wall
        newest = sorted(kept, key=lambda session: session.seen)[-self._most :]
        for session in newest:
            # A clock that was ahead must not have made a session that never ends.
            began, seen = min(session.began, now), min(session.seen, now)
            known = self._named(replace(session, began=began, seen=seen))
            if session.role in _PEOPLE and role_at(known, now) is not None:
                self._sessions[bytes.fromhex(session.digest)] = known

    def _named(self, session: Session) -> Session:
        """A session of the link under the link's present name.

        Earlier versions had nobody else, and called that person ``operator``.
        """
        is_link = session.person == LINK_PERSON or (
            not session.person and session.name == DEFAULT_NAME
        )
        if not is_link:
            return session
        return replace(session, name=self._link_name, person=LINK_PERSON)

    def _keep(self) -> None:
        self._kept_at = self._clock().wall
        if self._store is not None:
            self._store.save(self._sessions.values())


def _digest(token: str) -> bytes:
    return hashlib.sha256(token.encode()).digest()
