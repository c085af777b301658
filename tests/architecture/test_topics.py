"""The table of live topics is what the documents and the snapshot have."""

import pytest

from iveg.models.snapshot import Snapshot
from iveg.vital.topics import ROBOT_STATE, TOPICS, Topic, find, is_telemetry
from tests.architecture import documents

_INSIDE_A_CONNECTION = {"pong", "problem", "map", ROBOT_STATE.name}
"""``map`` stands in the snapshot alone; the others are no rows of the contract."""


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

    assert find(row.for_id(key)) == (row, key)
    assert is_telemetry(row.for_id(key)) == (row.pace != "at once")


@pytest.mark.parametrize(
    "name", ["", "robot/AGI", "robots/", "robots/AGI/x", "people/"]
)
def test_what_is_no_topic_is_not_found(name: str) -> None:
    with pytest.raises(KeyError):
        find(name)
