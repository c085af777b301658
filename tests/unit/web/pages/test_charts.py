"""Rows become figures: shades and gaps, and the script that draws them."""

import importlib.resources
import re

import orjson

from iveg.adapters.history.series import Series
from iveg.domain.fleet import FleetDescription
from iveg.web.pages import charts

STATIC = importlib.resources.files("iveg") / "static"
SCRIPT = (STATIC / "vendor/plotly-basic.min.js").read_bytes()


def test_the_slow_downs_of_a_robot_are_shaded() -> None:
    values = {
        "linear": (0.8, 0.4, 0.4, 0.8),
        "limit_factor": (1.0, 0.5, 0.5, 1.0),
    }
    slowed = Series((10.0, 11.0, 12.0, 13.0), values)
    fleet = FleetDescription.undescribed(["AGI"])

    figure = orjson.loads(charts.speed_figure("AGI", slowed, fleet))

    (slow,) = figure["layout"]["shapes"]
    assert (slow["yref"], slow["x0"], slow["x1"]) == ("y domain", 11_000.0, 13_000.0)


def test_a_line_breaks_where_nothing_came() -> None:
    speeds = (0.2, 0.1, 0.3, 0.4, 0.5)
    values = {"linear": speeds, "limit_factor": (1.0,) * 5}
    series = Series((0.0, 0.5, 1.0, 9.0, 9.5), values)
    fleet = FleetDescription.undescribed(["AGI"])

    line, _ = orjson.loads(charts.speed_figure("AGI", series, fleet))["data"]

    assert (line["meta"]["robot"], line["connectgaps"]) == ("AGI", False)
    assert [*zip(line["x"], line["y"], strict=True)] == [
        *((0.0, 0.2), (500.0, 0.1), (1000.0, 0.3), (1000.0, None)),
        *((9000.0, 0.4), (9500.0, 0.5)),
    ]


def test_the_page_keeps_the_script_from_sheets_that_its_policy_refuses() -> None:
    page = (STATIC / "js/pages/history/charts.js").read_text()
    own = {one.decode() for one in re.findall(rb'ById\("([0-9a-f]{64})"\)', SCRIPT)}

    # One place makes those of Plotly itself, each other place its own.
    assert SCRIPT.count(b'createElement("style")') == 1 + len(own)
    assert all(f'"{one}"' in page for one in own | {"plotly.js-style-global"})


def test_the_browser_draws_with_the_version_that_checks_the_figures() -> None:
    package = importlib.resources.files("plotly") / "package_data" / "plotly.min.js"

    assert b"plotly.js (basic" in SCRIPT[:100]
    assert _version(SCRIPT) == _version(package.read_bytes())


def _version(script: bytes) -> str:
    found = re.search(rb"v(\d+\.\d+\.\d+)", script[:100])
    assert found is not None
    return found[1].decode()
