"""Results are kept whole, compared honestly and told without a network."""

import re
from dataclasses import asdict, replace
from html import unescape
from pathlib import Path
from typing import Any

import pytest

from iveg.domain.errors import DataFileError
from iveg.lab.experiment.compare import write_comparison
from iveg.lab.experiment.outcome import outcome_of, result_of
from iveg.lab.experiment.plan import (
    FAMILIES,
    PLANS,
    PlannedRun,
    directory_of,
    expected_s,
    read_json,
    write_json,
)
from iveg.lab.experiment.protection import Entry, Protection
from iveg.lab.experiment.recording import read_truth
from iveg.lab.experiment.report import write_report
from iveg.lab.experiment.run_store import RunStore
from iveg.lab.experiment.scoring import Tally
from iveg.lab.experiment.words import NUMBER, catalogue

CHOSEN = {"fiware": "embedded", "confidence_threshold": 0.8}


GUARDED = Protection(
    100.0,
    42.0,
    {"in_view": 8.0, "behind_plants": 4.0, "unseen": 0.0},
    {"in_view": 7.0, "behind_plants": 1.0, "unseen": 0.0},
    {"2.3": 30.0, "4": 10.0},
    [0.0, 0.4, None],
    [Entry(0.5, 2.0, "in_view"), Entry(0.9, None, "in_view")],
)
"""Eight seconds near people in view, seven of them slowed."""


def bins(of_ms: float, n: int = 100) -> dict[str, Any]:
    """So many messages that took about so long."""
    return {"edges_ms": [of_ms], "counts": [n], "total_ms": of_ms * n}


def piece(of_ms: float) -> Any:
    hops = dict.fromkeys(("uplink", "fiware", "robot_orion", "iveg"), bins(of_ms))
    return dict.fromkeys(("odometry", "detections", "lidar"), hops)


def half(farmer: Tally | None = None, slices: list[Any] | None = None) -> Any:
    """One of a run's halves; the second one has been timed, too."""
    told = {
        "completed": True,
        "failures": [],
        "pictures": 99,
        "classes": {} if farmer is None else {"farmer": asdict(farmer)},
        "slowdowns": {"decided": 4, "applied": 4, "observed": 3, "out_of_sight": 2},
        "injection": {"asked": 5, "injected": 5, "people": 1, "ahead": 1},
        "protection": asdict(GUARDED),
    }
    if slices is None:
        return told
    sent = {"sent": 1000, "lost": 10, "reordered": 3, "orion_first": 99}
    return {
        **told,
        "slices": slices,
        "messages": {"odometry": sent},
        "read": {"passed": 1600, "skipped": 421},
        "settled": False,
        "stops": [],
    }


def guarded(rule: Any) -> Any:
    """A run for protection alone."""
    step = PlannedRun("demo", 1, 0.0, 9, rule=rule)
    return outcome_of(step, half(), None, (1.0, 1.0))


def field_test(number: int, *failures: str) -> Any:
    """One that failed, or did not."""
    step = PlannedRun("nlos-field", number, 0.0, 600 + number, fails=True)
    counted = {**half(), "completed": not failures, "failures": [*failures]}
    return outcome_of(step, counted, None, (1.0, 1.0))


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
    of = (found + missed, found + ghosts)
    farmer = Tally((confidence,) * found, missed, (0.6,) * ghosts, *of)
    step = PlannedRun("together", 1, 6.0, 7)
    stack = half(farmer, [piece(one) for one in took_ms])
    outcome = outcome_of(step, half(farmer), stack, (1.24, 3.0))
    outcomes = [guarded("paper"), field_test(1), field_test(2, "link"), outcome]
    return result_of(PLANS["minimal"], outcomes, CHOSEN, why)


def test_the_report_sets_the_papers_counts_beside_what_was_counted() -> None:
    page = write_report(result())

    assert "<td>farmer</td><td>here</td><td>36</td><td>6</td><td>3</td>" in page
    assert (
        "<td>paper, field</td><td>36</td><td>6</td><td>3</td><td>85.71 %</td>" in page
    )
    assert "92.3 % [79.7, 97.3]" in page
    assert "<td>total</td><td>paper, field</td><td>98</td><td>26</td>" in page


