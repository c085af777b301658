"""The machine's clocks; no other module reads them."""

import time

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
