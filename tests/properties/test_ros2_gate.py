"""The gate on DDS is never faster than the safety node allows, whatever happens to it.

The machine on its bench (``tests/unit/robot/rig.py``), with the very bytes of
``cmd_vel_nav`` before it and those of ``cmd_vel`` behind it, and a base with a time-out
at the end.
"""

import math
from dataclasses import dataclass, field

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.feedback import SpeedLimit
from iveg.domain.geometry import REST, Twist2D
from iveg.lab.emulator.ros2_base import TIMEOUT_S, DriveWatchdog
from iveg.robot.gate import RAMP_M_S2, RAMP_RAD_S2, Cap
from iveg.robot.ros2.config import DriveConfig, RobotConfig
from iveg.robot.ros2.outputs import DriveTopics
from iveg.robot.ros2.reading import InputFaults, read_twist
from iveg.robot.safety import Drive as Told
from iveg.ros2 import cdr
from iveg.ros2 import messages as ros
from tests.unit.robot.rig import STEP_S, Rig, person, release, resume, stop

WALL = 1_700_000_000.0
MOST_M_S, MOST_RAD_S = 1.0, 1.0
LONGEST_STEP_S = 0.1

speed = st.one_of(
    st.floats(-2.0, 2.0),
    st.sampled_from([0.0, math.nan, math.inf, -math.inf, 1e300, 25.0, 1e-300]),
)
event = st.one_of(
    st.tuples(st.just("wish"), speed, speed, st.sampled_from([0.0, -0.3, -3600.0])),
    st.tuples(st.just("junk"), st.binary(max_size=60)),
    st.tuples(st.just("wait"), st.integers(1, 30)),
    st.tuples(st.just("stop"), st.integers(0, 3)),
    st.tuples(st.just("let_go")),
    st.tuples(st.just("speed_limit"), st.sampled_from([0.0, 0.3, 0.5, 1.0])),
    st.tuples(st.just("person"), st.floats(0.0, 5.0)),
    st.tuples(st.just("speaks"), st.booleans()),
    st.tuples(st.just("odometry"), st.booleans()),
    st.tuples(st.just("unplaced")),
    st.tuples(st.just("limit"), st.sampled_from([0.0, 0.5, 1.0])),
    st.tuples(st.just("kill")),
    st.tuples(st.just("start")),
)


