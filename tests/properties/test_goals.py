"""A goal lifts no hold, raises no factor, and is gone after any hold."""

import asyncio
import contextlib
import itertools
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from hypothesis import example, given, settings
from hypothesis import strategies as st

from iveg.adapters.mqtt import BrokerAddress
from iveg.domain.errors import CommandRefusedError
from iveg.domain.feedback import CLEAR, Feedback, SpeedLimit
from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.goals import CancelOrder, Goal, GoalKind, GoalOrder, GoalWish
from iveg.domain.observations import (
    GoalAnswer,
    Hold,
    Instant,
    Observation,
    Odometry,
    Origin,
)
from iveg.ngsi import codec, names
from iveg.robot.node import NodeSettings, RobotNode
from tests.builders import odometry, safety_report
from tests.unit.robot.rig import AHEAD, REST, release, resume, stop
from tests.unit.vital.desk import Desk, settle

STEP_S = 0.05
COMMANDS = names.command_topic("iveg", "AGI")


@dataclass
class Robot:
    """A whole node on a clock that is moved by hand, without a broker.

    Args:
        folder: Nothing is written there: the node does not run.
        deaf: Goals do not reach it; all else does.
    """

    folder: Path
    deaf: bool = False
    now: float = 100.0
    told: list[Goal | None] = field(default_factory=list)
    driven: list[tuple[float, Twist2D]] = field(default_factory=list)
    limited: float = 1.0
    wished: Twist2D = REST

    def __post_init__(self) -> None:
        self._names, self._seqs = itertools.count(1), itertools.count(1)
        self._orders: list[bytes] = []
        self.node = RobotNode(
            "AGI",
            NodeSettings(
                address=BrokerAddress("127.0.0.1", 1),
                apikey="iveg",
                directory=self.folder,
                read_clock=lambda: Instant(self.now, self.now),
            ),
            profile=RobotProfile(),
            drive=lambda twist: self.driven.append((round(self.now, 3), twist)),
            navigate=self._navigate,
        )

    def _navigate(self, goal: Goal | None) -> bool:
        self.told.append(goal)
        return True

    def run(self, seconds: float) -> None:
        """Odometry, feedback and wishes twenty times a second."""
        for _ in range(round(seconds / STEP_S)):
            self.now = round(self.now + STEP_S, 6)
            twist = self.driven[-1][1] if self.driven else REST
            self.node.sense(Odometry("", Origin(), Pose2D(0.0, 0.0, 0.0), twist))
            limits = {"AGI": SpeedLimit(self.limited, "person")}
            seq = next(self._seqs)
            feedback = Feedback("AGII", Origin("cloud", seq), speed_limits=limits)
            if self.limited == 1.0:
                feedback = replace(feedback, speed_limits={"AGI": CLEAR})
            self.hear("/AGII/mqtt_feedback", codec.write_feedback(feedback))
            self.node.request_twist(self.wished)

    def hear(self, topic: str, payload: bytes) -> None:
        self.node._on_message(topic, payload)

    # --- events -------------------------------------------------------------------

    def drive(self) -> None:
        """Released and resumed by whoever may, at full speed."""
        self.wished = REST
        self.run(1.0)
        held = [one.id for one in self.node.machine.holds.holds]
        machine = self.node.machine
        if held:
            self.hear(COMMANDS, release(held, machine.challenge))
        self.hear(COMMANDS, resume(machine.challenge))
        self.run(1.0)
        self.wished = AHEAD
        self.run(1.0)

    def stop(self) -> None:
        self.hear(COMMANDS, stop(f"01S{next(self._names)}"))

    def button(self) -> None:
        self.node.add_local_hold("hw")
        self.run(0.1)
        self.node.release_locally()

    def limit(self) -> None:
        self.limited = 0.5 if self.limited == 1.0 else 1.0
        self.run(0.2)

    def silence(self) -> None:
        """Nobody speaks until the hold ``link``."""
        for _ in range(80):
            self.now = round(self.now + STEP_S, 6)
            self.node.request_twist(self.wished)

    def send(self, kind: GoalKind = "here", late_s: float = 0.0) -> None:
        machine = self.node.machine
        name, until_s = f"01G{next(self._names)}", self.now - 100.0 + 10.0 - late_s
        order = GoalOrder(name, kind, 5.0, 0.0, machine.challenge, until_s)
        self._orders.append(codec.write_command(order))
        self._deliver(self._orders[-1])

    def again(self) -> None:
        """A late copy of the first goal."""
        for payload in self._orders[:1]:
            self._deliver(payload)

    def cancel(self) -> None:
        goal = self.node.goals.goal
        order = CancelOrder("01G0" if goal is None else goal.goal_id)
        self._deliver(codec.write_command(order))

    def _deliver(self, payload: bytes) -> None:
        if not self.deaf:
            self.hear(COMMANDS, payload)


EVENTS: dict[str, Callable[[Robot], None]] = {
    "run": lambda robot: robot.run(0.3),
    "drive": Robot.drive,
    "stop": Robot.stop,
    "button": Robot.button,
    "limit": Robot.limit,
    "silence": Robot.silence,
    "send": Robot.send,
    "pause": lambda robot: robot.send("pause"),
    "too late": lambda robot: robot.send(late_s=11.0),
    "again": Robot.again,
    "cancel": Robot.cancel,
}
LISTS = st.lists(st.sampled_from(sorted(EVENTS)), max_size=8)
HELD = ["drive", "send", "run", "stop", "run", "drive", "again", "run"]


