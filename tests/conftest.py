"""What all tests share."""

import os

import pytest
from hypothesis import settings
from playwright.sync_api import expect

# A helper's failed assertion shows its values as a test's own does.
pytest.register_assert_rewrite("tests.processes")

# A busy machine may be slow without being wrong; the suite has its own time limits.
settings.register_profile("iveg", deadline=None, max_examples=100)
settings.register_profile("quick", deadline=None, max_examples=15)
settings.register_profile("thorough", deadline=None, max_examples=2000)
expect.set_options(timeout=20_000)
settings.load_profile(os.environ.get("IVEG_HYPOTHESIS", "iveg"))

_LONGEST_FIRST = ("chaos", "e2e", "integration", "properties", "contract", "unit")
"""Where tests run side by side, no worker ends with the longest module alone."""
_REAL = {"browser", "postgresql", "postgresql_url", "database_url"}
"""Fixtures that start programs."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what needs programs or a browser, and let the longest folders begin."""
    for item in items:
        if _folder(item) in ("chaos", "e2e", "integration") or _REAL & _fixtures(item):
            item.add_marker("real")
    items.sort(key=lambda item: _LONGEST_FIRST.index(_folder(item)))


def _folder(item: pytest.Item) -> str:
    found = item.path.relative_to(item.config.rootpath / "tests").parts[0]
    return found if found in _LONGEST_FIRST else "unit"


def _fixtures(item: pytest.Item) -> set[str]:
    return set(getattr(item, "fixturenames", ()))
