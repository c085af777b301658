"""``iveg experiment``: runs the paper's evaluation on real programs; compares results.

Each finished run is a file, so that the same command continues after Ctrl-C or a crash.
All programs belong to this experiment alone: it starts its own iVeg beside the FIWARE,
on free ports, with a data directory of its own.
"""

import asyncio
import os
import secrets
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import urlsplit

import httpx

from iveg.adapters import clock
from iveg.cli.arguments import CommandCall
from iveg.cli.live_robots import live_robot
from iveg.cli.running import run_until_stopped
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.errors import DataFileError, HopError, SettingsError
from iveg.domain.stamps import format_stamp
from iveg.lab.commands.demo import on_free_ports
from iveg.lab.commands.processes import Parts
from iveg.lab.experiment import compare
from iveg.lab.experiment.desired_states import give_back, read_free_robots
from iveg.lab.experiment.message_recorder import LAST_COPIES_S, recorder
from iveg.lab.experiment.observer import ObservedRun, watch
from iveg.lab.experiment.outcome import (
    half_of,
    outcome_of,
    stack_of,
)
from iveg.lab.experiment.plan import (
    GREENHOUSE,
    PLANS,
    ROBOTS,
    WATCHED,
    PlannedRun,
    directory_of,
)
from iveg.lab.experiment.progress import Progress
from iveg.lab.experiment.raw import write_raw
from iveg.lab.experiment.recording import read_truth
from iveg.lab.experiment.run_store import RunStore
from iveg.lab.experiment.virtual_run import VirtualRun
from iveg.settings import Settings

_STOPS_WITHIN_S = 4.0
_LIVE_WITHIN_S = 30.0
T = TypeVar("T")


def run(call: CommandCall) -> int:
    """Run or compare; returns the exit code."""
    options, settings, environment = call.options, call.settings, call.environment
    if options.word == "compare":
        results = map(compare.read_result, (options.before, options.after))
        print(compare.write_comparison(*results), end="")
        return 0
    plan = replace(PLANS[options.size], profile=options.profile)
    if options.seed is not None:
        plan = replace(plan, seed=options.seed)
    directory = options.out or directory_of(call.data / "experiments", plan)
    embedded = options.fiware == ["embedded"]
    named = with_fiware(settings, options.fiware)
    placed = experiment_settings(
        directory, on_free_ports(named, environment, fiware=embedded)
    )
    lab = Lab(
        RunStore(plan, directory),
        placed,
        embedded=embedded,
        keep_raw=options.keep_raw or plan.size == "full",
    )
    work = lab.run(environment)
    return run_until_stopped(work, until_eof=options.until_eof) or lab.exit_code


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
        orion_throttle=False,
        recordings=False,
    )


