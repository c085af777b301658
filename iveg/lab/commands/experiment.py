"""``iveg experiment run``: the paper's evaluation on real programs.

All programs belong to this experiment alone: it starts FIWARE and its own iVeg on free
ports, with a data directory of its own.
"""

import asyncio
import secrets
import sys
from collections.abc import Mapping
from contextlib import AsyncExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import httpx

from iveg.adapters import clock
from iveg.cli.arguments import CommandCall
from iveg.cli.running import run_until_stopped
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.errors import DataFileError, HopError
from iveg.domain.parameters import by_keys
from iveg.lab.commands.demo import on_free_ports
from iveg.lab.commands.processes import Parts, running_parts
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

_LIVE_WITHIN_S = 30.0


def run(call: CommandCall) -> int:
    """Run it; returns the exit code."""
    options = call.options
    plan = replace(PLANS[options.size], profile=options.profile)
    if options.seed is not None:
        plan = replace(plan, seed=options.seed)
    directory = options.out or directory_of(call.data / "experiments", plan.size)
    claim(directory)
    settings = on_free_ports(call.settings, call.environment)
    lab = Lab(
        plan,
        directory,
        experiment_settings(directory, settings),
        keep_raw=options.keep_raw or plan.size == "full",
    )
    return run_until_stopped(lab.run(call.environment)) or lab.exit_code


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
        directory: Folder of its results.
        keep_raw: Whether raw data stay.
        exit_code: 1 if it ended before its plan was complete.
    """

    plan: ExperimentPlan
    directory: Path
    settings: Settings
    keep_raw: bool = False
    exit_code: int = 1
    _outcomes: list[Outcome] = field(default_factory=list)

    async def run(self, environment: Mapping[str, str]) -> None:
        """Run every step, then write the report."""
        surroundings = {**environment, **self.settings.to_environment()}
        print(f"experiment: {self.directory}", flush=True)
        reason = "interrupted"
        try:
            async with running_parts(surroundings) as parts:
                await parts.start("fiware")
                # As in a demo no link is printed: no person signs in here.
                await parts.start("serve", "--demo")
                for step in self.plan.steps():
                    await self._step(step, parts)
            reason = ""
        except (HopError, DataFileError, SystemExit) as error:
            reason = str(error)
        finally:
            self._finish(reason)

    async def _step(self, step: PlannedRun, parts: Parts) -> None:
        self._say(step, "virtual clock")
        rehearsal = VirtualRun(step, DetectionRule.from_parameters(self.settings.rule))
        virtual = await parts.outlast(rehearsal.play(step.counted_s))
        real = None
        if step.is_timed:
            self._say(step, "real time")
            real = await self._real(step, parts)
        timed = None if real is None else timed_of(real)
        outcome = outcome_of(step, counted_of(virtual), timed)
        if self.keep_raw:
            write_raw(self.directory / "raw" / step.name, outcome, virtual, real)
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
            began = clock.wall()
            await parts.outlast(asyncio.sleep(step.seconds))
            ended = clock.wall()
            await parts.outlast(asyncio.sleep(LAST_COPIES_S))
            times = recorded.times(began, ended)
            completed = began_live and await self._are_live()
        return TimedRecording(began, ended, times, completed)

    async def _until_live(self) -> bool:
        deadline = clock.mono() + _LIVE_WITHIN_S
        while not await self._are_live():
            if clock.mono() > deadline:
                return False
            await asyncio.sleep(0.5)
        return True

    async def _are_live(self) -> bool:
        """Whether iVeg has all robots live.

        Raises:
            HopError: iVeg did not answer.
        """
        place = f"{self.settings.host}:{self.settings.port}"
        bearer = {"Authorization": f"Bearer {self.settings.api_token}"}
        try:
            async with httpx.AsyncClient(headers=bearer, trust_env=False) as client:
                url = f"http://{place}/api/v1/robots"
                response = await client.get(url, timeout=10.0)
                robots: list[Any] = response.raise_for_status().json()["items"]
        except httpx.HTTPError as error:
            raise HopError("iveg", repr(error)) from error
        return bool(robots) and all(robot["link"] == "LIVE" for robot in robots)

    def _finish(self, why: str) -> None:
        configuration = {
            **by_keys(self.settings.rule),
            "direct_read": self.settings.direct_read,
        }
        result = result_of(self.plan, self._outcomes, configuration, why)
        write_json(self.directory / "result.json", result)
        report = self.directory / "result.html"
        report.write_text(write_report(result), encoding="utf-8")
        self.exit_code = int(bool(why))
        if why:
            print(f"iveg: broken off ({why}): {self.directory}", file=sys.stderr)
        print(f"report: {report}", flush=True)
