"""What the tests prove, counted from their text, so that speed never costs a proof.

``tests/proofs.toml`` is the list that is kept: no number in it may fall without being
changed there, in sight.  ``python -m tests.proofs > tests/proofs.toml`` writes it anew.
"""

import ast
import re
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from tests.processes import ROOT

TESTS = ROOT / "tests"
_NAMED = re.compile(r"def (?:test_)?((?:[RILFrilf]\d+_)+)|assert .*\"([RIL]\d+)[\":,]")
_TITLED = re.compile(r'^test\("([RILF]\d+) ', re.MULTILINE)
Counts = dict[str, dict[str, int]]


def kept() -> Counts:
    """The list."""
    return tomllib.loads((TESTS / "proofs.toml").read_text())


def counted() -> Counts:
    """What the tests have now.

    Returns:
        ``facts``: tests, invariants and assertions that name it, by id (R, I and L:
        docs/safety.md; F: the rows of docs/faults.md).  ``properties``: tests that
        Hypothesis feeds, by file.  ``repeats``: how often they are fed, or something is
        killed, pressed or drawn, by file and name.
    """
    return {
        "facts": dict(sorted(Counter(_facts()).items(), key=lambda it: _order(it[0]))),
        "properties": {
            _name(file): file.read_text().count("@given(")
            for file in _files()
            if "@given(" in file.read_text()
        },
        "repeats": dict(_repeats()),
    }


def _order(fact: str) -> tuple[str, int]:
    return fact[0], int(fact[1:])


def _files() -> list[Path]:
    return sorted(TESTS.rglob("test_*.py"))


def _name(file: Path) -> str:
    return str(file.relative_to(TESTS))


def _facts() -> Iterator[str]:
    for file in _files():
        for names, said in _NAMED.findall(file.read_text()):
            yield from (it.upper() for it in names.split("_") if it)
            if said:
                yield said
    for file in sorted(TESTS.rglob("*.test.js")):
        yield from _TITLED.findall(file.read_text())


def _repeats() -> Iterator[tuple[str, int]]:
    for file in [TESTS / "conftest.py", *_files()]:
        text, name = file.read_text(), _name(file)
        for number, told in enumerate(re.findall(r"max_examples=(\d+)", text)):
            yield f"{name} max_examples {number}", int(told)
        if file.parent.name in ("properties", "chaos"):
            yield from ((f"{name} {key}", n) for key, n in _constants(text))


def _constants(text: str) -> Iterator[tuple[str, int]]:
    """Whole numbers that a module names, also those that the environment may change."""
    for node in ast.parse(text).body:
        if isinstance(node, ast.Assign):
            target, value = node.targets[0], node.value
            is_pair = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
            names = target.elts if is_pair else [target]  # type: ignore[attr-defined]
            values = value.elts if is_pair else [value]  # type: ignore[attr-defined]
            for one, said in zip(names, values, strict=True):
                found = re.fullmatch(
                    r"(?:int\(os\.environ\.get\('\w+', ')?(\d+)(?:'\)\))?",
                    ast.unparse(said),
                )
                if found:
                    yield ast.unparse(one), int(found[1])


def main() -> None:
    """Print the list as it would be now."""
    print("# What the tests prove: `python -m tests.proofs` counts it.")
    for section, numbers in counted().items():
        print(f"\n[{section}]")
        for name, number in numbers.items():
            print(f'"{name}" = {number}')


if __name__ == "__main__":
    main()