@dataclass
class Lab:
    """One running experiment.

    Attributes:
        embedded: Whether FIWARE is started as well.
        keep_raw: Whether raw data stay.
        exit_code: 1 if it ended before its plan was complete.
    """

    notebook: RunStore
    settings: Settings
    embedded: bool = True
    keep_raw: bool = False
    exit_code: int = 1
    _stops: list[str] | None = None
    """Ids of the STOPs that it sent; None: none was sent, empty: it does not know."""
    _retained: Mapping[str, bytes] = field(default_factory=dict)
    """Desired states of the site's robots before."""

    async def run(self, environment: Mapping[str, str]) -> None:
        """Run every step that is not done yet, then write the report."""
        surroundings = {**environment, **self.settings.to_environment()}
        steps = self.notebook.steps_left()
        directory = self.notebook.directory
        print(f"experiment: {directory}", flush=True)
        progress = Progress(directory, steps, self.notebook.done, sys.stdout)
        ticking = asyncio.create_task(_ticks(progress))
        why = "interrupted"
        try:
            if not self.embedded:
                await refuse_live_robots(self.settings)
                self._retained = await read_free_robots(self.settings, ROBOTS)
            async with Parts(surroundings) as parts:
                if self.embedded:
                    await parts.start("fiware")
                # As in a demo no link is printed: no person signs in here.
                await parts.start("serve", "--demo")
                for step in steps:
                    await self._step(step, parts, progress)
            why = ""
        except (HopError, DataFileError, SystemExit) as error:
            why = str(error)
        finally:
            ticking.cancel()
            why = await self._give_back() or why
            self._finish(why, progress)

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

    async def _step(self, step: PlannedRun, parts: Parts, progress: Progress) -> None:
        progress.begin(step, "counting", clock.mono())
        rehearsal = VirtualRun(step, self._rule)
        before = os.getloadavg()[0]
        virtual = await parts.outlast(rehearsal.play(step.counted_s))
        real = None
        if step.is_timed:
            progress.begin(step, "running", clock.mono())
            before = os.getloadavg()[0]
            real = await self._timed(step, parts)
        load = before, os.getloadavg()[0]
        stack = None if real is None else stack_of(real)
        outcome = outcome_of(step, half_of(virtual), stack, load)
        if self.keep_raw:
            write_raw(self.notebook.raw(step), outcome, virtual, real, self._chosen())
        self.notebook.keep(step, outcome)
        progress.end(step, clock.mono())

    async def _timed(self, step: PlannedRun, parts: Parts) -> ObservedRun:
        """The half in real time, whose emulator ends with it."""
        truth = self.notebook.directory / f"{step.name}.truth.jsonl"
        started = len(parts.running)
        try:
            return await self._real(step, parts, truth)
        finally:
            if len(parts.running) > started:
                await parts.stop_newest()
            truth.unlink(missing_ok=True)

    @property
    def _rule(self) -> DetectionRule:
        """The rule of the iVeg that is started."""
        settings = self.settings
        return DetectionRule(
            threshold=settings.confidence_threshold, radius_m=settings.safety_radius_m
        )

    async def _real(self, step: PlannedRun, parts: Parts, truth: Path) -> ObservedRun:
        """The same run by all programs, any of which may end early."""
        words = ["--scenario", step.family, "--seed", str(step.seed)]
        words += ["--profile", step.profile, "--truth", str(truth)]
        since = format_stamp(clock.wall())
        url, token = self._url, self.settings.api_token
        async with recorder(self.settings) as recorded:
            await parts.start("emulator", *words)
            completed = await parts.outlast(self._until_live())
            settled = await parts.outlast(recorded.settle())
            real = await parts.outlast(watch(url, token, step.seconds, WATCHED))
            await parts.outlast(asyncio.sleep(LAST_COPIES_S))
            real.times = recorded.times(real.edges[0], real.edges[-1])
        real.truth, real.settled = read_truth(truth), settled
        real.completed = completed and await self._are_live() and bool(real.pairs)
        # Stopped robots are not released here, so STOP comes last.
        real.stops = await self._stop() if self.notebook.is_last(step) else []
        asked = f"decisions?since={since}&limit=500"
        real.decisions = (await self._ask(asked))["items"]
        return real

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

    @property
    def _url(self) -> str:
        return f"http://{self.settings.host}:{self.settings.port}"

    async def _ask(self, path: str, method: str = "GET") -> Any:
        """One response of the API.

        Raises:
            HopError: iVeg did not answer.
        """
        bearer = {"Authorization": f"Bearer {self.settings.api_token}"}
        try:
            async with httpx.AsyncClient(headers=bearer, trust_env=False) as client:
                url = f"{self._url}/api/v1/{path}"
                answer = await client.request(method, url, timeout=10.0)
                return answer.raise_for_status().json()
        except httpx.HTTPError as error:
            raise HopError("iveg", f"{path}: {error!r}") from error

    def _finish(self, why: str, progress: Progress) -> None:
        # A reader of the final state may open the report at once.
        report = self.notebook.finish(self._chosen(), why)
        progress.finish(why)
        self.exit_code = int(bool(why))
        if why:
            reason = f"broken off ({why}); the same command goes on with it"
            print(f"iveg: {reason}: {self.notebook.directory}", file=sys.stderr)
        print(f"report: {report}", flush=True)

    def _chosen(self) -> dict[str, object]:
        """Settings that influence the numbers."""
        settings = self.settings
        return {
            "fiware": "embedded" if self.embedded else "named",
            "confidence_threshold": settings.confidence_threshold,
            "safety_radius_m": settings.safety_radius_m,
            "direct_read": settings.direct_read,
            "uplink": settings.uplink,
            "orion_throttle": settings.orion_throttle,
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


async def _ticks(progress: Progress) -> None:
    while True:
        await asyncio.sleep(1.0)
        progress.tick(clock.mono())
