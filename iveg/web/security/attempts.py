"""Limits of wrong sign-ins: an address has five, then one a minute.

Never a lock-out: tries during the wait make it no longer.  STOP is no proof of an
identity: no limit here stands before it.
"""

import logging
import math
from collections import OrderedDict
from typing import Final, NoReturn

from starlette.exceptions import HTTPException
from starlette.requests import Request

from iveg.domain.audit import STRANGER, Actor
from iveg.vital.audit import AuditTrail
from iveg.vital.ports import Clock
from iveg.web.security.rate_limits import Allowance

SIGN_INS: Final = 5.0
PER_S: Final = 1 / 60
"""Wrong sign-ins that an address has at once, and that come back each second."""
REFUSED_ROWS: Final = 5.0
"""Rows of the audit a second for refused sign-ins, from all addresses together."""
_MOST_ADDRESSES = 1024
_log = logging.getLogger(__name__)


class Attempts:
    """Counts wrong proofs of identity and records them.

    Args:
        clock: Read at each attempt.
        trail: Records sign-ins and refused sign-ins.
    """

    def __init__(self, clock: Clock, trail: AuditTrail) -> None:
        self._clock, self._trail = clock, trail
        self._wrong: OrderedDict[str, Allowance] = OrderedDict()
        # Strangers' rows are kept for long: a flood from many addresses writes few.
        self._rows = Allowance(REFUSED_ROWS, REFUSED_ROWS, clock().mono)

    def refuse_waiting(self, request: Request) -> None:
        """Refuse an address that has to wait. Raises HTTPException (429).

        This comes before the check of a password, which takes processor time.  It also
        refuses the right password: else guessing would have no limit.
        """
        allowance = self._wrong.get(client_of(request))
        wait_s = allowance.wait_s(self._clock().mono) if allowance else 0.0
        if wait_s > 0.0:
            detail = "Too many wrong sign-ins came from your address; wait a minute."
            raise HTTPException(429, detail, {"Retry-After": str(math.ceil(wait_s))})

    def refuse(self, request: Request) -> NoReturn:
        """Count a wrong proof, and refuse it.

        Raises:
            HTTPException: always.
        """
        # Requests that came together have all passed the first look.
        self.refuse_waiting(request)
        address, now = client_of(request), self._clock().mono
        self._wrong.setdefault(address, Allowance(SIGN_INS, PER_S, now)).admit(now)
        # Bounded memory: the address whose last wrong sign-in is oldest is forgotten.
        self._wrong.move_to_end(address)
        if len(self._wrong) > _MOST_ADDRESSES:
            self._wrong.popitem(last=False)
        self.note_refused(request)
        raise HTTPException(401, "This link does not sign in here, or not any more.")

    def note(self, actor: Actor, action: str, request: Request, **facts: str) -> None:
        """Write a sign-in, or its refusal, into the audit."""
        details = {"address": client_of(request), **facts}
        self._trail.note(actor, action, details=details, at=self._clock())

    def note_refused(self, request: Request, **facts: str) -> None:
        """Write a refused sign-in into audit and log, unless there were too many."""
        if self._rows.admit(self._clock().mono):
            self.note(STRANGER, "sign_in_refused", request, **facts)
            _log.warning("sign-in refused: %s", facts or "wrong proof")


def client_of(request: Request) -> str:
    """Address that a request comes from."""
    return "" if request.client is None else request.client.host