@dataclass
class Gate:
    """One gate between two topics, and the base behind it."""

    rig: Rig = field(default_factory=Rig)
    base: DriveWatchdog = field(default_factory=DriveWatchdog)
    runs: bool = True
    wished: Twist2D = REST
    wished_at: float = -math.inf
    last: Twist2D = REST
    last_at: float = -math.inf
    stops: int = 0

    def __post_init__(self) -> None:
        drive = DriveConfig(stamped_in=True, stamped_out=True)
        self.topics = DriveTopics(RobotConfig(drive=drive), InputFaults())
        self.seen = 0

    def happen(self, kind: str, *rest: object) -> None:
        getattr(self, f"on_{kind}")(*rest)
        self.check()

    # --- what happens -------------------------------------------------------------

    def on_wish(self, forward: float, turn: float, back_s: float) -> None:
        twist = ros.Twist(ros.Vector3(forward), ros.Vector3(z=turn))
        stamp = ros.Time.from_seconds(WALL + self.rig.now + back_s)
        self.on_junk(cdr.write(ros.TwistStamped(ros.Header(stamp), twist)))

    def on_junk(self, payload: bytes) -> None:
        if not self.runs:
            return
        wish = self.topics.read(payload, self.rig.now)
        if wish is not None:
            self.wished, self.wished_at = wish, self.rig.now
            self.rig.perform(self.rig.machine.request_twist(wish, self.rig.now))

    def on_wait(self, steps: int) -> None:
        for _ in range(steps):
            if self.runs:
                self.rig.step()
            else:
                self.rig.now = round(self.rig.now + STEP_S, 6)
            self.check()

    def on_stop(self, number: int) -> None:
        self.rig.command(stop(f"01STOP{number}"))

    def on_let_go(self) -> None:
        ids = [hold.id for hold in self.rig.holds if hold.ack == "remote"]
        if ids:
            self.rig.command(release(ids, self.rig.machine.challenge))
        self.rig.command(resume(self.rig.machine.challenge))

    def on_speed_limit(self, factor: float) -> None:
        self.rig.speed_limits = {"AGI": SpeedLimit(factor, "person")}

    def on_person(self, x: float) -> None:
        self.rig.alerts = (person(x),)

    def on_speaks(self, speaks: bool) -> None:
        self.rig.speaks = speaks

    def on_odometry(self, comes: bool) -> None:
        self.rig.odometry = comes

    def on_unplaced(self) -> None:
        rig = self.rig
        rig.perform(rig.machine.odometry(None, rig.speed, rig.now))

    def on_limit(self, factor: float) -> None:
        self.rig.machine.limit(Cap(factor, "stale", "test"))

    def on_kill(self) -> None:
        self.runs = False

    def on_start(self) -> None:
        """After a kill a new process boots, held, with what was on disk."""
        if not self.runs:
            self.runs, self.wished, self.last = True, REST, REST
            self.rig.boot += "x"
            self.rig.machine = self.rig.start()

    # --- what must hold -----------------------------------------------------------

    def check(self) -> None:
        told = self.rig.log[self.seen :]
        self.seen = len(self.rig.log)
        for at, effect in told:
            if isinstance(effect, Told) and self.runs:
                self.deliver(at, self.topics.write(effect.twist, WALL + at))
        machine = self.rig.machine
        if self.runs and (machine.holds.holds or machine.cap.factor == 0.0):
            assert self.last == REST
        silent = self.rig.now - self.last_at
        if silent > TIMEOUT_S:
            assert self.base.command(self.rig.now) == REST

    def deliver(self, at: float, payload: bytes) -> None:
        """What arrives at the base, held against what the node allows."""
        twist = read_twist(cdr.read(ros.TwistStamped, payload).twist)
        cap = self.rig.machine.cap.factor
        lived = at - self.wished_at <= 0.5
        wish = self.wished if lived else REST
        step = min(LONGEST_STEP_S, max(0.0, at - self.last_at))
        most = min(abs(wish.linear_x), MOST_M_S)
        if at == self.rig.now:
            most = min(most, MOST_M_S * cap, abs(wish.linear_x) * cap)
        assert abs(twist.linear_x) <= most + 1e-9
        assert abs(twist.linear_x) <= abs(self.last.linear_x) + RAMP_M_S2 * step + 1e-9
        assert abs(twist.angular_z) <= MOST_RAD_S * max(cap, 0.0) + 1e-9
        assert (
            abs(twist.angular_z) <= abs(self.last.angular_z) + RAMP_RAD_S2 * step + 1e-9
        )
        self.last, self.last_at = twist, at
        self.base.replace_command(twist, at)


@given(st.lists(event, min_size=5, max_size=60))
def test_the_gate_is_never_faster_than_the_safety_node_allows(
    events: list[tuple[object, ...]],
) -> None:
    gate = Gate()

    for kind, *rest in events:
        gate.happen(str(kind), *rest)


def test_the_same_gate_does_let_a_robot_drive() -> None:
    """The property above is not held by a gate that is shut."""
    gate = Gate()
    for _ in range(20):
        gate.happen("wish", 0.0, 0.0, 0.0)
        gate.happen("wait", 1)
    gate.happen("let_go")
    for speed_ in [0.0] * 20 + [0.8] * 60:
        gate.happen("wish", speed_, 0.0, 0.0)
        gate.happen("wait", 1)

    assert gate.last.linear_x == pytest.approx(0.8)
    gate.happen("kill")
    gate.happen("wait", 12)
    assert gate.base.command(gate.rig.now) == REST
