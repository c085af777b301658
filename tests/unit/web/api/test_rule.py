"""Reading and changing the rule: versions, authors, and who may."""

import asyncio
from typing import Any

import httpx
import pytest

from iveg.domain.records import DecisionRecord
from tests.builders import detection
from tests.unit.web.desk import WebDesk


async def put(desk: WebDesk, **parameters: object) -> httpx.Response:
    seen = {"version": desk.rules.current.version}
    async with desk.browser() as browser:
        return await browser.put("/api/v1/rule", json=seen | parameters)


async def get(desk: WebDesk, path: str = "") -> Any:
    async with desk.browser("viewer") as browser:
        answer = await browser.get(f"/api/v1/rule{path}")
    assert answer.status_code == 200
    return answer.json()


async def test_a_change_is_a_new_version_with_author_and_time_kept_and_logged() -> None:
    desk = WebDesk()
    rings = desk.hub.versions["people"]

    answer = await put(desk, confidence_threshold=0.6)

    assert answer.status_code == 200
    told = await get(desk)
    assert answer.json() == told
    assert (told["version"], told["author"]) == (2, "ana")
    assert told["since"] == "2023-11-14T22:13:20.000Z"
    assert (told["confidence_threshold"], told["radius_m"]) == (0.6, 2.0)
    assert [one.threshold.every for one in desk.rule_store.written] == [0.6]
    assert desk.sentences()[-1] == "log.rule_changed"
    listed = await get(desk, "/versions")
    assert [one["version"] for one in listed["items"]] == [2, 1]
    # Pages draw the rings anew.
    assert desk.hub.versions["people"] > rings


async def test_a_change_counts_at_once_and_every_later_decision_carries_it() -> None:
    desk = WebDesk()
    desk.drive("AGI")
    desk.look("AGII", detection("farmer", 1.5, probability=0.7))
    assert list(desk.evaluator.entries) == []

    await put(desk, confidence_threshold=0.7)
    desk.look("AGII", detection("farmer", 1.5, probability=0.7))

    record = desk.records(DecisionRecord)[-1]
    assert record.rule_version == "2"
    assert record.rule_parameters["threshold"] == 0.7


async def test_an_alias_is_learnt() -> None:
    desk = WebDesk()

    await put(desk, aliases={" Abuela ": "person"})
    desk.look("AGII", detection("abuela", 9.0))

    assert len(desk.evaluator.people.known) == 1
    told = await get(desk)
    assert told["aliases"] == {"abuela": "person", "person": "person", "robot": "robot"}


async def test_of_two_changes_of_one_version_one_counts_and_the_other_is_refused() -> (
    None
):
    desk = WebDesk()

    answers = await asyncio.gather(
        put(desk, version=1, radius_m=3.0), put(desk, version=1, radius_m=4.0)
    )

    assert sorted(answer.status_code for answer in answers) == [200, 409]
    assert [one.version for one in desk.rules.versions] == [1, 2]


@pytest.mark.parametrize(
    ("parameters", "status"),
    [
        ({"version": None}, 428),
        ({"confidence_threshold": 1.01}, 422),
        ({"class_thresholds": {"crate": 0.5}}, 422),
        ({"radius_m": 6.1}, 422),
        ({"aliases": {"person": "robot"}}, 422),
        ({"aliases": {str(n): "person" for n in range(201)}}, 422),
        ({"factor": 0.9}, 422),
    ],
)
async def test_what_names_no_version_or_makes_no_sense_is_refused(
    parameters: dict[str, object], status: int
) -> None:
    desk = WebDesk()

    answer = await put(desk, **parameters)

    assert answer.status_code == status
    assert (await get(desk))["version"] == 1


async def test_what_cannot_be_written_down_does_not_count() -> None:
    desk = WebDesk()
    desk.rule_store.full = True

    answer = await put(desk, radius_m=3.0)

    assert answer.status_code == 503
    assert (await get(desk))["version"] == 1
