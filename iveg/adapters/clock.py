"""The machine's clocks; no other module reads them."""

import time

from iveg.domain.observations import Instant


def wall() -> float:
    """Wall clock (s, Unix time)."""
    return time.time()


def now() -> Instant:
    """This moment on the monotonic and the wall clock."""
    return Instant(time.monotonic(), time.time())
