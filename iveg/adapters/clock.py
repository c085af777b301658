"""The one place that reads the machine's clocks."""

import time

from iveg.domain.observations import Instant


def now() -> Instant:
    """This moment on the monotonic and the wall clock."""
    return Instant(time.monotonic(), time.time())
