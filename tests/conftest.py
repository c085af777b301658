"""What all tests share."""

import gc
import os
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings
from playwright.sync_api import expect
from xdist.scheduler import LoadScopeScheduling

from iveg.cli.running import tune_garbage_collection
from tests.patience import PATIENCE_MS

# A helper's failed assertion shows its values as a test's own does.
pytest.register_assert_rewrite("tests.processes")

# A busy machine may be slow without being wrong; the suite has its own time limits.
settings.register_profile("iveg", deadline=None, max_examples=50)
settings.register_profile("quick", deadline=None, max_examples=15)
settings.register_profile("thorough", deadline=None, max_examples=2000)
expect.set_options(timeout=PATIENCE_MS)
settings.load_profile(os.environ.get("IVEG_HYPOTHESIS", "iveg"))

_FOLDERS = ("chaos", "e2e", "integration", "properties", "contract", "unit")
_TOGETHER = {"e2e/driving": ("live", "supervision", "pages")}
"""Folders whose modules share a stack: one worker runs them, one after the other.

At first nothing complains, then somebody asks for what does, at last robots stand.
"""
_BUSY = (
    *("e2e/driving", "e2e/test_layout", "e2e/test_stop_states", "e2e/test_stop"),
    *("e2e/test_pacing", "chaos/test_backlog", "e2e/test_stop_restart"),
    *("e2e/test_early", "e2e/test_ros2", "e2e/test_demo"),
)
_WAITING = (
    *(
        "integration/test_faults",
        "integration/test_overload",
        "integration/test_replay",
    ),
    *("chaos/test_ros2_kills", "integration/test_emulator", "chaos/test_network"),
    *("chaos/test_kills", "chaos/test_faults"),
    *("integration/test_deploy", "integration/test_decisions"),
    *("integration/test_ros2_robot", "integration/test_doctor"),
)
"""The longest modules of both sorts, in falling order."""
_FIRST = [name for pair in zip(_BUSY, _WAITING, strict=False) for name in pair]
"""So browsers run beside modules that wait for processes, and no worker ends with a
long module alone."""
_MEEK = 5
_REAL = {"browser", "postgresql", "postgresql_url", "database_url", "empty_url"}
"""Fixtures that start programs."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadScopeScheduling:
    """A module, or a folder that shares a stack, stays together in one worker."""
    scheduler = LoadScopeScheduling(config, log)
    module_of = scheduler._split_scope
    scheduler._split_scope = lambda nodeid: _shared(nodeid) or module_of(nodeid)
    return scheduler


def _shared(nodeid: str) -> str | None:
    module = nodeid.split("::")[0]
    folder = module.removeprefix("tests/").rpartition("/")[0]
    return folder if folder in _TOGETHER else None


def pytest_collection() -> None:
    """What is imported stays; nobody looks through it for what nobody uses."""
    gc.disable()


def pytest_collection_finish() -> None:
    """From here on as in the programs that are tested."""
    tune_garbage_collection()
    gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what needs programs or a browser, and let the longest modules begin."""
    for item in items:
        if _folder(item) in ("chaos", "e2e", "integration") or _REAL & _fixtures(item):
            item.add_marker("real")
    items.sort(key=_turn)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """What only computes leaves the processors to programs that somebody waits for."""
    if "PYTEST_XDIST_WORKER" in os.environ and not item.get_closest_marker("real"):
        os.nice(max(0, _MEEK - os.nice(0)))


def _turn(item: pytest.Item) -> tuple[int, int, int]:
    path, place = _path(item), 0
    name, module = str(path.parent), path.stem.removeprefix("test_")
    if name in _TOGETHER:
        modules = _TOGETHER[name]
        place = modules.index(module) if module in modules else len(modules)
    else:
        name = str(path.with_suffix(""))
    first = _FIRST.index(name) if name in _FIRST else len(_FIRST)
    return first, place, _FOLDERS.index(_folder(item))


def _folder(item: pytest.Item) -> str:
    found = _path(item).parts[0]
    return found if found in _FOLDERS else "unit"


def _path(item: pytest.Item) -> Path:
    return item.path.relative_to(item.config.rootpath / "tests")


def _fixtures(item: pytest.Item) -> set[str]:
    return set(getattr(item, "fixturenames", ()))