@settings(max_examples=25)
@example(HELD)
@example(["drive", "send", "silence", "run", "run", "drive", "again"])
@example(["drive", "send", "button", "run", "drive", "run"])
@given(LISTS)
def test_a_goal_is_gone_after_any_hold_and_no_copy_brings_it_back(
    events: list[str],
) -> None:
    with TemporaryDirectory() as folder:
        robot, before = Robot(Path(folder)), None
        for name in ["drive", *events]:
            had, told = robot.node.goals.goal, len(robot.told)
            EVENTS[name](robot)
            goal = robot.node.goals.goal
            assert goal is None or robot.node.machine.state(robot.now) == "RUNNING"
            if name in ("stop", "button", "silence"):
                assert goal is None
                # Navigation has been told, unless there was nothing to give up.
                assert had is None or robot.told[told:] == [None]
            if goal is not None and goal != had:
                assert name in ("send", "pause")
            before = goal
        assert before == robot.node.goals.goal


@settings(max_examples=20)
@example(HELD)
@example(["drive", "limit", "send", "run", "pause", "cancel", "run"])
@given(LISTS)
def test_with_goals_the_drive_is_told_what_it_is_told_without(
    events: list[str],
) -> None:
    with TemporaryDirectory() as folder:
        robots = [Robot(Path(folder)), Robot(Path(folder), deaf=True)]
        for name in ["drive", *events]:
            for robot in robots:
                EVENTS[name](robot)
            one, other = robots
            told, untold = one.node.machine, other.node.machine
            assert told.state(one.now) == untold.state(other.now)
            assert told.cap.factor == untold.cap.factor
            assert len(told.holds.holds) == len(untold.holds.holds)
        spoken = [[one for _, one in _changes(robot)] for robot in robots]
        assert spoken[0] == spoken[1]


def _changes(robot: Robot) -> list[tuple[float, Twist2D]]:
    """What the drive was told, repetitions left out."""
    pairs = itertools.groupby(robot.driven, key=lambda one: one[1])
    return [next(group) for _, group in pairs]


# --- the server -------------------------------------------------------------------

SAID = ("ACCEPTED", "REFUSED", "REACHED", "DROPPED")
ACTS = st.lists(
    st.sampled_from(["give", "cancel", "stop", "held", "free", "wait", *SAID]),
    max_size=12,
)


async def _act(desk: Desk, name: str, goals: bool) -> None:
    """One event at a desk; without ``goals`` nobody gives or answers any."""
    dispatcher, now = desk.parts.goals, desk.clock()
    origin = replace(desk.next_origin(), mono=desk.clock.now)
    said: list[Observation] = []
    if name == "stop":
        await desk.commander.stop(["AGI"], "ben", now)
    elif name in ("held", "free"):
        holds = [Hold("hw-1", "hw", "local")] if name == "held" else []
        factor, reason = (0.0, "hold") if holds else (1.0, "clear")
        report = safety_report(
            "AGI", *holds, speed_factor=factor, reason=reason, origin=origin
        )
        said = [odometry("AGI", linear=0.0, origin=origin), report]
    elif goals and name == "give":
        with contextlib.suppress(CommandRefusedError):
            dispatcher.give("AGI", GoalWish("here", 5.0, 6.0), "ana", now)
    elif goals and name == "cancel":
        with contextlib.suppress(CommandRefusedError):
            dispatcher.cancel("AGI", "ana", now)
    elif goals and name in SAID:
        newest = dispatcher.newest("AGI", now)
        if newest is not None:
            said = [GoalAnswer("AGI", origin, newest.goal.goal_id, name)]
    for one in said:
        desk.hear(one)
    await desk.wait(0.1)


async def _played(acts: list[str], *, goals: bool) -> list[object]:
    """What STOP and the rule say after each event; goals are judged on the way."""
    desk, seen = Desk(), []
    for name in ["free", *acts]:
        await _act(desk, name, goals)
        machine, report = desk.commander.machine("AGI"), desk.world.robot("AGI").safety
        goal = desk.parts.goals.newest("AGI", desk.clock())
        if machine.state != "RUNNING" or (report is not None and report.holds):
            assert goal is None or not goal.is_open
        seen.append((machine.state, desk.evaluator.speed_limits["AGI"].speed_factor))
    await settle()
    return [*seen, len(desk.fleet.stops), desk.fleet.asked]


@settings(max_examples=20)
@example(["give", "ACCEPTED", "stop", "ACCEPTED", "free", "REACHED"])
@example(["give", "held", "free", "ACCEPTED", "give", "cancel"])
@given(ACTS)
def test_on_the_server_a_hold_ends_every_goal_and_stop_and_rule_notice_nothing(
    acts: list[str],
) -> None:
    with_goals = asyncio.run(_played(acts, goals=True))
    without = asyncio.run(_played(acts, goals=False))

    assert with_goals == without
