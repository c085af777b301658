"""Results are kept whole, compared honestly and told without a network."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from iveg.domain.errors import DataFileError
from iveg.experiment.compare import write_comparison
from iveg.experiment.notebook import Notebook, directory_of
from iveg.experiment.observer import injections, picture_of, slowdowns_of
from iveg.experiment.outcome import (
    outcome_of,
    read_json,
    read_truth,
    result_of,
    write_json,
)
from iveg.experiment.plan import FAMILIES, PLANS, Step
from iveg.experiment.report import write_report
from iveg.experiment.scoring import Tally

HOP = {"count": 100, "mean_ms": 5.0, "p95_ms": 9.0}
AXES = {"meta": {"x": "a", "y": "b"}}
FIGURE = {"data": [{"type": "bar", "x": ["</script>"], "y": [1]}], "layout": AXES}
HOPS = dict.fromkeys(("uplink", "fiware", "robot_orion"), HOP)
ROWS = [{"data": one, "hops": HOPS} for one in ("odometry", "detections", "lidar")]
MEASURED = {"latency": {"rows": ROWS, "figures": {"bars": FIGURE}, "clocks": []}}


def result(found: int = 36, missed: int = 3, ghosts: int = 6, why: str = "") -> Any:
    """An experiment of one run."""
    outcome = outcome_of(
        Step("together", 1, 6.0, 7),
        {"farmer": Tally((0.9,) * found, missed, (0.6,) * ghosts)},
        pictures=99,
        completed=True,
        slowdowns={"decided": 4, "applied": 4, "observed": 3, "out_of_sight": 2},
        injection={"asked": 5, "injected": 5},
        stops=[],
    )
    return result_of(PLANS["minimal"], [outcome], MEASURED, why)


def test_the_report_sets_the_papers_counts_beside_what_was_counted() -> None:
    page = write_report(result())

    assert "<td>farmer</td><td>here</td><td>36</td><td>6</td><td>3</td>" in page
    assert (
        "<td>paper, field</td><td>36</td><td>6</td><td>3</td><td>85.71 %</td>" in page
    )
    assert "92.3 % [79.7, 97.3]" in page
    assert "2 were for somebody whom the robot could not see" in page
    assert "the person stood in AGII's costmap in 5" in page


def test_the_report_needs_no_network() -> None:
    page = write_report(result())
    ours = re.sub(r"<script>/\*\*.*?</script>", "", page, flags=re.S)

    assert "Plotly.newPlot" in page
    assert not re.findall(r"<(?:script|link|img)[^>]+(?:src|href)=", ours)
    assert page.count("</script>") == 2


def test_a_run_that_broke_off_says_so_and_keeps_what_it_has() -> None:
    page = write_report(result(why="iveg: did not answer"))

    assert "Broken off: iveg: did not answer." in page
    assert "<td>36</td>" in page


def test_a_report_without_latency_has_no_figures() -> None:
    told = {**result(), "latency": {}}

    assert "Plotly" not in write_report(told)


def test_a_clear_change_is_told_and_an_unclear_one_is_not() -> None:
    before, after = result(180, 120, 6), result(290, 10, 8)

    told = write_comparison(before, after)

    assert re.search(r"farmer recall .*: better", told)
    assert re.search(r"farmer precision .*: cannot tell", told)
    assert "odometry fiware ms" in told


def test_results_come_back_as_they_were_written(tmp_path: Path) -> None:
    file = tmp_path / "result.json"
    write_json(file, result())

    assert read_json(file)["detection"]["farmer"]["tp"] == 36
    assert [one.name for one in tmp_path.iterdir()] == ["result.json"]


def test_a_result_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(DataFileError, match=r"nothing\.json"):
        read_json(tmp_path / "nothing.json")


def test_a_truth_that_broke_off_in_a_line_keeps_the_others(tmp_path: Path) -> None:
    file = tmp_path / "truth.jsonl"
    line = (
        '{"robot":"AGI","at":1.5,"visible":[{"key":"k","class":"farmer","x":1,"y":2}]}'
    )
    file.write_text(f'{line}\n{line}\n{{"robot":"AG')

    assert len(read_truth(file)) == 2


@pytest.mark.parametrize("size", ["minimal", "quick", "full"])
def test_every_run_has_a_seed_of_its_own(size: Any) -> None:
    steps = list(PLANS[size].steps())

    assert len({one.seed for one in steps}) == len(steps)
    assert {one.family for one in steps} <= set(FAMILIES)
    assert list(replace(PLANS[size]).steps()) == steps


def test_quick_stays_under_three_minutes_and_full_has_enough_messages() -> None:
    quick, full = (list(PLANS[size].steps()) for size in ("quick", "full"))

    assert sum(one.seconds + 6.0 for one in quick) < 180.0
    assert sum(180.0 * one.seconds for one in quick) > 5_000
    assert sum(180.0 * one.seconds for one in full) > 100_000


def look(robot_id: str, *items: dict[str, Any]) -> Any:
    told = {"robot_id": robot_id, "stamp": "2026-01-01T00:00:00.000Z", "items": items}
    picture = picture_of(told)
    assert picture is not None
    return picture


FARMER = {"class_id": "farmer", "position": {"x": 1.0, "y": 1.0}, "probability": 0.9}


def belief(*, taken: bool) -> dict[str, Any]:
    cells = [0] * 400
    cells[10 * 20 + 10] = 100 if taken else 0
    grid = {"resolution": 0.1, "width": 20, "height": 20}
    return {**grid, "origin": {"x": 0.0, "y": 0.0}, "data": cells}


@pytest.mark.parametrize(("taken", "injected"), [(True, 1), (False, 0)])
def test_somebody_out_of_sight_counts_as_injected_when_the_costmap_has_them(
    *, taken: bool, injected: int
) -> None:
    seen, blind = look("AGI", FARMER), look("AGII")

    found = injections([seen, blind], [(seen.at, belief(taken=taken))], "AGII")

    assert found == {"asked": 1, "injected": injected}


def test_whom_a_robot_sees_itself_was_not_injected() -> None:
    both = [look("AGI", FARMER), look("AGII", FARMER)]

    found = injections(both, [(both[0].at, belief(taken=True))], "AGII")

    assert found == {"asked": 0, "injected": 0}


def test_slow_downs_are_counted_by_how_far_they_came() -> None:
    times = {"applied_at": "t", "observed_at": None}
    person = {**times, "reason": "person", "in_sight": False}
    stale = {**times, "reason": "stale", "in_sight": None}

    found = slowdowns_of([person, stale])

    assert found == {"decided": 1, "applied": 1, "observed": 0, "out_of_sight": 1}


# --- what broke off goes on -----------------------------------------------------------


def finished(step: Step) -> Any:
    return outcome_of(
        step,
        {"farmer": Tally((0.9,), 0, ())},
        pictures=9,
        completed=True,
        slowdowns={},
        injection={},
        stops=[],
    )


def test_an_experiment_that_broke_off_keeps_what_it_has_and_goes_on(
    tmp_path: Path,
) -> None:
    first = Notebook(PLANS["quick"], tmp_path)
    steps = first.steps_left()
    for step in steps[:2]:
        first.keep(step, finished(step))
    first.finish({}, "iveg: did not answer")

    second = Notebook(PLANS["quick"], tmp_path)

    partial = read_json(tmp_path / "partial.json")
    assert partial["completion"] == {"runs": 2, "completed": 2, "planned": 5}
    assert partial["detection"]["farmer"]["tp"] == 2
    assert second.steps_left() == steps[2:]


def test_an_experiment_that_is_whole_leaves_nothing_of_its_breaks(
    tmp_path: Path,
) -> None:
    notebook = Notebook(PLANS["minimal"], tmp_path)
    notebook.finish({}, "interrupted")
    [step] = notebook.steps_left()
    notebook.keep(step, finished(step))

    report = notebook.finish(MEASURED, "")

    assert report == tmp_path / "result.html"
    assert not list(tmp_path.glob("partial.*"))
    assert read_json(tmp_path / "result.json")["ended_early"] == ""
    assert notebook.is_last(step)


def test_the_same_command_takes_up_what_broke_off_and_else_begins_anew(
    tmp_path: Path,
) -> None:
    plan = PLANS["quick"]
    first = directory_of(tmp_path, plan)
    Notebook(plan, first).finish({}, "interrupted")
    again = directory_of(tmp_path, plan)
    Notebook(plan, again).finish({}, "")

    assert first == again == tmp_path / "quick-001"
    assert directory_of(tmp_path, plan) == tmp_path / "quick-002"
