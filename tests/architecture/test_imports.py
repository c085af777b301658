"""The folder list is the dependency rule."""

import ast
import subprocess
import sys
from functools import cache
from pathlib import Path

from tests.processes import ROOT

MODULES = sorted((ROOT / "iveg").rglob("*.py"))
FORBIDDEN = ("TODO", "FIXME", "XXX", "NotImplementedError", "time.sleep(")
MOST_PARAMETERS = 6
DOCUMENTED = {"_asdict", "_replace", "_current_frames"}
"""Public in spite of their names: of named tuples, and of ``sys``."""
EVERYTHING = sorted(
    path
    for folder in ("iveg", "tests", "benchmarks", "migrations")
    for path in (ROOT / folder).rglob("*.py")
    if path != Path(__file__)
)


def test_imports_point_down_the_page() -> None:
    lint = Path(sys.executable).with_name("lint-imports")

    run = subprocess.run(
        [str(lint), "--no-cache"], cwd=ROOT, capture_output=True, text=True, check=False
    )

    assert run.returncode == 0, run.stdout + run.stderr


def test_a_module_opens_with_its_one_reason_to_exist() -> None:
    without = [
        str(path.relative_to(ROOT))
        for path in MODULES
        if _tree(path).body and not ast.get_docstring(_tree(path))
    ]

    assert without == []


def test_only_the_clock_reads_the_clock() -> None:
    readers = {
        str(path.relative_to(ROOT))
        for path in MODULES
        for node in ast.walk(_tree(path))
        if isinstance(node, ast.Import | ast.ImportFrom) and "time" in _names(node)
    }

    assert readers <= {"iveg/adapters/clock.py"}


def test_no_private_attribute_is_a_librarys() -> None:
    """Every ``_name`` that is read of an object is written somewhere in iVeg itself."""
    nodes = [(path, node) for path in MODULES for node in ast.walk(_tree(path))]
    ours = {name for _, node in nodes for name in _written(node)}
    found = [
        f"{path.relative_to(ROOT)}: {ast.unparse(node)}"
        for path, node in nodes
        if isinstance(node, ast.Attribute)
        and node.attr.startswith("_")
        and not node.attr.startswith("__")
        and node.attr not in ours | DOCUMENTED
    ]

    assert found == []


def test_one_door_of_the_product_names_the_laboratory() -> None:
    doors = {
        str(path.relative_to(ROOT))
        for path in MODULES
        if "lab" not in path.relative_to(ROOT / "iveg").parts
        for node in ast.walk(_tree(path))
        if isinstance(node, ast.Constant) and str(node.value).startswith("iveg.lab")
    }

    assert doors == {"iveg/cli/__init__.py"}


def test_a_constructor_has_six_parameters_at_most_and_no_default_does_nothing() -> None:
    long, idle = [], []
    for path in MODULES:
        if path.relative_to(ROOT / "iveg").parts[0] not in ("app", "vital", "comfort"):
            continue
        for node in ast.walk(_tree(path)):
            if not isinstance(node, ast.FunctionDef) or node.name != "__init__":
                continue
            given = node.args
            if len(given.args) + len(given.kwonlyargs) > 1 + MOST_PARAMETERS:
                long.append(f"{path.name}:{node.lineno}")
            defaults = (*given.defaults, *given.kw_defaults)
            if any(isinstance(one, ast.Lambda) for one in defaults):
                idle.append(f"{path.name}:{node.lineno}")

    assert long == []
    assert idle == []


def test_nothing_is_left_half_done() -> None:
    found = [
        f"{path.relative_to(ROOT)}: {word}"
        for path in EVERYTHING
        for word in FORBIDDEN
        if word in path.read_text()
    ]

    assert found == []


def test_front_end_modules_are_imported_relatively() -> None:
    """A bare name needs an import map, which the security policy blocks."""
    found = [
        f"{path.relative_to(ROOT)}: {line.strip()}"
        for path in sorted((ROOT / "iveg/static/js").rglob("*.js"))
        for line in path.read_text().splitlines()
        if line.lstrip().startswith(("import ", "export ")) and " from " in line
        if 'from "./' not in line and 'from "../' not in line
    ]

    assert found == []


def test_nothing_is_loaded_from_another_host() -> None:
    found = [
        f"{path.relative_to(ROOT)}: {line.strip()}"
        for folder, pattern in (("templates", "*.html"), ("static/css", "*.css"))
        for path in sorted((ROOT / "iveg" / folder).rglob(pattern))
        for line in path.read_text().splitlines()
        if _loads_from_afar(line)
    ]

    assert found == []


@cache
def _tree(path: Path) -> ast.Module:
    """A module of iVeg as it was written; three tests read it."""
    return ast.parse(path.read_text())


def _loads_from_afar(line: str) -> bool:
    loads = ("src=", "<link", "url(", "@import")
    return any(word in line for word in loads) and ("//" in line.split("<!--")[0])


def _written(node: ast.AST) -> set[str]:
    """Names that a node makes: of a function, a class, a variable or an attribute."""
    match node:
        case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
            return {name}
        case ast.Name(id=name, ctx=ast.Store()):
            return {name}
        case ast.Attribute(value=ast.Name(id="self"), attr=name, ctx=ast.Store()):
            return {name}
    return set()


def _names(node: ast.Import | ast.ImportFrom) -> set[str]:
    if isinstance(node, ast.ImportFrom):
        return {node.module or ""}
    return {alias.name for alias in node.names}
