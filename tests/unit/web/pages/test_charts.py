"""Rows become figures: strips, shades and gaps."""

from dataclasses import replace

import orjson

from iveg.adapters.history.series import SpeedSeries
from iveg.domain.fleet import FleetDescription
from iveg.web.pages import charts


def test_13_19_each_robot_has_a_strip_whose_slow_downs_are_shaded() -> None:
    slowed = SpeedSeries(
        "AGI",
        at=(10.0, 11.0, 12.0, 13.0),
        linear=(0.8, 0.4, 0.4, 0.8),
        limit=(1.0, 0.5, 0.5, 1.0),
        applied=(1.0, 0.5, 0.5, 1.0),
        margin=(None,) * 4,
        slice_s=0.0,
    )
    free = replace(slowed, robot_id="AGII", limit=(1.0,) * 4)
    fleet = FleetDescription.undescribed(["AGI", "AGII"])

    figure = orjson.loads(charts.speed_figure([slowed, free], fleet))

    axes = [trace["yaxis"] for trace in figure["data"]]
    assert axes == ["y", "y", "y2", "y2"]
    layout = figure["layout"]
    assert layout["yaxis2"]["domain"][1] < layout["yaxis"]["domain"][0]
    (slow,) = layout["shapes"]
    assert (slow["yref"], slow["x0"], slow["x1"]) == ("y domain", 11_000.0, 13_000.0)


def test_28_6_a_margin_is_drawn_as_long_as_it_was_measured_and_no_longer() -> None:
    at = (0.0, 0.5, 1.0, 1.5, 9.0, 9.5)
    margin = (2.0, 1.5, None, -0.5, 3.0, None)
    same = (1.0,) * len(at)
    measured = SpeedSeries("AGI", at, same, same, same, margin)
    unknown = replace(measured, robot_id="AGII", margin=(None,) * len(at))

    (line,) = orjson.loads(charts.margin_figure([measured, unknown]))["data"]

    assert (line["meta"]["robot"], line["connectgaps"]) == ("AGI", False)
    assert [*zip(line["x"], line["y"], strict=True)] == [
        *((0.0, 2.0), (500.0, 1.5), (1000.0, 1.5), (1000.0, None)),
        *((1500.0, -0.5), (2000.0, -0.5), (2000.0, None)),
        *((9000.0, 3.0), (9500.0, 3.0), (9500.0, None)),
    ]