def test_the_report_sets_the_papers_latency_beside_what_was_measured() -> None:
    page = write_report(result(took_ms=(5.0, 5.0)))

    assert "<td>lidar</td><td>here</td><td>200</td><td>5.0</td>" in page
    assert "<td>10.0%</td><td>200</td><td>5.0</td>" in page
    assert "<td>paper, field</td><td></td><td>17.4</td><td>97.2</td>" in page
    assert "odometry, paper, simulation" in page
    assert "10 of 1000" in page
    assert "421 of 1600" in page
    assert "<td>no</td><td>1.2</td><td>3.0</td>" in page
    assert "below 320 ms" in page


def test_the_report_says_how_many_detections_reached_the_papers_own_threshold() -> None:
    assert "0% (0.8)" in write_report(result(confidence=0.72))
    assert "100% (0.8)" in write_report(result(confidence=0.9))


def test_the_report_says_who_was_told_of_whom() -> None:
    page = write_report(result())

    assert "robot could not see</td><td>2</td><td>2</td>" in page
    assert "in AGII&#x27;s costmap</td><td>5</td><td>5</td>" in page


def test_the_report_says_who_was_protected_by_detector_and_rule() -> None:
    page = write_report(result())

    # The scenarios' own run; that by the paper's rule is for comparison.
    assert "for 87.5% of the time (66.7% with" in page
    assert "in 1 of 3 encounters never" in page
    near = "<td>8.0</td><td>87.5%</td><td>4.0</td><td>25.0%</td><td>0.0</td><td>–</td>"
    delays = "<td>3</td><td>1</td><td>0.20</td><td>0.38</td>"
    needless = "<td>30.0%</td><td>10.0%</td><td>42.0</td>"
    for where, rule in (
        ("scenarios", "iveg"),
        ("real time", "iveg"),
        ("demo", "paper"),
    ):
        chosen = f"<td>{where}</td><td>field</td><td>{rule}</td>"
        assert f"{chosen}{near}{delays}{needless}" in page
        told = "–" if where == "real time" else "50.0%"
        entered = f"<td>2</td><td>{told}</td><td>50.0%</td>"
        assert f"{chosen}<td>in view for 2 s</td>{entered}" in page


def test_field_tests_that_failed_are_counted_with_their_reasons() -> None:
    told = result()
    page = write_report(told)

    assert told["completion"] == {"runs": 1, "completed": 1, "planned": 1}
    assert told["field"] == {"runs": 2, "completed": 1, "failures": {"link": 1}}
    assert "with failures</td><td>1 of 2</td><td>92%</td><td>82%</td>" in page
    assert "<td>2</td><td>field</td><td>602</td><td>no</td><td>link</td>" in page
    assert "<td>1</td><td>field</td><td>601</td><td>yes</td><td>–</td>" in page


def said(page: str, language: str) -> list[str]:
    """Everything that a reader of one language reads."""
    part = page.partition(f'<main lang="{language}">')[2].partition("</main>")[0]
    shown = re.sub(r"<script.*?</script>", "", part, flags=re.S)
    return [unescape(one) for one in re.findall(r">([^<>]+)<", shown) if one.strip()]


def everything() -> str:
    """Reports in which each sentence is said at least once."""
    stopped, quiet = result(why="iveg: did not answer"), result()
    median = {"p50_ms": 20.5}
    for one in (stopped, quiet):
        stops = [{"robot_id": "AGI", "answer": {"direct": median}, "standing": median}]
        one["stack"]["stops"] = stops
    quiet["configuration"] = {"fiware": "embedded", "confidence_threshold": 0.7}
    quiet["protected"]["encounters"] = 0
    failed = field_test(3, "navigation", "touched", "missed")
    quiet["runs"] = [*quiet["runs"], failed]
    quiet["latency"]["rows"][0]["messages"] = {}
    return write_report(stopped) + write_report(quiet)


def test_the_report_is_whole_in_both_languages() -> None:
    for page in everything().split("<!doctype html>")[1:]:
        english, spanish = said(page, "en"), said(page, "es")

        assert len(english) == len(spanish) > 300
        same = {one for one in english if one in spanish and re.search("[A-Za-z]", one)}
        names = r"AGI|AGII|iveg|demo|nlos-field|together|iVeg .*|fiware .*|Linux.*"
        both = r"TP|FP|FN|AP|n|P95|Δt.|lidar|detector|robot|total|no|[\d.]+ m?s"
        assert [s for s in same if not re.fullmatch(f"{names}|{both}", s)] == []


