"""Every file and name of the tour is in the code, and so is every file of the map."""

import ast
import re
import tomllib
from functools import cache
from pathlib import Path

import pytest

from tests.architecture import documents
from tests.processes import ROOT

_ROW = re.compile(r"^\| \d+ \| `([^`]+)` \| ([^|]+) \|", re.M)


def rows(heading: str) -> list[tuple[str, list[str]]]:
    """File and names of each row under a heading of the tour that begins so."""
    parts = (documents.DOCS / "tour.md").read_text().split("\n## ")
    (part,) = [one for one in parts if one.startswith(heading)]
    return [(path, re.findall(r"`([^`]+)`", cell)) for path, cell in _ROW.findall(part)]


DETECTION, STOP = rows("One detection"), rows("One STOP")
STEPS = [(path, name) for path, names in (*DETECTION, *STOP) for name in names]
_FILE = re.compile(r"`((?:iveg|tests|benchmarks)/[\w/-]+\.\w+)`")


@cache
def _names(path: Path) -> set[str]:
    """Functions and classes of a file, methods with their class."""
    text = path.read_text()
    if path.suffix == ".js":
        return set(re.findall(r"\b(?:function|class) (\w+)\b", text))
    found = set()
    for node in ast.parse(text).body:
        match node:
            case ast.FunctionDef() | ast.AsyncFunctionDef():
                found.add(node.name)
            case ast.ClassDef():
                found |= {node.name, *(f"{node.name}.{one}" for one in _methods(node))}
    return found


def _methods(of: ast.ClassDef) -> set[str]:
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef)
    return {node.name for node in of.body if isinstance(node, kinds)}


def test_the_tour_has_both_ways() -> None:
    assert len(STEPS) > 50


@pytest.mark.parametrize(("path", "name"), STEPS, ids=lambda one: str(one))
def test_every_name_of_the_tour_is_in_its_file(path: str, name: str) -> None:
    assert name in _names(ROOT / path)


@pytest.mark.parametrize("page", documents.pages(), ids=lambda one: one.name)
def test_every_file_that_a_page_names_exists(page: Path) -> None:
    named = set(_FILE.findall(page.read_text()))
    ours = page.name != "CHANGELOG.md"

    assert {one for one in named if ours and not (ROOT / one).exists()} == set()


def test_the_map_has_the_layers_that_imports_are_held_to() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    contracts = project["tool"]["importlinter"]["contracts"]
    (held,) = [one["layers"] for one in contracts if one["name"] == "layers"]
    page = documents.section((documents.DOCS / "architecture.md").read_text(), "Layers")

    drawn = re.findall(r"^(\S+(?: \| \S+)*) {2,}", page, re.M)

    assert drawn == held


def test_every_class_that_the_glossary_names_is_in_the_code() -> None:
    page = (documents.DOCS / "glossary.md").read_text()
    named = set(re.findall(r"`([A-Z][a-z]+(?:[A-Z]\w*|\w*))`", page))
    classes = {name for path in (ROOT / "iveg").rglob("*.py") for name in _names(path)}

    assert named - classes == set()
