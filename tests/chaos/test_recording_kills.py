"""Who records is killed: the process that writes, or the server that feeds it.

All but the writer's last two seconds can be read; it finishes what a dead server left.

One kill in ``make test``; ``make chaos`` does a series.
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from iveg.adapters.recordings.mcap_file import finish_broken, read_messages
from iveg.adapters.recordings.recorder import WRITE_S
from iveg.adapters.recordings.writer import SETTLE_S
from tests.processes import ROOT, children_of, until

KILLS = int(os.environ.get("IVEG_CHAOS_RECORDER_KILLS", "1"))
LATE_S = 1.0
"""Two cores that many share."""
RECORDER = """
import asyncio, sys
from pathlib import Path
from iveg.adapters import clock
from iveg.adapters.recordings.recorder import InputRecorder
from iveg.adapters.recordings.writer import WriterSetup
from iveg.domain.retention import DiskSpace

async def main():
    space = DiskSpace(10**12, 10**12)
    setup = WriterSetup(Path(sys.argv[1]))
    recorder = InputRecorder(setup, clock.now, read_space=lambda _: space)
    asyncio.create_task(recorder.run())
    while True:
        now = clock.now()
        recorder.measure("/iveg/AGI_odom/attrs", repr(now.mono).encode(), now)
        await asyncio.sleep(0.01)

asyncio.run(main())
"""


@pytest.mark.slow
@pytest.mark.timeout(60 + 30 * KILLS)
def test_who_records_is_killed_and_keeps_all_but_the_last_two_seconds(
    tmp_path: Path,
) -> None:
    for number in range(KILLS):
        folder = tmp_path / str(number)
        lived = 3.0 + number % 7 * 0.43
        spares_writer = number % 2 == 1
        killed_at = _run_and_kill(folder, lived, spares_writer=spares_writer)
        if spares_writer:
            until(lambda: not _left_open(folder), "it is finished")  # noqa: B023
        else:
            finish_broken(*_left_open(folder))
        (path,) = folder.iterdir()
        with read_messages(path) as reading:
            told = [float(payload) for _, _, payload in reading]
        assert reading.is_whole
        assert told == sorted(told)
        lost_s = WRITE_S if spares_writer else SETTLE_S + WRITE_S
        assert killed_at - told[-1] <= lost_s + LATE_S, number


def _left_open(folder: Path) -> list[Path]:
    return [*folder.glob("*.open")]


def _run_and_kill(folder: Path, lived: float, *, spares_writer: bool) -> float:
    """Run a recorder for a while; when it was killed (monotonic, s)."""
    command = [sys.executable, "-c", RECORDER, str(folder)]
    with subprocess.Popen(command, cwd=ROOT) as recorder:
        until(lambda: _left_open(folder) or None, "it records")
        ends = time.monotonic() + lived
        until(lambda: time.monotonic() > ends or None, "it has lived")
        (writer,) = children_of(recorder.pid)
        if not spares_writer:
            os.kill(writer, signal.SIGKILL)
        recorder.kill()
        return time.monotonic()