def test_every_sentence_of_the_catalogue_is_said() -> None:
    page = everything()
    keys = {NUMBER.sub("#", one) for one in said_of_all(page, "en")}
    parts = {part for key in keys for part in key.split(", ")}
    parts |= {f"{key.partition(':')[0]}:" for key in keys}
    drawn = {"ms", "share"}

    assert [s for s in catalogue() if s not in keys | parts | drawn] == []
    assert [k for k, s in catalogue().items() if k.count("#") != s.count("#")] == []


def said_of_all(pages: str, language: str) -> list[str]:
    each = pages.split("<!doctype html>")[1:]
    return [text for page in each for text in said(page, language)]


def test_the_report_begins_with_its_conclusions_as_its_reader_writes() -> None:
    page = write_report(result())
    english, spanish = said(page, "en"), said(page, "es")

    assert english[1] == "Conclusions"
    assert english[3].startswith("1 of 1 runs were completed, and 1 of 2 field tests")
    assert english[4].startswith("iVeg decided 4 slow-downs: 4 were applied")
    assert "92.3% of the farmers in view, and 85.7% of what" in english[5]
    assert "95% of the messages of each kind took no longer than 5.9 ms" in english[6]
    assert "El artículo: 97,67 % y 93,33 % en simulación" in spanish[5]
    assert "más de 10.000 mensajes" in page
    assert "92,3 % [79,7; 97,3]" in spanish
    assert "Python 3.1" in "".join(spanish)


def test_the_report_has_the_pages_own_colours_in_each_theme() -> None:
    page = write_report(result())
    style = page.partition("<style>")[2].partition("</style>")[0]
    asked = set(re.findall(r"var\((--[\w-]+)", style.partition("/* The report")[2]))

    assert 'data-theme="auto"' in page
    assert asked > {"--field", "--text", "--line"}
    assert [name for name in asked if f"{name}:" not in style] == []


def test_the_report_needs_no_network() -> None:
    page = write_report(result())
    ours = re.sub(r"<script>/\*\*.*?</script>", "", page, flags=re.S)

    assert "Plotly.react" in page
    assert not re.findall(r"<(?:script|link|img)[^>]+(?:src|href)=", ours)
    # Two figures in each language, the library, and what draws them.
    assert page.count("</script>") == 6


def test_a_run_that_broke_off_says_so_and_keeps_what_it_has() -> None:
    page = write_report(result(why="iveg: did not answer"))

    assert "Broken off: iveg: did not answer." in page
    assert "<td>36</td>" in page


def test_a_report_without_latency_has_no_figures() -> None:
    page = write_report(result(took_ms=()))

    assert 'class="figure"' not in page
    assert len(page) < 150_000


def test_a_clear_change_is_told_and_an_unclear_one_is_not() -> None:
    before, after = result(180, 120, 6), result(290, 10, 8)

    told = write_comparison(before, after)

    assert re.search(r"farmer recall .*: better", told)
    assert re.search(r"farmer precision .*: cannot tell", told)


@pytest.mark.parametrize(
    ("took_ms", "told"),
    [
        ((50.0, 51.0, 52.0, 51.0), "worse"),
        ((1.0, 1.1, 1.0, 1.1), "better"),
        ((5.0, 6.0, 6.0, 5.0), "cannot tell"),
    ],
)
def test_a_change_of_latency_is_told_only_where_slices_leave_no_doubt(
    took_ms: tuple[float, ...], told: str
) -> None:
    lines = write_comparison(result(), result(took_ms=took_ms))

    assert re.search(rf"odometry fiware mean ms .*: {told}\n", lines)
    assert re.search(rf"lidar uplink P95 ms .*: {told}\n", lines)
    assert "Load of the machine after: 2.1 (2.1 to 2.1), " in lines


def test_few_slices_say_nothing_of_latency() -> None:
    assert " ms " not in write_comparison(result(), result(took_ms=(50.0, 50.0, 50.0)))


def test_results_come_back_as_they_were_written(tmp_path: Path) -> None:
    file = tmp_path / "result.json"
    write_json(file, result())

    assert read_json(file)["detection"]["farmer"]["tp"] == 36
    assert [one["where"] for one in read_json(file)["protection"]] == [
        "scenarios",
        "real time",
        "demo",
        "nlos-field",
    ]
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


# --- plans ----------------------------------------------------------------------------


