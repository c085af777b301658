"""Two experiments beside each other: what is told, and what cannot be."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from iveg.domain.errors import DataFileError
from iveg.lab.experiment.compare import read_result, write_comparison
from iveg.lab.experiment.outcome import outcome_of, result_of
from iveg.lab.experiment.plan import FORMAT, PLANS, PlannedRun, write_json
from iveg.lab.experiment.resampling import change

CALM = (2.0, 2.4)


def half(found: Sequence[float], ghosts: Sequence[float], **counts: int) -> Any:
    """Detections of people, and slow-downs, injection and protection by counts."""
    told = {"asked": 10, "injected": 8, "decided": 5, "applied": 5, **counts}
    slowed, never = told.get("slowed", 9), told.get("never", 0)
    person = {"found": found, "ghosts": ghosts, "missed": 2, "looks": 9, "claims": 9}
    return {
        "completed": True,
        "failures": [],
        "pictures": 99,
        "classes": {"farmer": person},
        "slowdowns": told,
        "injection": told,
        "protection": {
            "driven_s": 100.0,
            "driven_m": 50.0,
            "near_s": {"in_view": 10.0, "behind_plants": 0.0, "unseen": 0.0},
            "slowed_s": {"in_view": slowed, "behind_plants": 0.0, "unseen": 0.0},
            "needless_s": {"2.3": 20.0, "4": told.get("needless", 10)},
            "delays_s": [0.1] * (4 - never) + [None] * never,
            "entries": [],
        },
    }


def bins(of_ms: float) -> Any:
    return {"edges_ms": [of_ms], "counts": [100], "total_ms": 100 * of_ms}


def result(
    halves: Sequence[Any],
    load: tuple[float, float] = CALM,
    took_ms: Sequence[float] = (5.0, 5.5, 5.0, 5.5, 5.0),
) -> Any:
    """An experiment of five runs; each half is both of its run's."""
    outcomes = []
    for number, (of, ms) in enumerate(zip(halves, took_ms, strict=True)):
        step = PlannedRun("nlos", number, 6.0, number)
        hops = dict.fromkeys(("uplink", "fiware", "robot_orion", "iveg"), bins(ms))
        timed = {"slices": [{"odometry": hops}], "messages": {}, "read": {}}
        stack = {**of, **timed, "stops": [], "settled": True}
        outcomes.append(outcome_of(step, of, stack, load))
    return result_of(PLANS["quick"], outcomes, {})


SURE, UNSURE = half([0.9] * 20, [0.5] * 5), half([0.5] * 20, [0.9] * 5)


def test_what_every_run_changed_is_told_and_what_one_changed_is_not() -> None:
    better = half([0.9] * 20, [0.5] * 5, injected=10, slowed=10, never=0, decided=7)
    worse = half([0.5] * 20, [0.9] * 5, slowed=6, never=2, needless=15)
    before = result([worse] * 5)

    all_of_them = write_comparison(before, result([better] * 5))
    one_of_them = write_comparison(before, result([better] + [worse] * 4))

    for what, told in (
        ("farmer AP", "better"),
        ("slow-downs a run", "more"),
        ("injected", "better"),
        ("injected, real time", "better"),
        ("slowed near people in view", "better"),
        ("encounters never slowed", "better"),
        ("needless > 4 m", "better"),
    ):
        assert re.search(rf"^{what} +\d.*: {told}$", all_of_them, re.M), what
        assert re.search(rf"^{what} +\d.*: cannot tell$", one_of_them, re.M), what
    assert "AGI AP" not in all_of_them


def test_another_load_excuses_times_and_real_time_but_not_the_virtual_clock() -> None:
    slow = (50.0, 51.0, 50.0, 51.0, 50.0)
    told = write_comparison(
        result([SURE] * 5), result([UNSURE] * 5, (9.0, 10.0), took_ms=slow)
    )

    excused = "cannot tell: the machine had another load"
    assert re.search(rf"^odometry uplink mean ms .*: {excused}$", told, re.M)
    assert re.search(rf"^farmer AP, real time .*: {excused}$", told, re.M)
    assert re.search(r"^farmer AP  .*: worse$", told, re.M)
    assert "before: 2.2 (2.2 to 2.2), " in told
    assert "after: 9.5 (9.5 to 9.5), " in told


def test_times_are_told_by_runs_so_that_one_slow_run_proves_nothing() -> None:
    before = result([SURE] * 5)
    for took_ms, verdict in (
        ((50.0, 51.0, 50.0, 51.0, 50.0), "worse"),
        ((5.0, 5.5, 5.0, 5.5, 500.0), "cannot tell"),
    ):
        told = write_comparison(before, result([SURE] * 5, took_ms=took_ms))
        assert re.search(rf"^odometry fiware mean ms .*: {verdict}$", told, re.M)


def test_runs_of_the_same_seeds_are_drawn_in_pairs() -> None:
    """Runs differ much and each of them gets a little better."""
    before = [half([], [], injected=n) for n in (1, 3, 5, 7, 9)]
    after = [half([], [], injected=n) for n in (2, 4, 6, 8, 10)]

    def injected(runs: Sequence[Any]) -> float:
        return float(sum(run["injection"]["injected"] for run in runs) / len(runs))

    paired = change(before, after, injected, paired=True)
    apart = change(before, after, injected, paired=False)

    assert paired is not None
    assert apart is not None
    assert paired[:2] == apart[:2] == (5.0, 6.0)
    assert (paired[2].low, paired[2].high) == pytest.approx((1.0, 1.0))
    assert apart[2].low < 0.0 < 1.0 < apart[2].high
    assert change(before[:4], after[:4], injected, paired=True) is None


def test_a_folder_has_its_result_or_what_a_break_left(tmp_path: Path) -> None:
    write_json(tmp_path / "partial.json", {"format": FORMAT, "name": "partial"})
    assert read_result(tmp_path)["name"] == "partial"

    write_json(tmp_path / "result.json", {"format": FORMAT, "name": "whole"})
    assert read_result(tmp_path)["name"] == "whole"
    assert read_result(tmp_path / "partial.json")["name"] == "partial"


def test_what_is_not_there_or_of_another_version_is_named(tmp_path: Path) -> None:
    with pytest.raises(DataFileError, match=r"result\.json"):
        read_result(tmp_path)

    write_json(tmp_path / "result.json", {"format": FORMAT - 1})
    with pytest.raises(DataFileError, match="run it again"):
        read_result(tmp_path)
