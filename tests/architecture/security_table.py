"""The table of routes in SECURITY.md; written by running this module."""

import re
import tempfile
from collections.abc import Iterator
from pathlib import Path

from fastapi import FastAPI
from fastapi.routing import iter_route_contexts

from iveg.app import App
from iveg.asgi import create_app
from iveg.domain.tracking import things
from iveg.settings import Settings
from iveg.web.api import alerts
from iveg.web.security.audited import AUDITED, READING, Audited
from iveg.web.security.roles import MAY
from tests.processes import ROOT
from tests.routes import declared_action

PAGE = ROOT / "SECURITY.md"
_BEGIN, _END = "<!-- routes -->\n", "<!-- end of routes -->\n"
_HEAD = ("| route | who | audit | limit |", "|---|---|---|---|")
_BY_ITSELF = "`sign_in`, `sign_in_refused`"
_API = "/api/v1"
_WRONG = "wrong ones as at sign-in"
_LIMITS = {
    "POST /signin": "20 a second; of an address five wrong, then one a minute",
    f"POST {_API}/robots/{{robot_id}}/release": "the holds that were seen",
    f"POST {_API}/robots/{{robot_id}}/goal": "one of a robot, the newest",
    f"PUT {_API}/rule": "upon the version that was seen",
    f"POST {_API}/rule/trial": "one at a time",
    f"POST {_API}/rule/trial/promote": "upon the version that was seen",
    f"POST {_API}/notes": f"{alerts.MOST_TEXT} characters",
    f"POST {_API}/alerts/acknowledge": f"{alerts.MOST_TOGETHER} alerts",
    f"POST {_API}/things": f"{things.MOST_THINGS}",
    f"PUT {_API}/account/password": _WRONG,
}
"""What bounds a route beside its role; of all others the size of the body alone."""


def table(app: FastAPI) -> str:
    """Every route that changes something, and those that few may read.

    Raises:
        LookupError: a limit is of a route that is none.
    """
    rows = sorted(_rows(app))
    gone = [route for route in _LIMITS if not any(f"`{route}`" in row for row in rows)]
    if gone:
        raise LookupError(gone)
    return "\n".join((*_HEAD, *rows)) + "\n"


def _rows(app: FastAPI) -> Iterator[str]:
    for route in iter_route_contexts(app.routes):
        action = declared_action(route)
        for method in sorted(set(route.methods or ())):
            kept = AUDITED.get((method, str(route.path)))
            if action is None or (method in READING and action in ("open", "read")):
                continue
            who = ", ".join(role for role in MAY if action in MAY[role])
            told = "all" if action == "open" else who
            limit = _LIMITS.get(f"{method} {route.path}", "–")
            yield f"| `{method} {route.path}` | {told} | {_word(kept)} | {limit} |"


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
        made = table(create_app(App(Settings(), Path(data))))
    PAGE.write_text(with_table(PAGE.read_text(), made))
