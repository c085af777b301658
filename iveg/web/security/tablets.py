"""Shared tablets: one browser for several people, each by a PIN and for two minutes.

The session of a tablet reads and stops; whoever unlocks it acts by their own name::

    tablet ──PIN──> unlocked: its person, operator at most ──2 min without an act──┐
      ^────────────────────────────────────────────────────────────────────────────┘

What it is stands in its session on the server, so each page of it agrees.
"""

from collections.abc import Callable
from typing import Final

from iveg.adapters.sessions import Session
from iveg.domain.accounts import Account
from iveg.domain.errors import BusyError
from iveg.domain.pins import PinGuard
from iveg.pipeline.ports import Clock
from iveg.web.errors import PinRefusedError
from iveg.web.security.people import People
from iveg.web.security.roles import Principal

UNLOCKED_S: Final = 120.0
"""How long a tablet stays unlocked after the last act of its person (s)."""
TABLET_S: Final = 30 * 86400.0
"""How long a browser is a tablet (s); then it may stop, and no more."""
TABLET: Final = "tablet"
"""Id and method of a tablet that is locked."""


def tablet_principal(
    session: Session, now: float, account: Callable[[str], Account | None]
) -> Principal:
    """Who a tablet is at this moment.

    Args:
        session: Of the tablet.
        now: This moment (Unix s).
        account: Somebody's, while they may be here.
    """
    digest = bytes.fromhex(session.digest)
    holder = account(session.holder) if left_s(session, now) > 0.0 else None
    proven = session.proven or 0.0
    if holder is None or not holder.pin or proven < holder.since:
        return Principal(session.name, "viewer", digest, TABLET, TABLET, session.began)
    return Principal(
        holder.name,
        "viewer" if holder.role == "viewer" else "operator",
        digest,
        holder.account_id,
        "pin",
        session.proven,
        session.proven,
    )


def left_s(session: Session, now: float) -> float:
    """How long it stays unlocked if nothing is done (s); 0: it is locked."""
    # A clock that was set back must not hold it open.
    apart = abs(now - session.acted)
    return max(0.0, UNLOCKED_S - apart) if session.holder else 0.0


class Pins:
    """Looks at PINs, a few of each person.

    Args:
        people: Whose they are.
        clock: Read at each try.
    """

    def __init__(self, people: People, clock: Clock) -> None:
        self._people = people
        self._clock = clock
        self._guard = PinGuard()

    def holders(self) -> list[tuple[Account, float]]:
        """Who has a PIN, by name, and how long it is refused (s)."""
        now = self._clock().mono
        found = [one for one in self._people.present() if one.pin]
        found.sort(key=lambda one: one.name.casefold())
        return [(one, self._guard.wait_s(one.account_id, now)) for one in found]

    async def look(self, account_id: str, pin: str) -> Account:
        """The person whose PIN it is.

        Raises:
            PinRefusedError: it is not theirs, or they have to wait.
            BusyError: too many sign in at once.
        """
        account, now = self._people.account(account_id), self._clock().mono
        if account is None or not account.pin:
            raise PinRefusedError(0.0, 0)
        if (wait_s := self._guard.wait_s(account_id, now)) > 0.0:
            raise PinRefusedError(wait_s)
        self._guard.trying(account_id, now)
        try:
            fits = await self._people.has_pin(account, pin)
        except BusyError:
            self._guard.untried(account_id)
            raise
        if not fits:
            blocked_s = self._guard.wait_s(account_id, now)
            raise PinRefusedError(blocked_s, self._guard.left(account_id))
        self.forget(account_id)
        return account

    def forget(self, account_id: str) -> None:
        """Forget the wrong tries of somebody who has proven who they are."""
        self._guard.right(account_id)
