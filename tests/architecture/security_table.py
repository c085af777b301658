"""The table of routes in SECURITY.md; written by running this module."""

import re
import tempfile
from collections.abc import Iterator
from pathlib import Path

from fastapi import FastAPI
from fastapi.routing import iter_route_contexts

from iveg.app.dss import open_dss
from iveg.asgi import create_app
from iveg.settings import Settings
from iveg.web.security.audited import AUDITED, READING, Audited
from iveg.web.security.authentication import declared_action
from iveg.web.security.roles import MAY
from tests.processes import ROOT

PAGE = ROOT / "SECURITY.md"
_BEGIN, _END = "<!-- routes -->\n", "<!-- end of routes -->\n"
_HEAD = ("| route | who | audit |", "|---|---|---|")
_BY_ITSELF = "`sign_in`, `sign_in_refused`"


def table(app: FastAPI) -> str:
    """Every route that changes something, and those that few may read."""
    return "\n".join((*_HEAD, *sorted(_rows(app)))) + "\n"


def _rows(app: FastAPI) -> Iterator[str]:
    for route in iter_route_contexts(app.routes):
        action = declared_action(route)
        for method in sorted(set(route.methods or ())):
            kept = AUDITED.get((method, str(route.path)))
            if action is None or (method in READING and action in ("open", "read")):
                continue
            who = ", ".join(role for role in MAY if action in MAY[role])
            told = "all" if action == "open" else who
            yield f"| `{method} {route.path}` | {told} | {_word(kept)} |"


def _word(kept: Audited | None) -> str:
    if kept is None:
        return "–"
    return f"`{kept.action}`" if kept.action else _BY_ITSELF


def with_table(text: str, rows: str) -> str:
    """The page with this table in the place of its own."""
    inside = re.compile(f"(?<={_BEGIN}).*?(?={_END})", re.DOTALL)
    return inside.sub(f"\n{rows}\n", text)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as data:
        made = table(create_app(open_dss(Settings(), Path(data))))
    PAGE.write_text(with_table(PAGE.read_text(), made))
