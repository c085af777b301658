"""The file of rule versions over restarts, changed settings and broken lines."""

from dataclasses import replace
from pathlib import Path

import pytest

from iveg.adapters.rules import FileRules
from iveg.domain.comparison import Comparison, Doings
from iveg.domain.detection_rule import RECOVERED, DetectionRule
from iveg.domain.errors import DataFileError, HopError
from iveg.domain.parameters import ByClass
from tests.builders import START

FIRST = DetectionRule()
CHANGED = DetectionRule(
    version=2,
    threshold=ByClass(0.7, {"robot": 0.9}),
    radius_m=ByClass(2.0, {"robot": 3.0}),
    foresight_s=2.0,
    comparison=Comparison(
        1.0, 2.0, 1, 0.5, Doings(), Doings({"person": 0.4}, {"person": 1}), 1, 0
    ),
    aliases={"person": "person", "robot": "robot", "abuela": "person"},
    author="ana",
    since=START.wall,
)


async def test_changed_settings_are_a_newer_version(tmp_path: Path) -> None:
    rules = FileRules(tmp_path / "rules.jsonl")
    rules.load(FIRST, START)
    await rules.append(CHANGED)
    strict = replace(FIRST, threshold=ByClass(0.6))

    again = FileRules(tmp_path / "rules.jsonl").load(strict, START)

    newest = again[-1]
    assert (newest.version, newest.author) == (3, "settings")
    assert (newest.threshold, newest.radius_m) == (ByClass(0.6), CHANGED.radius_m)
    assert newest.aliases == CHANGED.aliases
    assert newest.comparison is None, "it came of no trial"
    assert list(FileRules(tmp_path / "rules.jsonl").load(strict, START)) == list(again)


async def test_looks_add_up_in_versions_of_before_that_was_so(tmp_path: Path) -> None:
    rules = FileRules(tmp_path / "rules.jsonl")
    rules.load(FIRST, START)
    await rules.append(replace(CHANGED, possible_people=False))

    again = FileRules(tmp_path / "rules.jsonl").load(FIRST, START)

    assert list(again) == [FIRST, CHANGED]


def put_aside(directory: Path) -> list[str]:
    """What the damaged files held."""
    return [one.read_text() for one in directory.glob("rules.jsonl.damaged-*")]


@pytest.mark.parametrize(
    "line",
    [
        "[1]",
        '{"unheard": 1}',
        '{"threshold": 2}',
        '{"class_radii_m": {"robot": 7}}',
        '{"version": 2, "thresho',
    ],
)
async def test_a_damaged_file_is_put_aside_and_its_strictest_rule_counts(
    tmp_path: Path, line: str, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "rules.jsonl"
    rules = FileRules(path)
    rules.load(FIRST, START)
    await rules.append(CHANGED)
    await rules.append(replace(FIRST, version=3, author="ben"))
    damaged = path.read_text() + line + "\n"
    path.write_text(damaged)

    found = FileRules(path).load(FIRST, START)

    assert [rule.author for rule in found] == ["settings", "ana", "ben", RECOVERED]
    assert (found[-1].threshold, found[-1].radius_m) == (ByClass(0.7), ByClass(3.0))
    assert put_aside(tmp_path) == [damaged]
    assert len(caplog.messages) == 1
    assert "rules.jsonl: line 5: " in caplog.messages[0]
    assert list(FileRules(path).load(FIRST, START)) == list(found)


def test_a_file_of_which_nothing_can_be_read_leaves_the_settings(
    tmp_path: Path,
) -> None:
    path = tmp_path / "rules.jsonl"
    path.write_text("nonsense\n")

    found = FileRules(path).load(FIRST, START)

    assert (found[-1].author, found[-1].version) == (RECOVERED, 2)
    assert (found[-1].threshold, found[-1].radius_m) == (ByClass(0.8), ByClass(2.0))


def test_a_file_of_a_newer_iveg_is_refused_and_stays(tmp_path: Path) -> None:
    path = tmp_path / "rules.jsonl"
    path.write_text('{"iveg": "rules", "version": 2}\n')

    with pytest.raises(DataFileError, match=r"rules\.jsonl, line 1"):
        FileRules(path).load(FIRST, START)
    assert path.exists()


async def test_a_disk_that_fails_is_told_and_keeps_the_old_versions(
    tmp_path: Path,
) -> None:
    directory = tmp_path / "gone"
    rules = FileRules(directory / "rules.jsonl")
    rules.load(FIRST, START)

    with pytest.raises(HopError):
        await rules.append(CHANGED)
    directory.mkdir()
    await rules.append(replace(CHANGED, threshold=ByClass(0.75)))

    again = FileRules(directory / "rules.jsonl").load(FIRST, START)
    assert [rule.threshold.every for rule in again] == [0.8, 0.75]
