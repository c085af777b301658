"""A server that records is killed: its process ends the file, which can be read.

One kill in ``make test``; ``make chaos`` does a series.
"""

import os
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from iveg.adapters.recordings.mcap_file import read_messages
from iveg.adapters.recordings.recorder import WRITE_S
from tests.processes import ROOT, until

KILLS = int(os.environ.get("IVEG_CHAOS_RECORDER_KILLS", "1"))
LATE_S = 1.0
"""Two cores that many share."""
RECORDER = """
import asyncio, sys
from pathlib import Path
from iveg.adapters import clock
from iveg.adapters.recordings.recorder import InputRecorder
from tests.fakes.recordings import LIMITS, roomy

async def main():
    recorder = InputRecorder(Path(sys.argv[1]), clock.now, LIMITS, roomy)
    part = asyncio.create_task(recorder.run())
    while True:
        now = clock.now()
        recorder.measure("/iveg/AGI_odom/attrs", repr(now.mono).encode(), now)
        await asyncio.sleep(0.01)

asyncio.run(main())
"""


@pytest.mark.slow
@pytest.mark.timeout(60 + 30 * KILLS)
def test_a_server_that_is_killed_keeps_all_but_the_last_two_seconds(
    tmp_path: Path,
) -> None:
    for number in range(KILLS):
        folder = tmp_path / str(number)
        killed_at = _run_and_kill(folder, 3.0 + number % 7 * 0.43)
        (path,) = until(partial(_files, folder, "*.mcap"), "its process ends it")
        told = [float(payload) for _, _, payload in read_messages(path)]
        assert told == sorted(told)
        assert killed_at - told[-1] <= WRITE_S + LATE_S, number


def _files(folder: Path, pattern: str) -> list[Path]:
    return [*folder.glob(pattern)]


def _run_and_kill(folder: Path, lived: float) -> float:
    """Run a recorder for a while; when it was killed (monotonic, s)."""
    command = [sys.executable, "-c", RECORDER, str(folder)]
    with subprocess.Popen(command, cwd=ROOT) as recorder:
        until(partial(_files, folder, "*.open"), "it records")
        ends = time.monotonic() + lived
        until(lambda: time.monotonic() > ends or None, "it has lived")
        recorder.kill()
        return time.monotonic()
