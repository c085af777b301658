"""Heads of docstrings are noun phrases or verbs, and the error tree is drawn whole."""

import ast
import re
from collections.abc import Iterator

from iveg.domain import errors
from tests.processes import ROOT

_GONE = {"asked", "circle", "door", "face", "of", "one", "ring", "told"}
_RIDDLE = re.compile(r"(Who|Whom|Whose|What|How|Of|The same|That)\b")


def test_no_head_of_a_docstring_is_a_riddle() -> None:
    found = {
        str(path.relative_to(ROOT / "iveg").with_suffix("")): heads
        for path in (ROOT / "iveg").rglob("*.py")
        if (heads := [*_riddles(ast.parse(path.read_text()))])
    }

    assert found == {}


def test_no_name_is_a_word_that_says_nothing() -> None:
    found = {
        f"{path.relative_to(ROOT / 'iveg')}:{line} {name}"
        for path in (ROOT / "iveg").rglob("*.py")
        for name, line in _names(ast.parse(path.read_text()))
        if name in _GONE
    }

    assert found == set()


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


def _names(tree: ast.Module) -> Iterator[tuple[str, int]]:
    """Names that a module gives, and where."""
    for node in ast.walk(tree):
        match node:
            case ast.Name(id=name, ctx=ast.Store()) | ast.arg(arg=name):
                yield name, node.lineno
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                yield name, node.lineno
            case ast.Attribute(attr=name, ctx=ast.Store()):
                yield name, node.lineno
