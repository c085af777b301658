"""Two scenarios through the whole running stack: what they promise is seen in iVeg.

All are played on the virtual clock in ``tests/unit/lab/emulator/test_scenarios.py``.
These two prove that real processes behave as it says: one is about what is told, the
other about silence.  The world moves in real time, so each test waits for facts with a
deadline and says nothing of the moment at which they come.  Both run at a time, each
with a stack of its own.
"""

import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import httpx
import pytest

from tests.processes import EMULATOR, Site, site, until

pytestmark = pytest.mark.slow
Row = dict[str, Any]
T = TypeVar("T")
Plays = dict[str, dict[str, str]]
"""Scenarios, each with the settings of its stack."""
SILENCE_S = 5.0
"""How long nobody hears AGII in ``link-loss``."""
CRUISE = 0.8
"""Of AGI and AGII where nobody slows them (m/s)."""
"""Nothing here takes longer, on a machine that has other things to do."""


@dataclass
class Stage:
    """One scenario that runs, as a program sees it through the API."""

    api: httpx.Client
    place: Site

    def rows(self, what: str, **asked: str) -> list[Row]:
        """One list of the API, newest first."""
        answer = self.api.get(what, params=asked)
        answer.raise_for_status()
        return list(answer.json()["items"])

    def robot(self, robot_id: str) -> Row:
        return dict(self.api.get(f"robots/{robot_id}").raise_for_status().json())

    def speed(self, robot_id: str) -> float:
        """What its odometry says (m/s), whichever way it drives."""
        return abs(float(self.robot(robot_id)["twist"]["linear"]))

    def decisions(self, robot_id: str, reason: str) -> list[Row]:
        """What slowed a robot, oldest first."""
        found = self.rows("decisions", robot=robot_id)
        return [one for one in reversed(found) if one["reason"] == reason]

    def log(self, robot_id: str, key: str) -> list[Row]:
        """Lines about a robot whose key begins so, oldest first."""
        found = self.rows("log", robot=robot_id)
        return [one for one in reversed(found) if one["key"].startswith(key)]

    def wait(self, probe: Callable[[], T | None], what: str) -> T:
        """Until something is there: not None, not empty, not false."""
        return until(lambda: probe() or None, what)

    def first(self, found: Callable[[], Sequence[Row]], what: str) -> Row:
        """The first row of a list that is empty for a while."""
        return self.wait(found, what)[0]


@pytest.fixture(scope="class")
def stages(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[dict[str, Stage]]:
    """The scenarios that a class of tests names, running side by side."""
    with ExitStack() as stack:
        running = {
            name: stack.enter_context(staged(tmp_path_factory.mktemp(name), settings))
            for name, settings in request.cls.plays.items()
        }
        start_together(running)
        yield running
        for stage in running.values():
            stage.place.assert_clean()
        for stage in running.values():
            for program in stage.place.programs:
                program.process.send_signal(signal.SIGINT)


@contextmanager
def staged(folder: Path, settings: Mapping[str, str]) -> Iterator[Stage]:
    """A place where nothing runs yet."""
    with site(folder, **settings) as place, closing(place.api()) as api:
        yield Stage(api, place)


def start_together(running: Mapping[str, Stage]) -> None:
    """FIWARE, then the dashboard, then the robots, each for all scenarios at once."""
    for program in [stage.place.start("fiware") for stage in running.values()]:
        program.wait_until_ready()
    for stage in running.values():
        stage.place.start("serve")
    for stage in running.values():
        stage.place.wait_until_served()
    for name, stage in running.items():
        words = ("--scenario", name, "--seed", "3", "--profile", "perfect")
        stage.place.start(*EMULATOR, *words)
    for name, stage in running.items():
        stage.wait(partial(everybody_live, stage), f"{name} is on stage")


def everybody_live(stage: Stage) -> bool:
    fleet = stage.api.get("robots").json()["items"]
    return all(one["link"] == "LIVE" for one in fleet)


class TestOutOfSightInRealTime:
    plays: ClassVar[Plays] = {"nlos": {}}

    def test_agii_slows_for_a_person_whom_only_agi_sees(
        self, stages: dict[str, Stage]
    ) -> None:
        stage = stages["nlos"]
        decision = stage.first(
            lambda: [d for d in stage.decisions("AGII", "person") if d["applied_at"]],
            "AGII says that it slows for a person",
        )
        line = stage.first(
            lambda: stage.log("AGII", "log.speed_down.person"), "the log says so"
        )
        stage.wait(
            lambda: 0.0 < stage.speed("AGII") <= 0.55 * CRUISE, "its odometry shows it"
        )
        assert (decision["observer"], decision["in_sight"]) == ("AGI", False)
        assert line["key"] == "log.speed_down.person_nlos"
        assert (line["slots"]["observer"], line["slots"]["in_sight"]) == ("AGI", False)


# A class of its own: a state that lasts two seconds is looked for while it does.
class TestLinkLossInRealTime:
    plays: ClassVar[Plays] = {"link-loss": {}}

    def test_a_robot_that_is_not_heard_is_late_then_lost_and_has_stopped_itself(
        self, stages: dict[str, Stage]
    ) -> None:
        stage = stages["link-loss"]

        def linked(state: str) -> Row:
            def found() -> Row | None:
                robot = stage.robot("AGII")
                return robot if robot["link"] == state else None

            return stage.wait(found, f"AGII is {state}")

        linked("LATE")
        # As it was heard last: on a busy machine it may have been late before.
        before = linked("LOST")
        stage.wait(lambda: stage.log("AGII", "log.alert.raised"), "an alert says so")
        back = linked("LIVE")

        held = stage.wait(
            lambda: [hold["source"] for hold in stage.robot("AGII")["holds"]],
            "AGII says what holds it",
        )
        driven = abs(before["pose"]["y"] - back["pose"]["y"])
        assert held == ["link"]
        assert abs(back["twist"]["linear"]) < 0.02
        assert driven < 0.6 * before["twist"]["linear"] * SILENCE_S

        stage.wait(lambda: not stage.robot("AGII")["holds"], "its hold goes by itself")
        stage.wait(lambda: stage.speed("AGII") > 0.2, "it drives on")
