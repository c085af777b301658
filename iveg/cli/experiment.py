"""``iveg experiment``: runs the paper's evaluation on real programs, and compares two.

Each finished run is a file, so that what Ctrl-C or a crash broke off is taken up again
by the same command.  All programs are of this experiment alone: it starts its own iVeg
beside the FIWARE, on free ports, with a data directory of its own.
"""

import argparse
import asyncio
import contextlib
import secrets
import sys
from collections.abc import AsyncIterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import httpx

from iveg.adapters import clock
from iveg.cli.demo import on_free_ports, start_part, stop_parts, wait_ready
from iveg.cli.running import run_until_told
from iveg.domain.errors import HopError
from iveg.domain.stamps import format_stamp
from iveg.experiment import compare
from iveg.experiment.notebook import Notebook, directory_of
from iveg.experiment.observer import injections, slowdowns_of, watch
from iveg.experiment.outcome import outcome_of, read_json, read_truth
from iveg.experiment.plan import PLANS, Step
from iveg.experiment.scoring import tally
from iveg.settings import Settings

_STARTS_S = 6.0
_STOPS_WITHIN_S = 4.0
_LIVE_WITHIN_S = 30.0


def experiment(
    options: argparse.Namespace,
    settings: Settings,
    environment: Mapping[str, str],
    data: Path,
) -> int:
    """Run or compare; returns the exit code."""
    if options.word == "compare":
        before, after = read_json(options.before), read_json(options.after)
        print(compare.write_comparison(before, after), end="")
        return 0
    plan = replace(PLANS[options.size], profile=options.profile)
    if options.seed is not None:
        plan = replace(plan, seed=options.seed)
    directory = options.out or directory_of(data / "experiments", plan)
    embedded = options.fiware == "embedded"
    placed = _placed(settings, environment, directory, embedded)
    lab = Lab(Notebook(plan, directory), plan.profile, placed)
    return run_until_told(lab.run(environment, embedded=embedded)) or lab.exit_code


def _placed(
    settings: Settings, environment: Mapping[str, str], directory: Path, embedded: bool
) -> Settings:
    """Everything where nothing else is; a FIWARE that is named stays where it is."""
    moved = on_free_ports(settings, environment) if embedded else settings
    return replace(
        moved,
        api_token=secrets.token_urlsafe(24),
        sign_in_token=secrets.token_hex(32),
        notify_token=secrets.token_hex(32),
        database_url="",
        data_directory=str(directory / "data"),
        orion_throttle=False,
    )


@dataclass
class Lab:
    """One experiment on its way.

    Attributes:
        exit_code: 1 where it ended before its plan did.
    """

    notebook: Notebook
    profile: str
    settings: Settings
    exit_code: int = 1

    async def run(self, environment: Mapping[str, str], *, embedded: bool) -> None:
        """Every step that is not done yet, then the report."""
        surroundings = {**environment, **self.settings.to_environment()}
        why = "interrupted"
        measured: dict[str, Any] = {}
        try:
            async with self._stack(surroundings, embedded=embedded):
                for step in self._open():
                    await self._step(step, surroundings)
                measured = {"latency": await self._latency()}
            why = ""
        except (HopError, SystemExit) as error:
            why = str(error)
        finally:
            self._finish(measured, why)

    def _open(self) -> list[Step]:
        steps = self.notebook.steps_left()
        left = round(sum(one.seconds + _STARTS_S for one in steps))
        place = self.notebook.directory
        print(f"{len(steps)} runs to go, about {left} s: {place}", flush=True)
        return steps

    @contextlib.asynccontextmanager
    async def _stack(
        self, environment: Mapping[str, str], *, embedded: bool
    ) -> AsyncIterator[None]:
        # As in a demo no link is printed: nobody signs in here.
        parts = [["fiware"], ["serve", "--demo"]] if embedded else [["serve", "--demo"]]
        running: list[asyncio.subprocess.Process] = []
        try:
            for words in parts:
                running.append(await start_part(words, environment))
                await wait_ready(words[0], running[-1])
            yield
        finally:
            await stop_parts([*reversed(running)])

    async def _step(self, step: Step, environment: Mapping[str, str]) -> None:
        print(f"{step.name}: {step.seconds:.0f} s", flush=True)
        truth = self.notebook.directory / f"{step.name}.truth.jsonl"
        words = ["emulator", "--scenario", step.family, "--seed", str(step.seed)]
        words += ["--profile", self.profile, "--truth", str(truth)]
        since = format_stamp(clock.now().wall)
        robots = await start_part(words, environment)
        try:
            await wait_ready("emulator", robots)
            completed = await self._until_live()
            watched = await watch(
                self._url, self.settings.api_token, step.seconds, "AGII"
            )
            completed = completed and await self._are_live() and bool(watched.pictures)
            # Nobody lets a stopped robot go here, so that is the last thing asked.
            stops = await self._stop() if self.notebook.is_last(step) else []
        finally:
            await stop_parts([robots])
        real = read_truth(truth)
        truth.unlink()
        tallies, compared = tally(real, watched.pictures)
        decisions = (await self._ask(f"decisions?since={since}&limit=500"))["items"]
        outcome = outcome_of(
            step,
            tallies,
            pictures=compared,
            completed=completed,
            slowdowns=slowdowns_of(decisions),
            injection=injections(real, watched.beliefs, "AGII"),
            stops=stops,
        )
        self.notebook.keep(step, outcome)

    async def _until_live(self) -> bool:
        deadline = clock.now().mono + _LIVE_WITHIN_S
        while not await self._are_live():
            if clock.now().mono > deadline:
                return False
            await asyncio.sleep(0.5)
        return True

    async def _are_live(self) -> bool:
        robots = (await self._ask("robots"))["items"]
        return bool(robots) and all(one["link"] == "LIVE" for one in robots)

    async def _latency(self) -> dict[str, Any]:
        """What every message took since this iVeg has been running."""
        told = await self._ask("latency?window=24h")
        return {name: told[name] for name in ("rows", "figures", "clocks")}

    async def _stop(self) -> Any:
        """Stop the fleet, and how long that took each robot (ms)."""
        await self._ask("fleet/stop", "POST")
        await asyncio.sleep(_STOPS_WITHIN_S)
        return (await self._ask("commands/latency"))["robots"]

    @property
    def _url(self) -> str:
        return f"http://{self.settings.host}:{self.settings.port}"

    async def _ask(self, path: str, method: str = "GET") -> Any:
        """One answer of the API.

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

    def _finish(self, measured: Mapping[str, Any], why: str) -> None:
        report = self.notebook.finish(measured, why)
        self.exit_code = int(bool(why))
        if why:
            told = f"broken off ({why}); the same command goes on with it"
            print(f"iveg: {told}: {self.notebook.directory}", file=sys.stderr)
        print(f"report: {report}", flush=True)
