"""How processes beside the server keep out of its way."""

import contextlib
import os

_LESS_URGENT = 10


def give_way() -> None:
    """Let this process run where others leave room.

    Its priority is lower, and on Linux it is a batch: one that wakes takes no other's
    place on a processor (sched(7), ``SCHED_BATCH``).
    """
    os.nice(_LESS_URGENT)
    if hasattr(os, "SCHED_BATCH"):
        # Some containers allow no change; being late is all that is lost.
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
