"""Passwords by Argon2id (RFC 9106), off the loop and no faster than one thread."""

import os

from cryptography.exceptions import InvalidKey
from cryptography.hazmat.primitives.kdf.argon2 import Argon2id

from iveg.adapters.bounded_thread import BoundedThread

LEAST, MOST = 10, 256
"""Characters of a password."""
_KIB, _PASSES, _LANES = 19 * 1024, 2, 1
"""OWASP Password Storage Cheat Sheet."""


class Passwords:
    """Hashes and checks passwords in a thread of its own; tests pass another."""

    def __init__(self, thread: BoundedThread | None = None) -> None:
        self._thread = thread or BoundedThread("passwords")
        self._nobodys = ""

    async def hashed(self, password: str) -> str:
        """The hash to keep (PHC string format).

        Raises:
            BusyError: too many wait.
        """
        return await self._thread.run(_hash, password)

    async def fits(self, password: str, kept: str) -> bool:
        """Whether a password is the one whose hash is kept.

        An empty hash takes the same time as a wrong password: nobody learns by it which
        names exist.

        Raises:
            BusyError: too many wait.
        """
        if not self._nobodys:
            self._nobodys = await self._thread.run(_hash, "")
        fits = await self._thread.run(_fits, password, kept or self._nobodys)
        return fits and bool(kept)

    def close(self) -> None:
        """End the thread."""
        self._thread.close()


def _hash(password: str) -> str:
    kdf = Argon2id(
        salt=os.urandom(16),
        length=32,
        iterations=_PASSES,
        lanes=_LANES,
        memory_cost=_KIB,
    )
    return kdf.derive_phc_encoded(password.encode())


def _fits(password: str, kept: str) -> bool:
    try:
        Argon2id.verify_phc_encoded(password.encode(), kept)
    except (InvalidKey, ValueError):
        return False
    return True
