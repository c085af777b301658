"""Size of the project in eight numbers, held by ``shape.toml``.

    python -m benchmarks.shape            # prints them, and statements by folder
    python -m benchmarks.shape --write    # lowers shape.toml to them; raises none

Vendored files, and pages that say in their first lines that they are generated, are
left out; so is the growers' guide.
"""

import ast
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from benchmarks.process import print_table
from tests.processes import ROOT

LIMITS = ROOT / "shape.toml"
_GUIDES = {"guide.md", "guia.md"}


def counted(root: Path = ROOT) -> dict[str, int]:
    """The eight numbers of a checkout, by the names of ``shape.toml``.

    Statements are ``ast.stmt`` without texts that stand alone (docstrings).
    """
    trees = [*_trees(root / "iveg").values()]
    return {
        "statements": sum(statements_of(tree) for tree in trees),
        "nodes": sum(1 for tree in trees for _ in ast.walk(tree)),
        "python_files": len(trees),
        "javascript_lines": _lines(root / "iveg/static", ".js"),
        "css_lines": _lines(root / "iveg/static", ".css"),
        "template_lines": _lines(root / "iveg/templates", ".html"),
        "test_lines": _lines(root / "tests", ".py") + _lines(root / "tests", ".js"),
        "words": sum(len(page.read_text().split()) for page in _pages(root)),
    }


def limits() -> dict[str, int]:
    """The numbers that none may exceed."""
    return tomllib.loads(LIMITS.read_text())


def statements_of(tree: ast.AST) -> int:
    """Number of statements of a module, docstrings left out."""
    return sum(
        isinstance(node, ast.stmt) and not _is_text(node) for node in ast.walk(tree)
    )


def _is_text(node: ast.AST) -> bool:
    """Whether it is a docstring, of a module or of a name."""
    if not isinstance(node, ast.Expr) or not isinstance(node.value, ast.Constant):
        return False
    return isinstance(node.value.value, str)


def _trees(folder: Path) -> dict[Path, ast.AST]:
    return {path: ast.parse(path.read_text()) for path in _files(folder, ".py")}


def _files(folder: Path, suffix: str) -> Iterator[Path]:
    found = sorted(folder.rglob(f"*{suffix}"))
    return (path for path in found if "vendor" not in path.parts)


def _lines(folder: Path, suffix: str) -> int:
    return sum(len(path.read_text().splitlines()) for path in _files(folder, suffix))


def _pages(root: Path) -> Iterator[Path]:
    for page in [*root.glob("*.md"), *(root / "docs").rglob("*.md")]:
        head = page.read_text().splitlines()[:5]
        is_generated = any("generated" in line for line in head)
        if page.name not in _GUIDES and not is_generated:
            yield page


def written(numbers: dict[str, int]) -> str:
    """Text of ``shape.toml`` with these numbers."""
    rows = "".join(f"{name} = {number}\n" for name, number in numbers.items())
    return (
        f"# Most that the project may have (benchmarks/shape.py); only lowered.\n{rows}"
    )


def main() -> int:
    """Print the numbers beside their limits, and statements by folder."""
    numbers, most = counted(), limits()
    if "--write" in sys.argv:
        LIMITS.write_text(
            written({name: min(one, most[name]) for name, one in numbers.items()})
        )
    rows = [[name, str(one), str(most[name])] for name, one in numbers.items()]
    print_table("Shape of the project", ["what", "now", "at most"], rows)
    folders: Counter[str] = Counter()
    for path, tree in _trees(ROOT / "iveg").items():
        parts = path.relative_to(ROOT).parts
        folders["/".join(parts[:2] if len(parts) > 2 else parts[:1])] += statements_of(
            tree
        )
    rows = [[name, str(one)] for name, one in sorted(folders.items())]
    print_table("Statements by folder", ["folder", "statements"], rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
