"""The product without its laboratory, as in the image of the server."""

import subprocess
import sys
from pathlib import Path

WITHOUT = "import sys; sys.modules['iveg.lab'] = None; "
SERVER = """
import pathlib
from fastapi.routing import iter_route_contexts
from iveg.app import App
from iveg.asgi import create_app
from iveg.settings import Settings
app = App(Settings(), pathlib.Path(sys.argv[1]))
paths = [str(route.path) for route in iter_route_contexts(create_app(app).routes)]
print("/latency" in paths)
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


def test_without_it_the_server_is_put_together_and_its_commands_are_unknown(
    tmp_path: Path,
) -> None:
    server = run(SERVER, str(tmp_path))
    command = run("from iveg.cli import main; main(['emulator'])")

    assert (server.stdout.split(), server.stderr) == (["True"], "")
    assert command.returncode == 2
    assert "invalid choice: 'emulator'" in command.stderr
