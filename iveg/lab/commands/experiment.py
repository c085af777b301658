"""``iveg experiment run``: the paper's evaluation on real programs.

All programs belong to this experiment alone: it starts its own iVeg beside the FIWARE,
on free ports, with a data directory of its own.
"""

import asyncio
import os
import secrets
import sys
from collections.abc import Mapping
from contextlib import AsyncExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import urlsplit

import httpx

from iveg.adapters import clock
from iveg.cli.arguments import CommandCall
from iveg.cli.replay import live_robot
from iveg.cli.running import run_until_stopped
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.errors import DataFileError, HopError, SettingsError
from iveg.domain.parameters import by_keys
from iveg.lab.commands.demo import on_free_ports
from iveg.lab.commands.processes import Parts, running_parts
from iveg.lab.experiment.desired_states import give_back, read_free_robots
from iveg.lab.experiment.messages import LAST_COPIES_S, recorder
from iveg.lab.experiment.outcome import (
    Outcome,
    counted_of,
    outcome_of,
    result_of,
    timed_of,
    write_raw,
)
from iveg.lab.experiment.plan import (
    GREENHOUSE,
    PLANS,
    ROBOTS,
    ExperimentPlan,
    PlannedRun,
    claim,
    directory_of,
    write_json,
)
from iveg.lab.experiment.report import write_report
from iveg.lab.experiment.stage import TimedRecording, VirtualRun
from iveg.settings import Settings

_STOPS_WITHIN_S = 4.0
_LIVE_WITHIN_S = 30.0
T = TypeVar("T")


def run(call: CommandCall) -> int:
    """Run it; returns the exit code."""
    options, settings, environment = call.options, call.settings, call.environment
    plan = replace(PLANS[options.size], profile=options.profile)
    if options.seed is not None:
        plan = replace(plan, seed=options.seed)
    directory = options.out or directory_of(call.data / "experiments", plan.size)
    claim(directory)
    embedded = options.fiware == ["embedded"]
    named = with_fiware(settings, options.fiware)
    placed = experiment_settings(
        directory, on_free_ports(named, environment, fiware=embedded)
    )
    lab = Lab(
        plan,
        directory,
        placed,
        embedded=embedded,
        keep_raw=options.keep_raw or plan.size == "full",
    )
    return run_until_stopped(lab.run(environment)) or lab.exit_code


def with_fiware(settings: Settings, words: list[str]) -> Settings:
    """Settings for ``--fiware``: ``embedded``, ``settings``, or addresses.

    Raises:
        SettingsError: Orion's or the IoT Agent's address is missing or invalid.
    """
    if words in (["embedded"], ["settings"]):
        return settings
    schemes = [urlsplit(word).scheme for word in words]
    web = [w for w, s in zip(words, schemes, strict=True) if s in ("http", "https")]
    mqtt = [w for w, s in zip(words, schemes, strict=True) if s in ("mqtt", "mqtts")]
    if len(web) != 2 or len(mqtt) > 1 or len(web) + len(mqtt) != len(words):
        expected = "Orion's address, the IoT Agent's and, if not set, the broker's"
        raise SettingsError("--fiware", " ".join(words), expected)
    broker = mqtt[0] if mqtt else settings.mqtt_url
    return replace(settings, orion_url=web[0], iota_url=web[1], mqtt_url=broker)


def experiment_settings(directory: Path, settings: Settings) -> Settings:
    """The paper's fleet in its greenhouse, with data and secrets of its own."""
    return replace(
        settings,
        robots=ROBOTS,
        fleet="",
        greenhouse=GREENHOUSE,
        api_token=secrets.token_urlsafe(24),
        sign_in_token=secrets.token_hex(32),
        notify_token=secrets.token_hex(32),
        database_url="",
        data_directory=str(directory / "data"),
        recordings=False,
    )


