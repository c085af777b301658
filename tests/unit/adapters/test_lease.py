"""One gate a robot: a second one is refused, and a dead one holds nothing."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from iveg.adapters.files import lease
from iveg.domain.errors import HopError
from tests.processes import ROOT

HOLDER = (
    "import sys, threading, pathlib;"
    "from iveg.adapters.files import lease;"
    "held = lease(pathlib.Path(sys.argv[1]), 'AGI');"
    "held.__enter__();"
    "print('held', flush=True); threading.Event().wait()"
)


def test_a_second_holder_is_refused_and_what_a_killed_one_held_is_free(
    tmp_path: Path,
) -> None:
    file = tmp_path / "AGI.lease"
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(file)],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        start_new_session=True,
    )
    assert holder.stdout is not None
    with holder.stdout:
        assert holder.stdout.readline() == b"held\n"
        with pytest.raises(HopError, match=rf"AGI is driven already.*{holder.pid}"):
            lease(file, "AGI").__enter__()

        holder.send_signal(signal.SIGKILL)
        holder.wait(10)

    with lease(file, "AGI"):
        assert file.exists()
