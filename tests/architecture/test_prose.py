"""Heads of docstrings are noun phrases or verbs, and the error tree is drawn whole."""

import ast
import re
from collections.abc import Iterator

from iveg.domain import errors
from tests.processes import ROOT

_RIDDLE = re.compile(r"(Who|Whom|Whose|What|How|Of|The same|That)\b")


def test_no_head_of_a_docstring_is_a_riddle() -> None:
    found = {
        str(path.relative_to(ROOT / "iveg").with_suffix("")): heads
        for path in (ROOT / "iveg").rglob("*.py")
        if (heads := [*_riddles(ast.parse(path.read_text()))])
    }

    assert found == {}


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