@pytest.mark.parametrize("size", ["minimal", "quick", "full"])
def test_every_run_has_a_seed_of_its_own(size: Any) -> None:
    steps = list(PLANS[size].steps())

    timed = [one for one in steps if one.is_timed]
    own = [one for one in steps if one.is_timed or one.fails]
    assert len({one.seed for one in own}) == len(own)
    assert {one.family for one in timed} <= set(FAMILIES)
    assert len({one.name for one in steps}) == len(steps)


def test_runs_for_protection_differ_in_detector_and_rule_alone() -> None:
    steps = [*replace(PLANS["quick"], profile="simulation", runs=2).steps()]
    compared = [one for one in steps if one.family == "demo"]

    assert [one.name for one in compared] == [
        "demo-simulation-iveg-1",
        "demo-simulation-paper-1",
        "demo-simulation-iveg-2",
        "demo-simulation-paper-2",
    ]
    seeds = [one.seed for one in compared]
    assert seeds[0] == seeds[1] != seeds[2] == seeds[3]
    assert not set(seeds) & {one.seed for one in steps if one.family != "demo"}
    full = [one for one in PLANS["full"].steps() if one.family == "demo"]
    assert {(one.profile, one.rule) for one in full} == {
        (profile, rule)
        for profile in ("field", "simulation")
        for rule in ("iveg", "paper")
    }


def test_quick_stays_under_three_minutes_and_full_has_enough_messages() -> None:
    quick, full = ([*PLANS[size].steps()] for size in ("quick", "full"))

    assert sum(expected_s(one) for one in quick) < 180.0
    assert sum(180.0 * one.seconds for one in quick) > 5_000
    assert sum(180.0 * one.seconds for one in full) > 100_000


# --- what broke off goes on -----------------------------------------------------------


def finished(step: PlannedRun) -> Any:
    farmer = Tally((0.9,), 0, (), 1, 1)
    stack = half(farmer, []) if step.is_timed else None
    return outcome_of(step, half(farmer), stack, (0.0, 0.0))


def test_an_experiment_that_broke_off_keeps_what_it_has_and_goes_on(
    tmp_path: Path,
) -> None:
    first = RunStore(PLANS["quick"], tmp_path)
    steps = first.steps_left()
    for step in steps[:5]:
        first.keep(step, finished(step))
    first.finish(CHOSEN, "iveg: did not answer")

    second = RunStore(PLANS["quick"], tmp_path)

    partial = read_json(tmp_path / "partial.json")
    assert partial["completion"] == {"runs": 2, "completed": 2, "planned": 5}
    assert partial["detection"]["farmer"]["tp"] == 2
    assert second.done == 5
    assert second.steps_left() == steps[5:]


def test_a_run_that_a_crash_left_half_written_is_run_again(tmp_path: Path) -> None:
    notebook = RunStore(PLANS["quick"], tmp_path)
    steps = notebook.steps_left()
    notebook.keep(steps[0], finished(steps[0]))
    (tmp_path / f"{steps[0].name}.json").write_text('{"family": "view')

    assert notebook.steps_left() == steps


def test_an_experiment_that_is_whole_leaves_nothing_of_its_breaks(
    tmp_path: Path,
) -> None:
    notebook = RunStore(PLANS["minimal"], tmp_path)
    notebook.finish(CHOSEN, "interrupted")
    for step in notebook.steps_left():
        notebook.keep(step, finished(step))

    report = notebook.finish(CHOSEN, "")

    assert report == tmp_path / "result.html"
    assert not list(tmp_path.glob("partial.*"))
    assert read_json(tmp_path / "result.json")["ended_early"] == ""
    assert notebook.is_last(step)


def test_the_same_command_takes_up_what_broke_off_and_else_begins_anew(
    tmp_path: Path,
) -> None:
    plan = PLANS["quick"]
    first = directory_of(tmp_path, plan)
    RunStore(plan, first).finish(CHOSEN, "interrupted")
    again = directory_of(tmp_path, plan)
    RunStore(plan, again).finish(CHOSEN, "")

    assert first == again == tmp_path / "quick-001"
    assert directory_of(tmp_path, plan) == tmp_path / "quick-002"


def test_runs_of_two_plans_are_never_one_experiment(tmp_path: Path) -> None:
    plan, other = PLANS["quick"], replace(PLANS["quick"], seed=7)
    first = directory_of(tmp_path, plan)
    RunStore(plan, first).finish(CHOSEN, "interrupted")

    assert directory_of(tmp_path, other) == tmp_path / "quick-002"
    with pytest.raises(DataFileError, match="another plan"):
        RunStore(other, first)
