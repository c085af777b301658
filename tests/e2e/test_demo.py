"""``iveg demo`` as somebody meets it: one line, one link, Ctrl-C."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.processes import Program, Site, children_of, is_alive, site, until

pytestmark = pytest.mark.e2e


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    with site(tmp_path_factory.mktemp("demo"), IVEG_RECORDINGS="on") as found:
        found.start("demo")
        found.wait_until_live()
        yield found


@pytest.fixture(scope="module")
def demo(place: Site) -> Program:
    return place.programs[0]


def test_the_demo_prints_one_line_with_the_link(demo: Program, place: Site) -> None:
    lines = re.findall(r"^iVeg: (\S+)$", demo.text(), re.MULTILINE)

    assert lines == [place.printed_link]


def test_both_robots_drive_without_anybody_touching_them(place: Site) -> None:
    with place.api() as api:

        def moving() -> bool:
            robots = api.get("robots").json()["items"]
            speeds = [abs((robot["twist"] or {}).get("linear", 0)) for robot in robots]
            return len(speeds) == 2 and min(speeds) > 0.05

        until(moving, "two robots driving at once")


def test_a_clean_run_ends_with_ctrl_c_and_leaves_nothing_behind(
    demo: Program, place: Site, tmp_path: Path
) -> None:
    family = children_of(demo.pid)
    assert len(family) >= 3

    status = demo.interrupt()

    assert status == 0
    assert demo.complaints() == []
    until(lambda: not any(map(is_alive, family)), "all children gone")
