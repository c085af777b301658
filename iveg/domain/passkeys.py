"""Passkeys of people (WebAuthn): what is kept of each, and challenges that wait."""

from collections import OrderedDict
from dataclasses import dataclass
from typing import Final

CHALLENGE_S: Final = 300.0
"""How long a challenge waits for its answer (s)."""
MOST_CHALLENGES, MOST_OF_ONE = 1000, 20
MOST_PASSKEYS: Final = 10
"""Of one person."""


@dataclass(frozen=True, slots=True)
class Passkey:
    """A key pair on a person's device, of which the public half is kept.

    Attributes:
        credential_id: As the device names it (base64url).
        rp_id: The host name that it was made for, and works at alone.
        public_key: COSE key (base64url).
        sign_count: The newest count of uses that the device told; 0: it counts none.
        made_at: When (Unix s); ``used_at`` when somebody signed in by it last.
    """

    credential_id: str
    account_id: str
    name: str
    rp_id: str
    public_key: str
    sign_count: int
    made_at: float
    used_at: float | None = None


@dataclass(frozen=True, slots=True)
class _Waiting:
    of: str
    purpose: str
    at: float


class Challenges:
    """Challenges that were given out, each for one answer; bounded.

    Beyond twenty of one asker their oldest gives way, so that a stranger who asks
    without end takes the place of nobody else; beyond a thousand the oldest of all.
    """

    def __init__(self) -> None:
        self._waiting: OrderedDict[bytes, _Waiting] = OrderedDict()

    def add(self, challenge: bytes, of: str, purpose: str, now: float) -> None:
        """Await the answer to a challenge.

        Args:
            challenge: Random bytes.
            of: Who asked: an address or an account.
            purpose: What an answer may be used for.
            now: Monotonic time (s).
        """
        own = [one for one, waiting in self._waiting.items() if waiting.of == of]
        if len(own) >= MOST_OF_ONE:
            del self._waiting[own[0]]
        elif len(self._waiting) >= MOST_CHALLENGES:
            self._waiting.popitem(last=False)
        self._waiting[challenge] = _Waiting(of, purpose, now)

    def redeem(self, challenge: bytes, purpose: str, now: float) -> bool:
        """Whether an answer is awaited for this purpose; it is not any more."""
        waiting = self._waiting.pop(challenge, None)
        if waiting is None or waiting.purpose != purpose:
            return False
        return now - waiting.at <= CHALLENGE_S
