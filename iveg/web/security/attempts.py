"""Limits of sign-ins: proofs of identity are looked at within a number of wrong ones.

Of an address too many wrong ones are refused; of an account they wait ever longer, so
that guesses from many addresses are slow and no stranger shuts anybody out.  STOP is
no proof: no limit here stands before it.
"""

import asyncio
import logging
import math
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from typing import Final, NoReturn, TypeVar

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.types import ASGIApp, Receive, Scope, Send

from iveg.domain.audit import STRANGER, Actor
from iveg.vital.audit import AuditTrail
from iveg.vital.ports import Clock
from iveg.web.problems import Problem

SIGN_INS, SIGN_INS_WITHIN_S = 5, 60.0
REFUSED_ROWS = 5.0
"""Rows of the audit a second for refused sign-ins, from all addresses together."""
LONGEST_DELAY_S = 10
_UNDELAYED = 3
_MOST_KEYS = 1024
PASS_PER_S: Final = 20.0
"""As many as one thread can compute."""
_log = logging.getLogger(__name__)
_T = TypeVar("_T")


class Allowance:
    """A second's worth of messages, that fills again with time."""

    def __init__(self, per_s: float, now: float) -> None:
        self._per_s = self._left = per_s
        self._at = now

    def admit(self, now: float) -> bool:
        """Whether one more may pass (``now`` monotonic, s)."""
        self._left = min(self._per_s, self._left + (now - self._at) * self._per_s)
        self._at = now
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True


class _WrongProofs:
    """Number and time of the last wrong proofs, by key; bounded.

    Args:
        forgotten_s: A key without another wrong one is as new after so long (s).
    """

    def __init__(self, forgotten_s: float) -> None:
        self._forgotten_s = forgotten_s
        self._wrong: OrderedDict[str, tuple[int, float]] = OrderedDict()

    def count(self, key: str, now: float) -> tuple[int, float]:
        """Number of wrong ones, and time of the last (monotonic, s)."""
        wrong, last = self._wrong.get(key, (0, now))
        return (0, now) if now - last > self._forgotten_s else (wrong, last)

    def failed(self, key: str, now: float) -> None:
        """Count a wrong one."""
        wrong, _ = self.count(key, now)
        self._wrong[key] = wrong + 1, now
        self._wrong.move_to_end(key)
        if len(self._wrong) > _MOST_KEYS:
            self._wrong.popitem(last=False)

    def forget(self, key: str) -> None:
        """Forgive the wrong ones of this key alone."""
        self._wrong.pop(key, None)


class FailedAttempts(_WrongProofs):
    """Wrong sign-ins by address: five are free, then one a minute.

    Never a lock-out: tries during the wait do not make it longer.  A right one takes
    none away, for whoever guesses may have an account of their own.
    """

    def __init__(self) -> None:
        super().__init__(SIGN_INS * SIGN_INS_WITHIN_S)

    def wait_s(self, address: str, now: float) -> float:
        """Time that this address has to wait (s); 0 when it may try."""
        wrong, last = self.count(address, now)
        return 0.0 if wrong < SIGN_INS else max(0.0, last + SIGN_INS_WITHIN_S - now)


class AccountDelays(_WrongProofs):
    """Wrong sign-ins by account: after three the next wait, 1 s, 2 s, … 10 s at most.

    Nobody is refused.  Names that nobody has wait alike, so that none is told.
    """

    def __init__(self) -> None:
        super().__init__(900.0)

    def delay_s(self, account: str, now: float) -> float:
        """Wait of a proof before it is looked at (s)."""
        wrong, _ = self.count(account, now)
        if not account or wrong < _UNDELAYED:
            return 0.0
        return float(min(LONGEST_DELAY_S, 2 ** min(wrong - _UNDELAYED, 8)))


