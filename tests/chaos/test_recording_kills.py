"""A recorder is killed as it writes: all but its last two seconds can be read.

One kill in ``make test``; ``make chaos`` does a series.
"""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from iveg.adapters.recordings.directory import finish_broken
from iveg.adapters.recordings.reading import read_messages
from iveg.adapters.recordings.recorder import SETTLE_S, WRITE_S
from tests.processes import ROOT, until

KILLS = int(os.environ.get("IVEG_CHAOS_RECORDER_KILLS", "1"))
LATE_S = 1.0
"""Two cores that many share."""
RECORDER = """
import asyncio, sys
from pathlib import Path
from iveg.adapters import clock
from iveg.adapters.recordings.directory import RecordingDirectory
from iveg.adapters.recordings.recorder import InputRecorder
from iveg.domain.recordings import RecordingLimits

async def main():
    directory = RecordingDirectory(Path(sys.argv[1]))
    recorder = InputRecorder(directory, RecordingLimits(), clock.now)
    asyncio.create_task(recorder.run())
    while True:
        now = clock.now()
        recorder.measure("/iveg/AGI_odom/attrs", repr(now.mono).encode(), now, False)
        await asyncio.sleep(0.01)

asyncio.run(main())
"""


@pytest.mark.slow
@pytest.mark.timeout(60 + 30 * KILLS)
def test_a_killed_recorder_keeps_all_but_its_last_two_seconds(tmp_path: Path) -> None:
    for number in range(KILLS):
        folder = tmp_path / str(number)
        lived = 3.0 + number % 7 * 0.43
        killed_at = _run_and_kill(folder, lived)
        (left,) = folder.iterdir()
        finish_broken(left)
        (path,) = folder.iterdir()
        with read_messages(path) as reading:
            told = [float(payload) for _, _, payload in reading]
        assert reading.is_whole
        assert told == sorted(told)
        assert killed_at - told[-1] <= SETTLE_S + WRITE_S + LATE_S, number


def _run_and_kill(folder: Path, lived: float) -> float:
    """Run a recorder for a while; when it was killed (monotonic, s)."""
    command = [sys.executable, "-c", RECORDER, str(folder)]
    with subprocess.Popen(command, cwd=ROOT) as recorder:
        until(lambda: folder.is_dir() or None, 30.0, "it records")
        ends = time.monotonic() + lived
        until(lambda: time.monotonic() > ends or None, 30.0, "it has lived")
        recorder.kill()
        return time.monotonic()