@dataclass
class Lab:
    """One running experiment.

    Attributes:
        directory: Where its results go.
        embedded: Whether FIWARE is started as well.
        keep_raw: Whether raw data stay.
        exit_code: 1 if it ended before its plan was complete.
    """

    plan: ExperimentPlan
    directory: Path
    settings: Settings
    embedded: bool = True
    keep_raw: bool = False
    exit_code: int = 1
    _outcomes: list[Outcome] = field(default_factory=list)
    _stops: list[str] | None = None
    """Ids of the STOPs that it sent; None: none was sent, empty: it does not know."""
    _retained: Mapping[str, bytes] = field(default_factory=dict)
    """Desired states of the site's robots before."""

    async def run(self, environment: Mapping[str, str]) -> None:
        """Run every step, then write the report."""
        surroundings = {**environment, **self.settings.to_environment()}
        print(f"experiment: {self.directory}", flush=True)
        why = "interrupted"
        try:
            if not self.embedded:
                await refuse_live_robots(self.settings)
                self._retained = await read_free_robots(self.settings, ROBOTS)
            async with running_parts(surroundings) as parts:
                if self.embedded:
                    await parts.start("fiware")
                # As in a demo no link is printed: no person signs in here.
                await parts.start("serve", "--demo")
                for step in self.plan.steps():
                    await self._step(step, parts)
            why = ""
        except (HopError, DataFileError, SystemExit) as error:
            why = str(error)
        finally:
            self._finish(await self._give_back() or why)

    async def _give_back(self) -> str:
        """Leave a site's robots as they were; why not, or empty."""
        if self.embedded or self._stops is None:
            return ""
        if not self._stops:
            return "its STOP was not answered and may be retained at the broker"
        try:
            await give_back(self.settings, ROBOTS, self._stops, self._retained)
        except HopError as error:
            return f"its STOP is still retained at the broker: {error}"
        return ""

    async def _step(self, step: PlannedRun, parts: Parts) -> None:
        self._say(step, "virtual clock")
        rehearsal = VirtualRun(step, DetectionRule.of(self.settings.rule))
        before = os.getloadavg()[0]
        virtual = await parts.outlast(rehearsal.play(step.counted_s))
        real = None
        if step.is_timed:
            self._say(step, "real time")
            before = os.getloadavg()[0]
            real = await self._real(step, parts)
        load = before, os.getloadavg()[0]
        timed = None if real is None else timed_of(real)
        outcome = outcome_of(step, counted_of(virtual), timed, load)
        if self.keep_raw:
            raw = self.directory / "raw" / step.name
            write_raw(raw, outcome, virtual, real, self._chosen())
        self._outcomes.append(outcome)

    def _say(self, step: PlannedRun, half: str) -> None:
        number, count = len(self._outcomes) + 1, len([*self.plan.steps()])
        print(f"{number} of {count}  {step.name}: {half}", flush=True)

    async def _real(self, step: PlannedRun, parts: Parts) -> TimedRecording:
        """Play a run by all programs, any of which may end early."""
        words = ["--scenario", step.family, "--seed", str(step.seed)]
        async with recorder(self.settings) as recorded, AsyncExitStack() as stack:
            await parts.start("emulator", *words, "--profile", step.profile)
            stack.push_async_callback(parts.stop_newest)
            began_live = await parts.outlast(self._until_live())
            settled = await parts.outlast(recorded.settle())
            began = clock.wall()
            await parts.outlast(asyncio.sleep(step.seconds))
            ended = clock.wall()
            await parts.outlast(asyncio.sleep(LAST_COPIES_S))
            times = recorded.times(began, ended)
            completed = began_live and await self._are_live()
            # Stopped robots are not released here, so STOP comes last.
            is_last = step == [*self.plan.steps()][-1]
            stops = await self._stop() if is_last else ()
        return TimedRecording(began, ended, times, settled, completed, stops)

    async def _until_live(self) -> bool:
        deadline = clock.mono() + _LIVE_WITHIN_S
        while not await self._are_live():
            if clock.mono() > deadline:
                return False
            await asyncio.sleep(0.5)
        return True

    async def _are_live(self) -> bool:
        robots = (await self._ask("robots"))["items"]
        return bool(robots) and all(one["link"] == "LIVE" for one in robots)

    async def _stop(self) -> Any:
        """Stop the fleet; time until each robot stood (ms)."""
        self._stops = []
        pressed = await self._ask("fleet/stop", "POST")
        self._stops = [one["command_id"] for one in pressed["commands"]]
        deadline = clock.mono() + _STOPS_WITHIN_S
        while True:
            await asyncio.sleep(0.5)
            robots = (await self._ask("commands/latency"))["robots"]
            standing = sum(one["standing"]["count"] for one in robots)
            if standing >= len(ROBOTS) or clock.mono() > deadline:
                return robots

    async def _ask(self, path: str, method: str = "GET") -> Any:
        """One response of the API.

        Raises:
            HopError: iVeg did not answer.
        """
        bearer = {"Authorization": f"Bearer {self.settings.api_token}"}
        try:
            async with httpx.AsyncClient(headers=bearer, trust_env=False) as client:
                place = f"{self.settings.host}:{self.settings.port}"
                url = f"http://{place}/api/v1/{path}"
                answer = await client.request(method, url, timeout=10.0)
                return answer.raise_for_status().json()
        except httpx.HTTPError as error:
            raise HopError("iveg", f"{path}: {error!r}") from error

    def _finish(self, why: str) -> None:
        result = result_of(self.plan, self._outcomes, self._chosen(), why)
        write_json(self.directory / "result.json", result)
        report = self.directory / "result.html"
        report.write_text(write_report(result), encoding="utf-8")
        self.exit_code = int(bool(why))
        if why:
            print(f"iveg: broken off ({why}): {self.directory}", file=sys.stderr)
        print(f"report: {report}", flush=True)

    def _chosen(self) -> dict[str, object]:
        """Settings that influence the numbers."""
        settings = self.settings
        return {
            "fiware": "embedded" if self.embedded else "named",
            **by_keys(settings.rule),
            "direct_read": settings.direct_read,
        }


async def refuse_live_robots(settings: Settings) -> None:
    """Refuse to start while a live robot is connected: the names are the same.

    Raises:
        DataFileError: Orion had data of one of them a moment ago.
        HopError: Orion does not answer.
    """
    live = await live_robot(settings, ROBOTS)
    if live is not None:
        reason = f"{live} is live there; stop it first"
        raise DataFileError("--fiware", settings.orion_url, reason)
