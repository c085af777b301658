"""How processes beside the server keep out of its way."""

import contextlib
import os
from pathlib import Path

LESS_URGENT = 10
"""Of a process whose work may be late."""
_FIRST_TO_GO = "1000"


def give_way(less_urgent: int = LESS_URGENT) -> None:
    """Let this process run where others leave room.

    Its priority is so much lower (nice), and on Linux it is a batch: one that wakes
    takes no other's place on a processor (sched(7), ``SCHED_BATCH``).  Where memory
    runs out the kernel ends it, and not the server (proc_pid_oom_score_adj(5)).
    """
    os.nice(less_urgent)
    if hasattr(os, "SCHED_BATCH"):
        # Some containers allow no change; being late is all that is lost.
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(_FIRST_TO_GO)
