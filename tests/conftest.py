"""What all tests share."""

import os
from pathlib import Path

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

_FOLDERS = ("chaos", "e2e", "integration", "properties", "contract", "unit")
_BUSY = (
    *("e2e/test_stop_states", "e2e/test_matrix", "e2e/test_pages"),
    *("e2e/test_supervision", "e2e/test_stop", "e2e/test_live", "e2e/test_pacing"),
    *(
        "chaos/test_backlog",
        "e2e/test_stop_restart",
        "e2e/test_pictures",
        "e2e/test_faults",
    ),
    *("e2e/test_probes", "e2e/test_stop_drills"),
)
_WAITING = (
    *("integration/test_faults", "integration/test_overload"),
    *("integration/test_scenarios", "integration/test_replay"),
    *("chaos/test_ros2_kills", "integration/test_emulator", "chaos/test_network"),
    *("integration/test_robot_node", "chaos/test_kills", "chaos/test_faults"),
    *("integration/test_deploy", "integration/test_decisions"),
    "integration/test_doctor",
)
"""The longest modules of both sorts, in falling order."""
_FIRST = [name for pair in zip(_BUSY, _WAITING, strict=True) for name in pair]
"""So browsers run beside modules that wait for processes, and no worker ends with a
long module alone."""
_REAL = {"browser", "postgresql", "postgresql_url", "database_url"}
"""Fixtures that start programs."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what needs programs or a browser, and let the longest modules begin."""
    for item in items:
        if _folder(item) in ("chaos", "e2e", "integration") or _REAL & _fixtures(item):
            item.add_marker("real")
    items.sort(key=_turn)


def _turn(item: pytest.Item) -> tuple[int, int]:
    name = str(_path(item).with_suffix(""))
    first = _FIRST.index(name) if name in _FIRST else len(_FIRST)
    return first, _FOLDERS.index(_folder(item))


def _folder(item: pytest.Item) -> str:
    found = _path(item).parts[0]
    return found if found in _FOLDERS else "unit"


def _path(item: pytest.Item) -> Path:
    return item.path.relative_to(item.config.rootpath / "tests")


def _fixtures(item: pytest.Item) -> set[str]:
    return set(getattr(item, "fixturenames", ()))
