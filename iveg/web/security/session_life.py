"""How long a session lasts, and which role is left of it.

Ages follow the wall clock, because no other goes on counting while iVeg is down::

    signed in ──12 h idle, or 24 h──> expired: STOP alone ──12 h──> gone
        └──────── signed out ─────────────────────────────────────> gone
"""

from typing import cast

from iveg.adapters.sessions import Session
from iveg.web.security.roles import Role
from iveg.web.security.tablets import TABLET, TABLET_S

IDLE_S, ABSOLUTE_S, STOP_ONLY_S = 12 * 3600.0, 24 * 3600.0, 12 * 3600.0


def role_at(session: Session, now: float) -> Role | None:
    """The role that is left at ``now`` (Unix s); None when all is over."""
    ends = min(session.seen + IDLE_S, session.began + ABSOLUTE_S)
    if session.method == TABLET:
        ends = session.began + TABLET_S
    over = now - (ends if session.until is None else min(ends, session.until))
    if over <= 0:
        return cast("Role", session.role)
    return "expired" if over <= STOP_ONLY_S else None
