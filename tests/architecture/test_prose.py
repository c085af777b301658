"""Heads of docstrings are noun phrases or verbs, and the error tree is drawn whole."""

import ast
import re
from collections.abc import Iterator

from iveg.domain import errors
from tests.processes import ROOT

_RIDDLE = re.compile(r"(Who|Whom|Whose|What|How|Of|The same|That)\b")
_TO_DO = """
    adapters/direct adapters/files adapters/fiware_http adapters/identity_provider
    adapters/mqtt adapters/oidc adapters/passwords adapters/toml_files
    adapters/worker app/door cli/robot comfort/messenger comfort/shadow_run
    domain/accounts domain/audit domain/kinds domain/observations domain/peer_scan
    domain/probe domain/quantities domain/transports ngsi/codec/attributes
    ngsi/codec/feedback setting_types settings vital/__init__ vital/evaluate
    vital/event_log vital/log_messages vital/supervision web/api/account
    web/api/goals web/build web/live/pictures web/pages/signing web/refusals
    web/security/attempts web/security/audited web/security/authentication
    web/security/people web/security/rate_limits web/security/requirements
    web/security/sessions
"""
STILL_TO_DO = frozenset(_TO_DO.split())
"""Modules of ``iveg`` with such heads; this list only shrinks."""


def test_no_head_of_a_docstring_is_a_riddle() -> None:
    found = {
        str(path.relative_to(ROOT / "iveg").with_suffix("")): heads
        for path in (ROOT / "iveg").rglob("*.py")
        if (heads := [*_riddles(ast.parse(path.read_text()))])
    }

    assert {path: found[path] for path in found.keys() - STILL_TO_DO} == {}


def test_the_error_tree_is_drawn_whole() -> None:
    drawn = re.findall(r"\w+Error\b", errors.__doc__ or "")
    defined = [name for name in vars(errors) if name.endswith("Error")]

    assert sorted(drawn) == sorted(defined)


def _riddles(tree: ast.Module) -> Iterator[str]:
    documented = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
    for node in ast.walk(tree):
        text = ast.get_docstring(node) if isinstance(node, documented) else None
        if text and _RIDDLE.match(text):
            yield text.splitlines()[0]
