"""The latency API: the paper's table live, honest about samples, clocks and loss."""

import csv
import io
from typing import Any

import pytest

from iveg.domain.observations import FeedbackRef, Origin, Received
from iveg.domain.transports import DIRECT, FIWARE
from iveg.models.base import Slots
from iveg.models.latency import SegmentRemark
from tests.builders import START, odometry
from tests.unit.web.desk import WebDesk


def drive(desk: WebDesk, seconds: float, *, thinned: bool = False) -> None:
    """AGI sends twenty messages a second: 4 ms to the broker, 20 ms more to Orion."""
    for _ in range(round(20 * seconds)):
        desk.seq += 1
        desk.clock.now = round(desk.clock.now + 0.05, 6)
        stamp = START.wall + desk.clock.now - 0.004
        heard = FeedbackRef("iveg", desk.seq)
        desk.world.ledger.composed("iveg", desk.seq, desk.seq, desk.clock().mono - 0.01)
        origin = Origin("b", desk.seq, "2023", stamp, None, True, heard)
        told = odometry("AGI", origin=origin)
        desk.ingest.enqueue(Received(told, desk.clock(), DIRECT.id))
        desk.ingest.enqueue(
            Received(told, desk.clock().later(0.020), FIWARE.id, thinned=thinned)
        )
        desk.loop.step(desk.ingest.drain(), desk.clock())


async def ask(desk: WebDesk, query: str = "window=1min") -> dict[str, Any]:
    async with desk.program() as program:
        answer = await program.get(f"/api/v1/latency?{query}")
    assert answer.status_code == 200, answer.text
    body: dict[str, Any] = answer.json()
    return body


def test_a_count_in_a_sentence_is_a_whole_number() -> None:
    slots: Slots = {"robot": "AGI", "data": "odometry", "count": 5}
    remark = SegmentRemark(key="reordered", hop="fiware", slots=slots)

    assert '"count":5}' in remark.model_dump_json()


def row(told: dict[str, Any], data: str = "odometry") -> dict[str, Any]:
    found: dict[str, Any] = next(one for one in told["rows"] if one["data"] == data)
    return found


async def test_each_hop_is_told_with_its_count_mean_and_quantiles() -> None:
    desk = WebDesk()
    drive(desk, 10.0)

    hops = row(await ask(desk))["hops"]

    assert hops["uplink"]["count"] == 200
    assert hops["uplink"]["mean_ms"] == pytest.approx(4.0, abs=0.2)
    assert hops["fiware"]["p95_ms"] == pytest.approx(20.0, abs=0.3)
    assert hops["robot_orion"]["mean_ms"] == pytest.approx(24.0, abs=0.2)
    assert hops["screen"] == {
        "count": 0,
        **dict.fromkeys(
            ("mean_ms", "p50_ms", "p95_ms", "p99_ms", "least_ms", "most_ms")
        ),
    }


async def test_what_the_paper_printed_stands_beside_it() -> None:
    paper = (await ask(WebDesk()))["paper"]

    assert paper["field"]["odometry"] == {
        "uplink_mean": 16.9,
        "uplink_p95": 103.9,
        "fiware_mean": 121.3,
        "fiware_p95": 212.6,
        "total_mean": 138.2,
        "total_p95": 316.5,
    }
    assert paper["simulation"]["lidar"]["total_p95"] == 168.5


@pytest.mark.parametrize("place", ["simulation", "field"])
@pytest.mark.parametrize("data", ["odometry", "detections", "lidar"])
async def test_the_papers_totals_are_the_sums_that_it_printed(
    place: str, data: str
) -> None:
    printed = (await ask(WebDesk()))["paper"][place][data]

    for what in ("mean", "p95"):
        total = printed[f"uplink_{what}"] + printed[f"fiware_{what}"]
        assert printed[f"total_{what}"] == pytest.approx(total, abs=0.11)


async def test_a_throttled_hop_says_that_it_is_a_sample() -> None:
    desk = WebDesk()
    drive(desk, 2.0, thinned=True)

    told = await ask(desk)

    assert row(told)["sampled"] == ["fiware", "robot_orion", "screen"]
    assert row(told, "lidar")["sampled"] == ["screen"]
    assert told["streams"][0]["throttled"] is True


async def test_clocks_are_told_with_their_uncertainty() -> None:
    desk = WebDesk()
    drive(desk, 2.0)

    clocks = {one["robot_id"]: one for one in (await ask(desk))["clocks"]}

    assert clocks["AGI"]["state"] == "in_step"
    assert clocks["AGI"]["offset_ms"] == 0.0
    assert 0.0 < clocks["AGI"]["uncertainty_ms"] < 20.0
    assert clocks["AGII"]["state"] == "unknown"
    assert clocks["AGII"]["offset_ms"] is None


