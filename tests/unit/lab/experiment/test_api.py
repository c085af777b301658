"""Experiments over HTTP: read by all, started by operators, with harmless reports."""

from pathlib import Path
from typing import Any

import pytest

from iveg.domain.errors import ExperimentRefusedError
from iveg.lab.experiment import api
from iveg.lab.pages import page
from iveg.models.experiment import Experiment, Experiments
from iveg.web.security.roles import Role
from tests.unit.web.desk import WebDesk

ONE = Experiment(
    name="quick-001",
    size="quick",
    state="done",
    run=None,
    phase=None,
    done=5,
    of=5,
    left_s=0,
    why="",
    began_at="2026-11-20T09:00:00.000Z",
    report=True,
)


class FakeRunner:
    """Implements ``lab.experiment.api.ExperimentRunner``; ``asked`` is what came."""

    def __init__(self, place: Path, refused: str | None = None) -> None:
        self.asked: list[str] = []
        self._place = place
        self._refused = refused

    def start(self, size: str) -> Experiment:
        if self._refused is not None:
            raise ExperimentRefusedError(self._refused)
        self.asked.append(size)
        return ONE

    def stop(self) -> None:
        self.asked.append("stop")

    def list(self) -> Experiments:
        return Experiments(items=[ONE], refused=self._refused)

    def file(self, name: str, kind: str) -> Path | None:
        file = self._place / f"{name}.{kind}"
        return file if file.exists() else None


def desk_with(bench: FakeRunner) -> WebDesk:
    desk = WebDesk()
    desk.app.include_router(api.router(bench))
    desk.app.include_router(page(desk.pages))
    return desk


async def order(desk: WebDesk, role: Role, path: str, body: Any) -> Any:
    async with desk.browser(role) as browser:
        return await browser.post(f"/api/v1/{path}", json=body)


async def test_an_operator_starts_and_ends_one(tmp_path: Path) -> None:
    bench = FakeRunner(tmp_path)
    desk = desk_with(bench)

    begun = await order(desk, "operator", "experiments", {"size": "full"})
    ended = await order(desk, "operator", "experiments/stop", {})

    assert (begun.status_code, ended.status_code) == (202, 202)
    assert bench.asked == ["full", "stop"]
    assert Experiment.model_validate(begun.json()) == ONE
    assert Experiments.model_validate(ended.json()).items == [ONE]


async def test_viewers_and_programs_only_watch(tmp_path: Path) -> None:
    bench = FakeRunner(tmp_path)
    desk = desk_with(bench)

    refused = [
        await order(desk, "viewer", "experiments", {}),
        await order(desk, "viewer", "experiments/stop", {}),
    ]
    async with desk.program() as program:
        refused.append(await program.post("/api/v1/experiments", json={}))
        seen = await program.get("/api/v1/experiments")

    assert [one.status_code for one in refused] == [403, 403, 403]
    assert seen.json()["items"][0]["name"] == "quick-001"
    assert bench.asked == []


async def test_another_sites_page_starts_none(tmp_path: Path) -> None:
    bench = FakeRunner(tmp_path)
    desk = desk_with(bench)
    async with desk.browser() as browser:
        foreign = {"Sec-Fetch-Site": "cross-site"}
        answer = await browser.post("/api/v1/experiments", json={}, headers=foreign)

    assert answer.status_code == 403
    assert bench.asked == []


@pytest.mark.parametrize("why", ["running", "live_robot"])
async def test_a_refusal_says_why(tmp_path: Path, why: str) -> None:
    desk = desk_with(FakeRunner(tmp_path, why))

    answer = await order(desk, "operator", "experiments", {"size": "quick"})

    assert answer.status_code == 409
    assert answer.json()["why"] == why


@pytest.mark.parametrize("body", [{"size": "huge"}, {"size": 1}, {"words": "--out /"}])
async def test_only_the_sizes_that_there_are_can_be_asked_for(
    tmp_path: Path, body: Any
) -> None:
    answer = await order(desk_with(FakeRunner(tmp_path)), "admin", "experiments", body)

    assert answer.status_code == 422


async def test_a_report_is_shown_where_it_can_neither_call_us_nor_be_framed(
    tmp_path: Path,
) -> None:
    (tmp_path / "quick-001.html").write_text("<h1>whole</h1>")
    (tmp_path / "quick-001.json").write_text("{}")
    async with desk_with(FakeRunner(tmp_path)).browser("viewer") as browser:
        report = await browser.get("/api/v1/experiments/quick-001/report")
        result = await browser.get("/api/v1/experiments/quick-001/result")

    policy = report.headers["content-security-policy"]
    assert report.text == "<h1>whole</h1>"
    assert "sandbox allow-scripts" in policy
    assert "allow-same-origin" not in policy
    assert "connect-src" not in policy
    assert "default-src 'none'" in policy
    assert "quick-001.json" in result.headers["content-disposition"]


@pytest.mark.parametrize("name", ["full-001", "..%2Fquick-001", "quick-1", "secrets"])
async def test_no_other_file_is_reached(tmp_path: Path, name: str) -> None:
    (tmp_path / "quick-001.html").write_text("")
    async with desk_with(FakeRunner(tmp_path)).browser() as browser:
        answer = await browser.get(f"/api/v1/experiments/{name}/report")

    assert answer.status_code in (404, 422)


@pytest.mark.parametrize(
    ("language", "title"),
    [("es", "La evaluación del artículo"), ("en", "The paper's evaluation")],
)
async def test_the_page_is_in_the_readers_language(
    tmp_path: Path, language: str, title: str
) -> None:
    headers = {"Accept-Language": language}
    async with desk_with(FakeRunner(tmp_path)).browser("viewer") as browser:
        answer = await browser.get("/experiments", headers=headers)

    assert answer.status_code == 200
    assert title in answer.text.replace("&#39;", "'")
