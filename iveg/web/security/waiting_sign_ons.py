"""Sign-ins that are at the identity provider: which answers are awaited, and whose."""

from collections import OrderedDict
from dataclasses import dataclass
from typing import Final

from iveg.adapters.identity_provider import Attempt
from iveg.domain.observations import Instant
from iveg.web.security.roles import Principal

WAITS_S: Final = 600.0
_MOST, _MOST_OF_ADDRESS = 1000, 16


@dataclass(frozen=True, slots=True)
class WaitingSignOn:
    """A sign-in that was sent to the provider.

    Attributes:
        browser: What the browser's own cookie says, so that nobody ends the sign-in of
            somebody else in their browser.
        to: Path at which the person goes on.
        before: Whose session the browser had.
    """

    attempt: Attempt
    browser: str
    address: str
    to: str
    began: Instant
    before: Principal | None


class WaitingSignOns:
    """Bounded: the oldest gives way, that of the same address first."""

    def __init__(self) -> None:
        self._waiting: OrderedDict[str, WaitingSignOn] = OrderedDict()

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, one: WaitingSignOn) -> None:
        """Await the answer to one more."""
        same = [
            state
            for state, other in self._waiting.items()
            if other.address == one.address
        ]
        if len(same) >= _MOST_OF_ADDRESS:
            del self._waiting[same[0]]
        elif len(self._waiting) >= _MOST:
            self._waiting.popitem(last=False)
        self._waiting[one.attempt.state] = one

    def pop(self, state: str, browser: str, now: Instant) -> WaitingSignOn | None:
        """The sign-in that an answer belongs to, once; None: to none any more."""
        one = self._waiting.get(state)
        if one is None or one.browser != browser or not browser:
            # Another browser's answer: the sign-in goes on to wait for its own.
            return None
        del self._waiting[state]
        return one if now.mono - one.began.mono < WAITS_S else None
