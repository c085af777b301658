"""Passwords by Argon2id (RFC 9106), in one thread beside the loop.

One thread is the bound: a flood of sign-ins takes half a core at most, never the loop
on which a STOP runs.
"""

import asyncio
import os
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Final, TypeVar

from cryptography.exceptions import InvalidKey
from cryptography.hazmat.primitives.kdf.argon2 import Argon2id

from iveg.domain.errors import BusyError

LEAST, MOST = 10, 256
"""Characters of a password."""
_T = TypeVar("_T")
_MOST_WAITING: Final = 16
_NICENESS: Final = 10
_KIB, _PASSES, _LANES = 19 * 1024, 2, 1
"""Memory (KiB), passes and lanes of the OWASP Password Storage Cheat Sheet."""
_NOBODYS: Final = (
    f"$argon2id$v=19$m={_KIB},t={_PASSES},p={_LANES}${'A' * 22}${'A' * 43}"
)
"""Hash that fits no password; its check takes as long as any."""


class Passwords:
    """Hashes and checks passwords one after the other; sixteen at most wait."""

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(1, "passwords", _step_back)
        self._waiting = 0

    async def hashed(self, password: str) -> str:
        """Hash of a password, for storage (PHC string format).

        Raises:
            BusyError: too many wait.
        """
        return await self._run(_hash, password)

    async def fits(self, password: str, kept: str) -> bool:
        """Whether a password has the stored hash.

        An empty hash takes the same time as a wrong password, so that time does not
        reveal which names exist.

        Raises:
            BusyError: too many wait.
        """
        return (await self._run(_fits, password, kept or _NOBODYS)) and bool(kept)

    async def _run(self, work: Callable[..., _T], *texts: str) -> _T:
        if self._waiting >= _MOST_WAITING:
            raise BusyError
        self._waiting += 1
        try:
            return await asyncio.wrap_future(self._thread.submit(work, *texts))
        finally:
            self._waiting -= 1

    def close(self) -> None:
        """End the thread."""
        self._thread.shutdown(wait=False)


def _step_back() -> None:
    """Let the loop's thread run first; only Linux has a niceness of threads."""
    if sys.platform == "linux":
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)


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
