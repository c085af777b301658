"""Each row of ``docs/faults.md`` has a test with its number, and each test a row."""

import re

from tests.processes import ROOT


def _told() -> set[int]:
    page = (ROOT / "docs/faults.md").read_text()
    return {int(number) for number in re.findall(r"^\| F(\d+) \|", page, re.MULTILINE)}


def _proven() -> set[int]:
    tests = "".join(file.read_text() for file in (ROOT / "tests").rglob("test_*.py"))
    names = re.findall(r"def test((?:_f\d+)+)_", tests)
    return {int(number) for name in names for number in re.findall(r"\d+", name)}


def test_every_fault_that_is_told_is_proven() -> None:
    assert _told() - _proven() == set()


def test_every_fault_that_is_proven_is_told() -> None:
    assert _proven() - _told() == set()
