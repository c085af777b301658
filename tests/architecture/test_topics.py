"""Live topics are spelled in one table, and the table is what the documents say."""

import ast
import re
from pathlib import Path

import pytest

from iveg.models.snapshot import Snapshot
from iveg.pipeline.topics import ROBOT_STATE, TOPICS, Topic, find, is_telemetry
from tests.architecture import documents
from tests.processes import ROOT

TABLE = ROOT / "iveg/pipeline/topics.py"
SPEAKING = [
    path
    for folder in ("pipeline", "web")
    for path in (ROOT / "iveg" / folder).rglob("*.py")
    if path != TABLE
]
_INSIDE_A_CONNECTION = {"pong", "problem", "map", ROBOT_STATE.name}
"""``map`` stands in the snapshot alone; the others are no rows of the contract."""


def _spelled(path: Path) -> list[str]:
    """Texts that name a topic, and calls that spell one, beside the table."""
    return [
        ast.unparse(node)
        for node in ast.walk(ast.parse(path.read_text()))
        if _is_topic(node) or _is_call_with_text(node)
    ]


def _is_topic(node: ast.AST) -> bool:
    text = ast.unparse(node) if isinstance(node, ast.JoinedStr) else ""
    return re.match(r"f['\"](robots|detections|commands)/", text) is not None


def _is_call_with_text(node: ast.AST) -> bool:
    if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
        return False
    owner, verb = ast.unparse(node.func.value), node.func.attr
    told = verb in ("changed", "append") and owner.endswith(("_hub", "_subscriber"))
    return told and isinstance(node.args[0], ast.Constant | ast.JoinedStr)


@pytest.mark.parametrize("path", SPEAKING, ids=lambda path: path.name)
def test_no_topic_is_spelled_beside_the_table(path: Path) -> None:
    assert _spelled(path) == []


def test_every_row_is_in_the_contract_and_the_other_way_round() -> None:
    live = (documents.INTERFACES / "live.md").read_text()
    rows = set(documents.keys(documents.section(live, "Topics")))

    assert {row.name for row in TOPICS} - _INSIDE_A_CONNECTION == rows


def test_the_snapshot_has_the_member_of_every_row() -> None:
    own = {"t", "server", "user"}

    assert {row.member for row in TOPICS if row.member} == set(
        Snapshot.model_fields
    ) - own


@pytest.mark.parametrize("row", TOPICS, ids=lambda row: row.name)
def test_a_topic_is_found_by_what_it_writes(row: Topic) -> None:
    key = "AGI" if "{id}" in row.name else ""

    assert find(row.of(key)) == (row, key)
    assert is_telemetry(row.of(key)) == (row.pace != "at once")


@pytest.mark.parametrize(
    "name", ["", "robot/AGI", "robots/", "robots/AGI/x", "people/"]
)
def test_what_is_no_topic_is_not_found(name: str) -> None:
    with pytest.raises(KeyError):
        find(name)