async def test_one_robot_may_be_asked_for_alone() -> None:
    desk = WebDesk()
    drive(desk, 2.0)

    other = await ask(desk, "window=1min&robot=AGII")

    assert row(other)["hops"]["uplink"]["count"] == 0
    assert {one["robot_id"] for one in other["streams"]} == {"AGII"}


async def test_the_figures_are_drawn_unless_somebody_wants_none() -> None:
    desk = WebDesk()
    drive(desk, 5.0)

    figures = (await ask(desk))["figures"]
    none = (await ask(desk, "figures=false"))["figures"]

    assert [one["meta"]["hop"] for one in figures["bars"]["data"]] == [
        "uplink",
        "fiware",
        "iveg",
    ]
    whisker = figures["bars"]["data"][1]["error_y"]["array"][0]
    assert whisker == pytest.approx(0.0, abs=0.3)
    assert figures["cdf"]["data"][0]["y"][-1] == 1.0
    assert none == {}


async def test_one_message_is_told_from_hop_to_hop() -> None:
    desk = WebDesk()
    drive(desk, 5.0)

    trace = (await ask(desk))["trace"]

    steps = {one["hop"]: (one["from_ms"], one["to_ms"]) for one in trace["steps"]}
    assert steps["uplink"] == pytest.approx((0.0, 4.0), abs=0.1)
    assert steps["fiware"] == pytest.approx((4.0, 24.0), abs=0.1)
    assert "screen" not in steps


async def test_what_is_wrong_with_a_hop_is_told_in_a_sentence() -> None:
    desk = WebDesk()
    drive(desk, 2.0)
    for _ in range(40):
        desk.seq += 1
        desk.clock.now += 0.05
        told = odometry("AGI", origin=Origin("b", desk.seq))
        desk.ingest.enqueue(Received(told, desk.clock(), DIRECT.id))
        desk.loop.step(desk.ingest.drain(), desk.clock())

    remarks = (await ask(desk))["remarks"]

    assert [one["hop"] for one in remarks] == ["fiware"]
    assert remarks[0]["slots"]["lag"] == pytest.approx(1.5, abs=0.6)


async def test_messages_that_do_not_count_are_told_with_their_reason() -> None:
    desk = WebDesk()
    told = odometry("AGI", origin=Origin("b", 1))
    desk.ingest.enqueue(Received(told, desk.clock(), DIRECT.id))

    streams = (await ask(desk))["streams"]

    assert streams[0]["excluded"] == {"uplink": {"no_stamp": 1}}


@pytest.mark.parametrize("query", ["window=1h", "robot=a%20b", "since=now"])
async def test_what_is_no_question_is_refused(query: str) -> None:
    async with WebDesk().program() as program:
        answer = await program.get(f"/api/v1/latency?{query}")

    assert answer.status_code == 422


async def test_the_table_comes_as_csv_for_whoever_likes_that() -> None:
    desk = WebDesk()
    drive(desk, 2.0)
    async with desk.program() as program:
        asked = await program.get("/api/v1/latency?window=1min&format=csv")
        liked = await program.get("/api/v1/latency", headers={"Accept": "text/csv"})

    lines = list(csv.DictReader(io.StringIO(asked.text)))
    assert asked.headers["content-type"].startswith("text/csv")
    assert len(lines) == 15
    assert lines[0]["data"] == "odometry"
    assert (lines[0]["hop"], lines[0]["count"]) == ("uplink", "40")
    assert liked.text.splitlines()[0] == asked.text.splitlines()[0]


async def test_the_whole_distribution_is_told_to_whoever_asks() -> None:
    desk = WebDesk()
    drive(desk, 2.0)

    bins = row(await ask(desk, "window=24h&bins=true"))["bins"]["uplink"]

    assert sum(bins["counts"]) == 40
    assert bins["total_ms"] == pytest.approx(160.0, abs=2.0)
    assert bins["edges_ms"] == sorted(bins["edges_ms"])
    assert all(3.9 < edge < 4.2 for edge in bins["edges_ms"])
    assert row(await ask(desk))["bins"] is None


async def test_strangers_learn_nothing() -> None:
    async with WebDesk().stranger() as stranger:
        answer = await stranger.get("/api/v1/latency")

    assert answer.status_code == 401
