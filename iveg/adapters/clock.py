"""The machine's clocks; no other module reads them.

New ids: ULIDs (github.com/ulid/spec), made at each look and each judgement.
"""

import os
import time
from base64 import b32encode

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


_RANDOM_BYTES = 10
_LEFT_OUT = 6
"""Digits of four zero bytes, which fill the time up to whole groups of five."""
_CROCKFORD = bytes.maketrans(
    b"ABCDEFGHIJKLMNOPQRSTUVWXYZ234567", b"0123456789ABCDEFGHJKMNPQRSTVWXYZ"
)


def new_id() -> str:
    """A ULID: 48 bits of milliseconds, then 80 random bits; never reused.

    Ids of one millisecond are in no order.
    """
    moment = int(wall() * 1000).to_bytes(_RANDOM_BYTES, "big")
    digits = b32encode(moment + os.urandom(_RANDOM_BYTES)).translate(_CROCKFORD)
    return digits[_LEFT_OUT:].decode()
