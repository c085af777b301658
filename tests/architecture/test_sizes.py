"""What a person reads at one go: files and functions keep their sizes.

A function counts its own lines; those of functions inside it are theirs.  A closure as
a whole, which elsewhere would be a class, has a limit of its own.
"""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from tests.architecture import javascript
from tests.architecture.javascript import Function
from tests.processes import ROOT

FOLDERS = ("iveg", "tests", "benchmarks")
FILE, FUNCTION, CLOSURE = 400, 60, 150
"""Lines at most; the aim is 300, 40 and 100."""
TESTS = 900
"""A file of tests lists the facts of one module, one after the other."""

TABLE = "one table or one format: it is looked up in, not read"
LARGE_FILES = {
    "iveg/settings.py": TABLE,
}


def test_files_keep_their_size() -> None:
    limits = {"tests": TESTS}

    large = {
        name: lines
        for name, text in _sources()
        if (lines := text.count("\n")) > limits.get(name.split("/")[0], FILE)
    }

    assert {name: n for name, n in large.items() if name not in LARGE_FILES} == {}


def test_functions_keep_their_size() -> None:
    large = {name: one.own for name, one in _functions() if one.own > FUNCTION}

    assert large == {}


def test_closures_keep_their_size() -> None:
    large = {name: one.whole for name, one in _functions() if one.whole > CLOSURE}

    assert large == {}


def test_files_that_may_be_larger_are_there() -> None:
    assert LARGE_FILES.keys() - dict(_sources()).keys() == set()


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("function f(a) {\n  g();\n}\n", [("f", 3, 3)]),
        (
            "function f({a, b}) {\n  const g = () => {\n    a();\n  };\n}",
            [("g", 3, 3), ("f", 2, 5)],
        ),
        ("const f = async (a) => {\n  if (a) {\n    b();\n  }\n};", [("f", 5, 5)]),
        ("class A {\n  #m(a) {\n    while (a) {\n    }\n  }\n}", [("#m", 4, 4)]),
        ("const s = `{ ${a({b: 1})} (`;\n// {\nf(/[{/]/);\n", []),
        ("on('x', function () {\n  y = \"}\";\n});\n", [("function", 3, 3)]),
    ],
)
def test_functions_of_a_script_are_found_by_their_braces(
    text: str, found: list[tuple[str, int, int]]
) -> None:
    assert [*javascript.functions(text)] == [Function(*one) for one in found]


@cache
def _sources() -> list[tuple[str, str]]:
    files = [file for name in FOLDERS for file in sorted((ROOT / name).rglob("*.*"))]
    return [
        (str(file.relative_to(ROOT)), file.read_text())
        for file in files
        if file.suffix in (".py", ".js") and file.parent.name != "vendor"
    ]


@cache
def _functions() -> list[tuple[str, Function]]:
    return [
        (f"{file} {one.name}", one)
        for file, text in _sources()
        for one in (
            _of(ast.parse(text), "")
            if Path(file).suffix == ".py"
            else javascript.functions(text)
        )
    ]


def _of(node: ast.AST, owner: str) -> Iterator[Function]:
    """Functions of a module, a class or a function, the outer before the inner."""
    for one in ast.iter_child_nodes(node):
        if isinstance(one, ast.FunctionDef | ast.AsyncFunctionDef):
            name = owner + one.name
            within = sum(map(_lines, _next_functions(one)))
            yield Function(name, _lines(one) - within, _lines(one))
            yield from _of(one, f"{name}.")
        elif isinstance(one, ast.ClassDef):
            yield from _of(one, f"{owner}{one.name}.")
        else:
            yield from _of(one, owner)


def _next_functions(node: ast.AST) -> Iterator[ast.stmt]:
    """Functions inside, without those inside of these."""
    for one in ast.iter_child_nodes(node):
        if isinstance(one, ast.FunctionDef | ast.AsyncFunctionDef):
            yield one
        else:
            yield from _next_functions(one)


def _lines(node: ast.stmt) -> int:
    return (node.end_lineno or node.lineno) - node.lineno + 1
