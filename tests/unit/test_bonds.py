"""An interrupted test leaves nothing behind."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.processes import ROOT, is_alive, until

_PARENT = """
import subprocess, sys
from tests.bonds import bound

child = subprocess.Popen(bound(sys.executable, "-c", "input()"), stdin=subprocess.PIPE)
print(child.pid, flush=True)
input()
"""
_PARENT_THAT_FORKS = """
import sys
from pathlib import Path
from tests.processes import Site

program = Site(Path(sys.argv[1])).start("fiware")
program.wait_until_ready()
print(program.pid, flush=True)
input()
"""


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="a bond of Linux")
@pytest.mark.parametrize("source", [_PARENT, _PARENT_THAT_FORKS])
def test_a_program_ends_with_a_test_that_is_killed(source: str, tmp_path: Path) -> None:
    pipe = subprocess.PIPE
    words = [sys.executable, "-c", source, str(tmp_path)]
    with subprocess.Popen(words, cwd=ROOT, stdin=pipe, stdout=pipe) as parent:
        assert parent.stdout is not None
        child = int(parent.stdout.readline())
        assert is_alive(child)

        parent.kill()
        until(lambda: not is_alive(child), "the child has ended")
