"""``iveg demo`` as somebody meets it: one line, one link, Ctrl-C."""

import re
from pathlib import Path

import pytest

from tests.processes import children_of, is_alive, site, until

pytestmark = pytest.mark.e2e


def test_the_demo_prints_its_link_drives_and_leaves_nothing_behind(
    tmp_path: Path,
) -> None:
    with site(tmp_path, IVEG_RECORDINGS="on") as place:
        demo = place.start("demo")
        place.wait_until_live()
        lines = re.findall(r"^iVeg: (\S+)$", demo.text(), re.MULTILINE)
        with place.api() as api:

            def both_drive() -> bool:
                robots = api.get("robots").json()["items"]
                speeds = [abs((one["twist"] or {}).get("linear", 0)) for one in robots]
                return len(speeds) == 2 and min(speeds) > 0.05

            until(both_drive, "two robots drive, and nobody has touched them")
        family = children_of(demo.pid)

        assert demo.interrupt() == 0
        assert lines == [place.printed_link]
        assert demo.complaints() == []
        assert len(family) >= 3
        until(lambda: not any(map(is_alive, family)), "all children gone")
