"""How large the product is: statements, lines and files of each folder of ``iveg``.

    python -m benchmarks.shape

Docstrings are no statements.  Of files the median and the 95th percentile of lines are
told, and for all of them annotations with ``Any`` and comments ``type: ignore``.
"""

import ast
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from statistics import median

from benchmarks.process import percentile, print_table
from tests.processes import ROOT


@dataclass(frozen=True, slots=True)
class Shape:
    """What one file has.

    Attributes:
        anys: Annotations that name ``Any``.
        ignores: Comments that tell the type checker to look away.
    """

    statements: int
    lines: int
    anys: int
    ignores: int


def shape_of(text: str) -> Shape:
    """The shape of a module's text."""
    nodes = list(ast.walk(ast.parse(text)))
    statements = sum(isinstance(one, ast.stmt) and not _is_text(one) for one in nodes)
    return Shape(
        statements,
        len(text.splitlines()),
        sum(_names_any(one) for one in _annotations(nodes)),
        text.count("# type: ignore"),
    )


def _is_text(node: ast.AST) -> bool:
    """Whether it is a docstring, of a module or of a name."""
    if not isinstance(node, ast.Expr) or not isinstance(node.value, ast.Constant):
        return False
    return isinstance(node.value.value, str)


def _annotations(nodes: Iterable[ast.AST]) -> Iterator[ast.expr]:
    for node in nodes:
        match node:
            case ast.arg(annotation=ast.expr() as found):
                yield found
            case ast.AnnAssign(annotation=found):
                yield found
            case ast.FunctionDef(returns=ast.expr() as found):
                yield found
            case ast.AsyncFunctionDef(returns=ast.expr() as found):
                yield found


def _names_any(annotation: ast.expr) -> bool:
    return any(
        isinstance(node, ast.Name) and node.id == "Any" for node in ast.walk(annotation)
    )


def main() -> int:
    """Print a row for each folder, and one for all."""
    folders: defaultdict[str, list[Shape]] = defaultdict(list)
    for path in sorted((ROOT / "iveg").rglob("*.py")):
        parts = path.relative_to(ROOT).parts
        shape = shape_of(path.read_text())
        folders["/".join(parts[:2] if len(parts) > 2 else parts[:1])].append(shape)
    everything = [shape for found in folders.values() for shape in found]
    rows = [_row(name, found) for name, found in sorted(folders.items())]
    print_table("Shape of iveg", _HEAD, [*rows, _row("all", everything)])
    anys, ignores = (sum(getattr(one, of) for one in everything) for of in _COUNTED)
    print(f"Any in annotations: {anys}; type: ignore: {ignores}")
    return 0


_HEAD = ["folder", "statements", "lines", "files", "median", "P95"]
_COUNTED = "anys", "ignores"


def _row(name: str, found: list[Shape]) -> list[str]:
    lines = sorted(one.lines for one in found)
    return [
        name,
        str(sum(one.statements for one in found)),
        str(sum(lines)),
        str(len(found)),
        f"{median(lines):.0f}",
        f"{percentile(lines, 0.95):.0f}",
    ]


if __name__ == "__main__":
    sys.exit(main())
