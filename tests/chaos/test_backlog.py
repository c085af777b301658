"""An agent a minute behind: ages, STOP and release stay true (F49–F51).

The truth is the emulator's own: robots and iVeg run on one machine, so the stamp of the
pose that iVeg shows, set against the clock at the moment of asking, is its true age.
``make chaos`` runs the series of twenty.
"""

import os
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from datetime import datetime
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.chaos.backlog import PROMPT, Backlog, Pace
from tests.chaos.field import Field
from tests.chaos.person import Person
from tests.chaos.witness import Witness
from tests.processes import Site, site, until

TIMES = int(os.environ.get("IVEG_CHAOS_TIMES", "1"))
pytestmark = [pytest.mark.slow, pytest.mark.timeout(120 + 30 * TIMES)]
MINUTE_LATE = Pace(late_s=60.0)
FROZEN = Pace(frozen=True)
TOLERANCE_S = 0.2
RELEASE_WITHIN_S = 5.0


class Stack:
    """iVeg, two robots that nobody stands before, and an agent behind a backlog."""

    def __init__(self, place: Site, backlog: Backlog, witness: Witness) -> None:
        self.place = place
        self.backlog = backlog
        self.witness = witness
        self.person = Person(place, witness)


@contextmanager
def stack_in(folder: Path, **settings: str) -> Iterator[Stack]:
    with ExitStack() as ends:
        place = ends.enter_context(site(folder, **settings))
        field = Field(place, "--held", "--scenario", "peers")
        ends.callback(field.close)
        field.bridged = False
        field.start("broker")
        backlog = ends.enter_context(Backlog(field.port, field.south))
        field.start("fiware")
        field.start("serve")
        field.start("emulator")
        place.wait_until_live()
        witness = ends.enter_context(Witness(field.port))
        stack = Stack(place, backlog, witness)
        ends.callback(stack.person.close)
        yield stack


@pytest.fixture(scope="module")
def stock(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """As it comes: telemetry is read straight from the broker, too."""
    with stack_in(tmp_path_factory.mktemp("stock")) as found:
        yield found


@pytest.fixture(scope="module")
def fiware_only(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """Nothing reaches iVeg but through the agent."""
    folder = tmp_path_factory.mktemp("fiware-only")
    with stack_in(folder, IVEG_DIRECT_READ="off") as found:
        yield found


@pytest.fixture(scope="module")
def odometry_late(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """Reports come straight from the robots, odometry through the agent alone."""
    folder = tmp_path_factory.mktemp("odometry-late")
    with stack_in(folder, IVEG_DIRECT_READ="safety") as found:
        yield found


class Auditor:
    """Asks all the time what iVeg shows, and keeps what is not so.

    Attributes:
        looks: Robots looked at; ``wrong`` what was untrue, as sentences.
        oldest_s: The truly oldest pose that was shown.
    """

    def __init__(self, place: Site) -> None:
        self.looks = 0
        self.wrong: list[str] = []
        self.oldest_s = 0.0
        self._place = place
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="auditor")

    def __enter__(self) -> "Auditor":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        self._thread.join(10)

    def _run(self) -> None:
        with self._place.api() as api:
            while not self._ending.wait(0.1):
                self._look(api)

    def _look(self, api: httpx.Client) -> None:
        asked_at = time.time()
        for robot in api.get("robots").json()["items"]:
            if robot["stamp"] is not None:
                self.looks += 1
                self._judge(robot, asked_at)

    def _judge(self, robot: dict[str, Any], asked_at: float) -> None:
        true_s = asked_at - datetime.fromisoformat(robot["stamp"]).timestamp()
        self.oldest_s = max(self.oldest_s, true_s)
        told = f"{robot['robot_id']}: truly {true_s:.2f} s old, shown as {robot}"
        factor = robot["speed_limit"]["speed_factor"]
        if robot["age_s"] < true_s - TOLERANCE_S:
            self.wrong.append(f"too young: {told}")
        if true_s > 3.0 + TOLERANCE_S and robot["link"] == "LIVE":
            self.wrong.append(f"LIVE: {told}")
        if true_s > 1.0 + TOLERANCE_S and factor > 0.5:
            self.wrong.append(f"clear: {told}")


def moved(place: Site) -> list[str]:
    """STOPs that iVeg made because it took a robot that stands for one that moves."""
    with place.api() as api:
        listed = api.get("commands", params={"limit": 200}).json()["items"]
    return [one["command_id"] for one in listed if one["reason"] == "moved"]


def let_go_within(stack: Stack, robot_id: str) -> float:
    """Release; how long until the robot reports that nothing holds it (s)."""
    robot, began = stack.witness.of(robot_id), time.monotonic()

    def released() -> bool:
        stack.person.release(robot_id)
        return not robot.held

    until(released, "the robot is released")
    return time.monotonic() - began


def test_f49_a_minute_behind_the_agent_every_robot_is_stopped_and_released(
    stock: Stack,
) -> None:
    stock.person.let_go("AGI")
    stock.backlog.pace = MINUTE_LATE
    stopped = released = 0
    slowest = 0.0
    with Auditor(stock.place) as auditor:
        for _ in range(TIMES):
            assert stock.person.press("AGI")
            stock.person.wait_for("AGI", "STANDING")
            stopped += 1
            slowest = max(slowest, let_go_within(stock, "AGI"))
            released += 1
            stock.person.let_go("AGI")
    stock.backlog.pace = PROMPT

    assert stock.backlog.waiting > 0
    assert (stopped, released) == (TIMES, TIMES)
    assert slowest <= RELEASE_WITHIN_S
    assert auditor.looks > 10
    assert auditor.wrong == []
    assert moved(stock.place) == []
    assert stock.witness.unlicensed == 0


def test_f50_poses_that_are_seconds_old_are_never_called_live(
    fiware_only: Stack,
) -> None:
    robot = fiware_only.witness.of("AGI")
    fiware_only.person.let_go("AGI")

    with Auditor(fiware_only.place) as auditor:
        fiware_only.backlog.pace = Pace(late_s=6.0)
        until(lambda: robot.speed == 0.0, "the robot stands by itself")
        until(lambda: auditor.oldest_s > 6.0, "a pose of 6 s is shown")
        known = auditor.looks
        until(lambda: auditor.looks > known + 20, "it is looked at")

    assert auditor.wrong == []
    fiware_only.backlog.pace = PROMPT
    fiware_only.place.wait_until_live()


def test_f51_late_odometry_stops_no_robot_that_stands(odometry_late: Stack) -> None:
    person, backlog = odometry_late.person, odometry_late.backlog
    for _ in range(TIMES):
        person.let_go("AGI")
        backlog.pace = Pace(late_s=4.0)
        until(lambda: person.press("AGI"), "STOP is accepted")
        person.wait_for("AGI", "STANDING")
        backlog.pace = FROZEN
        until(lambda: backlog.waiting > 300, "messages wait")
        backlog.pace = PROMPT
        until(lambda: backlog.waiting < 30, "all have arrived")
        person.wait_for("AGI", "STANDING")

    assert moved(odometry_late.place) == []
    assert odometry_late.witness.unlicensed == 0
