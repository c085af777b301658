"""Proofs of who somebody is are looked at within a limit of wrong ones.

Whatever the proof: a link, a password or an invitation.  Of an address too many are
refused; of an account they wait ever longer, so that guesses from many addresses are
slow and no stranger shuts anybody out.
"""

import asyncio
import logging
import math
from collections.abc import Awaitable, Callable
from typing import TypeVar

from starlette.requests import Request

from iveg.domain.audit import STRANGER, Actor
from iveg.vital.audit import AuditTrail
from iveg.vital.ports import Clock
from iveg.web.problems import Problem
from iveg.web.security.csrf import refuse_forgery, refuse_other_bodies
from iveg.web.security.rate_limits import (
    REFUSED_ROWS,
    AccountDelays,
    Allowance,
    FailedAttempts,
)

_log = logging.getLogger(__name__)
_T = TypeVar("_T")


class Attempts:
    """Weighs proofs, counts the wrong ones and tells of them.

    Args:
        clock: Read at each of them.
        trail: Told of sign-ins, and of those that were refused.
        pause: Waits for so long (s).
    """

    def __init__(
        self,
        clock: Clock,
        trail: AuditTrail | None = None,
        pause: Callable[[float], Awaitable[object]] = asyncio.sleep,
    ) -> None:
        self._clock = clock
        self._trail = trail
        self.pause = pause
        self._failed = FailedAttempts()
        self._delays = AccountDelays()
        # Strangers' rows are for ever: a flood from many addresses writes few.
        self._rows = Allowance(REFUSED_ROWS, clock().mono)
        self.refused = 0
        """Wrong proofs so far."""
        self._logged_at: float | None = None

    async def weigh(
        self,
        request: Request,
        wrong: str,
        proof: Callable[[], Awaitable[_T | None] | None],
        of: str = "",
    ) -> _T | Problem:
        """What a proof proves, within the limit of wrong ones; else why not.

        Args:
            request: Who brings it.
            wrong: What the log says of one that proves nothing.
            proof: Looks at it; None where it is wrong.
            of: Key of the account that it names; empty: none.

        Raises:
            ForeignOriginError: another site's page sent it.
            NotJsonError: a body that is not JSON.
            BusyError: too many sign in at once.
        """
        refuse_forgery(request)
        refuse_other_bodies(request)
        address = "" if request.client is None else request.client.host
        now = self._clock().mono
        # Before it is looked at: each look takes a while of a processor, and a limit
        # that the right password passes is none for who guesses.
        if self._failed.wait_s(address, now) > 0.0:
            return self.refuse(address, now, wrong)
        if delay_s := self._delays.delay_s(of, now):
            await self.pause(delay_s)
            # Others of this address may have been wrong while it waited.
            now = self._clock().mono
            if self._failed.wait_s(address, now) > 0.0:
                return self.refuse(address, now, wrong)
        looking = proof()
        found = None if looking is None else await looking
        if found is None:
            self._delays.failed(of, now)
            return self.refuse(address, now, wrong)
        self._delays.succeeded(of)
        return found

    def refuse(self, address: str, now: float, wrong: str) -> Problem:
        """Count a proof that proves nothing, and say how it is answered.

        Args:
            address: Where it came from.
            now: Monotonic time (s).
            wrong: What the log says of it.
        """
        wait_s = self._failed.wait_s(address, now)
        if wait_s > 0.0:
            headers = {"Retry-After": str(math.ceil(wait_s))}
            detail = "Too many wrong sign-ins came from your address; wait a minute."
            return Problem(429, detail, headers=headers)
        self._failed.failed(address, now)
        if self._rows.admit(now):
            self.note(STRANGER, "sign_in_refused", address)
        self._tell_refused(now, wrong)
        return Problem(401, "This link does not sign in here, or not any more.")

    def note(self, actor: Actor, action: str, address: str, **facts: object) -> None:
        """Write a sign-in, or one that was refused, into the audit."""
        if self._trail is not None:
            details = {"address": address, **facts}
            self._trail.note(actor, action, details=details, at=self._clock())

    def _tell_refused(self, now: float, wrong: str) -> None:
        """Count a refused sign-in; log it once a minute, against floods of the log."""
        self.refused += 1
        if self._logged_at is None or now - self._logged_at >= 60.0:
            self._logged_at = now
            _log.warning("sign-in refused: %s (%d so far)", wrong, self.refused)
