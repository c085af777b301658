"""Results are kept whole and told without a network."""

import re
from collections import defaultdict
from collections.abc import Sequence
from html import unescape
from pathlib import Path
from typing import Any

import pytest

from iveg.domain.errors import DataFileError
from iveg.domain.latency import DATA
from iveg.lab.experiment.messages import HOPS
from iveg.lab.experiment.outcome import outcome_of, result_of
from iveg.lab.experiment.plan import (
    PLANS,
    PlannedRun,
    claim,
    directory_of,
    write_json,
)
from iveg.lab.experiment.protection import Protection
from iveg.lab.experiment.report import write_report
from iveg.lab.experiment.scoring import Tally

CHOSEN = {"confidence_threshold": 0.8}


GUARDED = Protection(
    100.0,
    10.0,
    defaultdict(float, {"in_view": 8.0, "unseen": 4.0}),
    defaultdict(float, {"in_view": 7.0, "unseen": 1.0}),
    [0.0, 0.4, None],
    [2.0, None],
)
"""Eight seconds near people in view, seven of them slowed."""


def counted(farmer: Tally | None = None) -> Any:
    """A run's half on the virtual clock."""
    return {
        "pictures": 99,
        "classes": {} if farmer is None else {"farmer": farmer},
        "protection": GUARDED,
    }


def timed(took_ms: Sequence[float]) -> Any:
    """A run's half in real time."""
    sent = {"sent": 1000, "lost": 10, "orion_first": 99}
    return {
        "completed": True,
        "hops_ms": dict.fromkeys(DATA, dict.fromkeys(HOPS, took_ms)),
        "messages": {data: {} for data in DATA} | {"odometry": sent},
    }


def guarded(rule: Any) -> Any:
    """A run for protection alone."""
    step = PlannedRun("demo", 1, 0.0, 9, rule=rule)
    return outcome_of(step, counted(), None)


def result(
    found: int = 36,
    missed: int = 3,
    ghosts: int = 6,
    *,
    why: str = "",
    took_ms: tuple[float, ...] = (5.0, 6.0, 5.0, 6.0),
    confidence: float = 0.9,
) -> Any:
    """An experiment of one run."""
    farmer = Tally([confidence] * found, missed, [0.6] * ghosts)
    step = PlannedRun("together", 1, 6.0, 7)
    outcome = outcome_of(step, counted(farmer), timed(took_ms))
    return result_of(PLANS["minimal"], [guarded("paper"), outcome], CHOSEN, why)


def test_the_report_sets_the_papers_counts_beside_what_was_counted() -> None:
    page = write_report(result())

    assert "<td>farmer</td><td>here</td><td>36</td><td>6</td><td>3</td>" in page
    assert (
        "<td>paper, field</td><td>36</td><td>6</td><td>3</td><td>85.71 %</td>" in page
    )
    assert "<td>85.7%</td><td>92.3%</td>" in page
    assert "<td>total</td><td>paper, field</td><td>98</td><td>26</td>" in page


def test_the_report_says_who_was_protected_by_detector_and_rule() -> None:
    page = write_report(result())

    # The scenarios' own run; that by the paper's rule is for comparison.
    assert "for 87.5% of the time (66.7% with" in page
    assert "in 1 of 3 encounters never" in page
    near = "<td>8.0</td><td>87.5%</td><td>4.0</td><td>25.0%</td>"
    encounters = "<td>3</td><td>1</td><td>0.38</td><td>10.0%</td>"
    entries = "<td>2</td><td>50.0%</td>"
    for where, rule in (
        ("scenarios", "iveg"),
        ("demo", "paper"),
    ):
        chosen = f"<td>{where}</td><td>field</td><td>{rule}</td>"
        assert f"{chosen}{near}{encounters}{entries}" in page


def test_the_report_begins_with_its_conclusions() -> None:
    page = write_report(result())
    said = [unescape(one) for one in re.findall(r">([^<>]+)</(?:h2|li)>", page)]

    assert said[0] == "Conclusions"
    assert "for 87.5% of the time" in said[1]
    assert said[2].startswith("1 of 1 runs were completed through all programs;")
    assert "95% of the messages of each kind took no longer than 6.0 ms" in said[3]


# --- plans ----------------------------------------------------------------------------


def test_no_experiment_overwrites_another(tmp_path: Path) -> None:
    first = directory_of(tmp_path, "quick")
    claim(first)
    write_json(first / "result.json", result())

    assert first == tmp_path / "quick-001"
    assert directory_of(tmp_path, "quick") == tmp_path / "quick-002"
    with pytest.raises(DataFileError, match="not empty"):
        claim(first)