class Attempts:
    """Weighs proofs, counts the wrong ones and tells of them.

    Args:
        clock: Read at each of them.
        trail: Told of sign-ins, and of those that were refused.

    Attributes:
        pause: Waits for so long (s).
        refused: Wrong proofs so far.
    """

    def __init__(self, clock: Clock, trail: AuditTrail) -> None:
        self._clock, self._trail = clock, trail
        self.pause: Callable[[float], Awaitable[object]] = asyncio.sleep
        self._failed, self._delays = FailedAttempts(), AccountDelays()
        # Strangers' rows are for ever: a flood from many addresses writes few.
        self._rows = Allowance(REFUSED_ROWS, clock().mono)
        self.refused = 0
        self._logged_at = -math.inf

    async def weigh(
        self,
        request: Request,
        proof: Callable[[], Awaitable[_T | None]],
        wrong: str,
        account: str = "",
    ) -> _T:
        """Look at a proof, within the limit of wrong ones; returns what it proves.

        Args:
            request: Who brings it.
            proof: Looks at it; None where it is wrong.
            wrong: What the log says of one that proves nothing.
            account: Key of the account that it names; empty: none.

        Raises:
            HTTPException: 401, it is wrong; 429, there were too many wrong ones.
            BusyError: too many sign in at once.
        """
        # Before it is looked at: each look takes a while of a processor, and a limit
        # that the right password passes is none for who guesses.
        self._refuse_waiting(request)
        if delay_s := self._delays.delay_s(account, self._clock().mono):
            await self.pause(delay_s)
            # Others of this address may have been wrong while it waited.
            self._refuse_waiting(request)
        found = await proof()
        if found is None:
            self._delays.failed(account, self._clock().mono)
            self.refuse(request, wrong)
        self._delays.forget(account)
        return found

    def refuse(self, request: Request, wrong: str) -> NoReturn:
        """Count a proof that proves nothing, and refuse it.

        Raises:
            HTTPException: always.
        """
        self._refuse_waiting(request)
        now = self._clock().mono
        self._failed.failed(client_of(request), now)
        self.note_refused(STRANGER, request)
        self.refused += 1
        # Once a minute, against floods of the log.
        if now - self._logged_at >= 60.0:
            self._logged_at = now
            _log.warning("sign-in refused: %s (%d so far)", wrong, self.refused)
        raise HTTPException(401, "This link does not sign in here, or not any more.")

    def _refuse_waiting(self, request: Request) -> None:
        wait_s = self._failed.wait_s(client_of(request), self._clock().mono)
        if wait_s > 0.0:
            detail = "Too many wrong sign-ins came from your address; wait a minute."
            raise HTTPException(429, detail, {"Retry-After": str(math.ceil(wait_s))})

    def note(self, actor: Actor, action: str, request: Request, **facts: str) -> None:
        """Write a sign-in, or one that was refused, into the audit."""
        details = {"address": client_of(request), **facts}
        self._trail.note(actor, action, details=details, at=self._clock())

    def note_refused(self, actor: Actor, request: Request, **facts: str) -> bool:
        """Write a refused sign-in into the audit; False: there were too many."""
        is_kept = self._rows.admit(self._clock().mono)
        if is_kept:
            self.note(actor, "sign_in_refused", request, **facts)
        return is_kept


def client_of(request: Request) -> str:
    """Address that a request comes from."""
    return "" if request.client is None else request.client.host


class SignInGate:
    """Refuses (429) sign-ins beyond twenty a second before anything looks at them.

    A limit by address alone is none for who has many, and each request that is looked
    at costs the loop on which a STOP runs some milliseconds.
    """

    def __init__(self, app: ASGIApp, clock: Clock) -> None:
        self._app, self._clock = app, clock
        self._allowance = Allowance(PASS_PER_S, clock().mono)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        is_sign_in = (
            scope["type"] == "http"
            and scope["method"] == "POST"
            and scope["path"] == "/signin"
        )
        if is_sign_in and not self._allowance.admit(self._clock().mono):
            detail = "Too many sign in at once; try again in a moment."
            headers = {"Retry-After": "2", "Connection": "close"}
            refusal = Problem(429, detail, "busy", headers=headers).response()
            await refusal(scope, receive, send)
            return
        await self._app(scope, receive, send)
