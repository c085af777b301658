"""Asking about another rule over HTTP: what is refused, and what an answer has."""

from collections.abc import AsyncIterator
from types import SimpleNamespace
from typing import Any

import httpx
import pytest
from fastapi import FastAPI

from iveg.app.what_if import WhatIfs
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.fleet import FleetDescription
from iveg.domain.what_if.outcome import Outcome
from iveg.domain.what_if.questions import Answer
from iveg.web import problems
from iveg.web.api import what_if
from iveg.web.security.authentication import Authenticator
from tests.builders import START
from tests.fakes.clock import FakeClock
from tests.fakes.ids import FakeIds
from tests.fakes.worker import FakeWorker

PATH = "/api/v1/what-if"
HOUR = {"since": "2023-11-14T20:00:00Z", "until": "2023-11-14T21:00:00Z"}
RULE = DetectionRule(class_thresholds={"person": 0.75}, foresight_s=2.0)


@pytest.fixture
def asked() -> WhatIfs:
    return WhatIfs("sqlite://", FleetDescription(), FakeIds(), FakeClock())


@pytest.fixture
async def browser(asked: WhatIfs) -> AsyncIterator[httpx.AsyncClient]:
    app, clock = FastAPI(), FakeClock()
    app.state.authenticator = Authenticator(
        sign_in_token="cd" * 32, api_token="", clock=clock
    )
    problems.install(app)
    rules: Any = SimpleNamespace(current=RULE)
    app.include_router(what_if.router(asked, rules, clock, FakeWorker()))
    sessions = app.state.authenticator.sessions
    headers = {
        "Cookie": f"iveg={sessions.open('ana', 'viewer')}",
        "X-IVEG": "1",
        "Sec-Fetch-Site": "same-origin",
    }
    transport = httpx.ASGITransport(app=app)
    async with httpx.AsyncClient(
        transport=transport, base_url="http://iveg", headers=headers
    ) as client:
        yield client


async def test_what_is_left_out_is_as_in_the_rule_in_force(
    browser: httpx.AsyncClient,
) -> None:
    told = await browser.post(PATH, json={**HOUR, "radius_m": 3})

    assert told.status_code == 202
    body = told.json()
    assert body["in_force"] == {
        "confidence_threshold": 0.75,
        "radius_m": 2.0,
        "release_beyond_m": 0.3,
        "release_after_s": 1.0,
        "factor": 0.5,
        "foresight_s": 2.0,
    }
    assert body["candidate"] == {**body["in_force"], "radius_m": 3.0}
    assert (body["state"], body["by"], body["answer"]) == ("waiting", "ana", None)


@pytest.mark.parametrize(
    "body",
    [
        {},
        {"since": HOUR["until"], "until": HOUR["since"]},
        {"since": HOUR["since"], "until": HOUR["since"]},
        {"since": "1923-11-14T20:00:00Z", "until": HOUR["until"]},
        {"since": "2023-10-14T20:00:00Z", "until": HOUR["until"]},
        {"since": HOUR["since"], "until": "2023-11-15T21:00:00Z"},
        {**HOUR, "since": "yesterday"},
        {**HOUR, "treshold": 0.5},
        {**HOUR, "confidence_threshold": 1.5},
        {**HOUR, "radius_m": "3"},
        {**HOUR, "radius_m": True},
        {**HOUR, "radius_m": 0.1},
        {**HOUR, "foresight_s": 4},
        {**HOUR, "release_after_s": -1},
        {**HOUR, "vary": "aliases"},
    ],
)
async def test_nonsense_is_refused_with_its_reason(
    browser: httpx.AsyncClient, asked: WhatIfs, body: dict[str, object]
) -> None:
    told = await browser.post(PATH, json=body)

    assert told.status_code == 422
    assert told.json()["detail"]
    assert asked.newest() == []


@pytest.mark.parametrize(
    ("since", "until", "says"),
    [
        (HOUR["until"], HOUR["since"], "since is not before until"),
        (HOUR["since"], HOUR["since"], "since is not before until"),
        ("2023-10-14T20:00:00Z", HOUR["until"], "longer than seven days"),
    ],
)
async def test_a_range_that_cannot_be_asked_about_says_why(
    browser: httpx.AsyncClient, since: str, until: str, says: str
) -> None:
    told = await browser.post(PATH, json={"since": since, "until": until})

    assert told.status_code == 422
    assert told.json()["errors"] == [{"where": "body", "what": says}]


async def test_one_at_a_time_that_can_be_watched_and_ended(
    browser: httpx.AsyncClient,
) -> None:
    job = (await browser.post(PATH, json=HOUR)).json()["id"]
    again = await browser.post(PATH, json=HOUR)
    early = await browser.get(f"{PATH}/{job}/figures")
    listed = (await browser.get(PATH)).json()["items"]
    ended = await browser.delete(f"{PATH}/{job}")

    assert (again.status_code, again.json()["why"]) == (409, "yours")
    assert early.status_code == 404
    assert [one["id"] for one in listed] == [job]
    assert ended.json()["state"] == "cancelled"
    assert (await browser.get(f"{PATH}/none")).status_code == 404


async def test_an_answer_has_its_curve_and_its_figures(
    browser: httpx.AsyncClient, asked: WhatIfs
) -> None:
    body = {**HOUR, "confidence_threshold": 0.6}
    job = asked.find((await browser.post(PATH, json=body)).json()["id"])
    each = (
        Outcome(
            {"person": 60.0 * n, "robot": 30.0}, {"person": n}, n, 1.0, 2.0, 90.0, 6.04
        )
        for n in range(len(job.asked.tried))
    )
    job.answer = Answer(tuple(each), Outcome({"stale": 5.04}, {"stale": 1}), 7, 9)
    job.state = "done"

    answer = (await browser.get(f"{PATH}/{job.job_id}")).json()["answer"]
    figures = (await browser.get(f"{PATH}/{job.job_id}/figures")).json()["figures"]

    assert (answer["poses"], answer["detections"]) == (7, 9)
    assert answer["recorded_slowed_s"] == {"stale": 5.0}
    assert answer["candidate"]["slowed_s"] == {"person": 60.0, "robot": 30.0}
    values = [one["value"] for one in answer["curve"]]
    assert values == sorted({*values, 0.6, 0.75})
    minutes, near = figures["minutes"], figures["near_misses"]
    assert minutes["data"][0]["x"] == near["data"][0]["x"] == values
    assert (minutes["data"][0]["y"][0], near["data"][0]["y"][0]) == (2.0, 2)
    assert minutes["layout"]["shapes"][0]["x0"] == 0.75
    missed, false = figures["truth"]["data"]
    assert (missed["y"][0], false["y"][0]) == (1.5, 0.1)
    assert (answer["candidate"]["missed_s"], answer["in_force"]["false_s"]) == (90, 6)
    assert START.wall > job.asked.until
