"""The machine's clocks; no other module reads them.

New ids: ULIDs (github.com/ulid/spec), made at each look and each judgement.
"""

import os
import time
from base64 import b32encode
from functools import lru_cache

from iveg.domain.observations import Instant


def wall() -> float:
    """Wall clock (s, Unix time)."""
    return time.time()


def mono() -> float:
    """Monotonic clock (s)."""
    return time.monotonic()


def thread_cpu() -> float:
    """CPU that the calling thread has used (s)."""
    return time.thread_time()


def now() -> Instant:
    """This moment on the monotonic and the wall clock."""
    return Instant(mono(), wall())


_RANDOM_BYTES, _RANDOM_DIGITS = 10, 16
_MADE_AT_ONCE = 64
_LEFT_OUT = 6
"""Digits of ten bytes that are always zero where six hold the time."""
_CROCKFORD = bytes.maketrans(
    b"ABCDEFGHIJKLMNOPQRSTUVWXYZ234567", b"0123456789ABCDEFGHJKMNPQRSTVWXYZ"
)


def new_id() -> str:
    """A ULID: 48 bits of milliseconds, then 80 random bits; never reused.

    Ids of one millisecond are in no order.
    """
    if not _unused:
        digits = _digits(os.urandom(_MADE_AT_ONCE * _RANDOM_BYTES))
        starts = range(0, len(digits), _RANDOM_DIGITS)
        _unused.extend(digits[start : start + _RANDOM_DIGITS] for start in starts)
    return _of_moment(int(wall() * 1000)) + _unused.pop()


_unused: list[str] = []


@lru_cache(maxsize=1)
def _of_moment(milliseconds: int) -> str:
    return _digits(milliseconds.to_bytes(_RANDOM_BYTES, "big"))[_LEFT_OUT:]


def _digits(data: bytes) -> str:
    return b32encode(data).translate(_CROCKFORD).decode()
