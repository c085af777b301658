"""The product without its laboratory, as in the image of the server."""

import subprocess
import sys
from pathlib import Path

WITHOUT = "import sys; sys.modules['iveg.lab'] = None; "
SERVER = """
import pathlib
from fastapi.routing import iter_route_contexts
from iveg.app.dss import Dss, open_dss
from iveg.asgi import create_app
from iveg.settings import Settings
dss = open_dss(Settings(), pathlib.Path(sys.argv[1]))
paths = [str(route.path) for route in iter_route_contexts(create_app(dss).routes)]
print("/latency" in paths)
"""
COMMAND = """
from iveg.cli import main
main(sys.argv[1:])
"""


def run(program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """A Python in which nothing can import the laboratory."""
    return subprocess.run(
        [sys.executable, "-c", WITHOUT + program, *arguments],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )


def test_the_server_is_put_together_without_the_laboratory(tmp_path: Path) -> None:
    ended = run(SERVER, str(tmp_path))

    assert (ended.stdout.split(), ended.stderr) == (["True"], "")


def test_the_commands_of_the_laboratory_are_unknown() -> None:
    ended = run(COMMAND, "emulator")

    assert ended.returncode == 2
    assert "invalid choice: 'emulator'" in ended.stderr
