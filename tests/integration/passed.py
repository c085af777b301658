"""Runs a program and writes which functions it passed: files and qualified names.

``python -m tests.integration.passed WORD …`` is ``python -m iveg WORD …``; the list is
in ``passed-WORD.json`` in the working directory when it has ended.
"""

import atexit
import json
import sys
import threading
from importlib import import_module
from pathlib import Path
from types import CodeType, FrameType

from iveg.cli import main
from tests.forge import PARTS
from tests.processes import ROOT

_PASSED: set[CodeType] = set()


def _note(frame: FrameType, event: str, _: object) -> None:
    if event == "call":
        _PASSED.add(frame.f_code)


def _write(file: Path) -> None:
    sys.setprofile(None)
    ours = ((Path(one.co_filename), one.co_qualname) for one in _PASSED)
    found = sorted(
        (str(path.relative_to(ROOT)), name)
        for path, name in ours
        if path.is_relative_to(ROOT / "iveg")
    )
    file.write_text(json.dumps(found))


if __name__ == "__main__":
    # What only defines functions passes none, and takes long where each is noted.
    import_module(next(it for it in PARTS if it.endswith(f".{sys.argv[1]}")))
    atexit.register(_write, Path.cwd() / f"passed-{sys.argv[1]}.json")
    threading.setprofile(_note)
    sys.setprofile(_note)
    sys.exit(main(sys.argv[1:]))
