"""The measure of the product's size."""

from benchmarks.shape import Shape, shape_of

TEXT = '''"""A module."""

from typing import Any


def said(one: list[Any], two: int) -> Any:
    """What it says."""
    three: dict[str, int] = {}
    return one or three  # type: ignore
'''


def test_docstrings_are_no_statements_and_any_counts_in_annotations_alone() -> None:
    assert shape_of(TEXT) == Shape(statements=4, lines=9, anys=2, ignores=1)
