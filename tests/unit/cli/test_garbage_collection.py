"""What a program that runs for months does about memory."""

import gc
from collections.abc import Iterator

import pytest

from iveg.cli.running import tune_garbage_collection

_PYTHONS = 700, 10, 10
"""Its own thresholds; the suite has settled, too (tests/conftest.py)."""


@pytest.fixture(autouse=True)
def as_it_was() -> Iterator[None]:
    before = gc.get_threshold()
    gc.set_threshold(*_PYTHONS)
    gc.unfreeze()
    yield
    gc.freeze()
    gc.set_threshold(*before)


def test_what_was_built_by_then_is_looked_at_no_more() -> None:
    often, _, _ = gc.get_threshold()
    built = [[number] for number in range(100)]
    tune_garbage_collection()

    assert gc.get_freeze_count() >= len(built)
    assert gc.get_threshold()[0] > 10 * often
