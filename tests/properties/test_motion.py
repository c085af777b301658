"""STANDING and "slow" bound how far a robot goes, whatever one of its fields says.

Random robots: what they do, what their twist and reports say of it, how noisy their
poses are, how often they come and which are lost.
"""

from dataclasses import dataclass
from random import Random

from hypothesis import example, given
from hypothesis import strategies as st

from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.motion import MotionTrack
from iveg.domain.observations import Hold, Odometry, Origin
from iveg.domain.stop import Changed
from tests.builders import at
from tests.unit.domain.bench import Bench

JITTER_M = 0.03
STEP_S = 0.05


Streams = st.SearchStrategy["Stream"]


@dataclass(frozen=True)
class Stream:
    """One robot's messages: how they come and what they say."""

    hz: int
    says: float
    jitter_m: float
    loss: float
    seed: int


def streams_of(hz: list[int], jitter_m: list[float], loss: float) -> Streams:
    """Streams of one of these paces and noises."""
    return st.builds(
        Stream,
        hz=st.sampled_from(hz),
        says=st.sampled_from([0.0, 0.01]),
        jitter_m=st.sampled_from(jitter_m),
        loss=st.just(loss),
        seed=st.integers(0, 10_000),
    )


# Two a second come through Orion, of which none is lost but all are late.
streams = (
    streams_of([4, 5, 10, 20], [0.0, 0.001, JITTER_M], 0.0)
    | streams_of([10, 20], [0.0, 0.001], 0.2)
    | streams_of([2], [0.0, 0.001], 0.0)
)


class Held:
    """A robot under STOP that reports rest, and the machine that believes or not."""

    def __init__(self, stream: Stream) -> None:
        self.stream, self.rnd = stream, Random(stream.seed)  # noqa: S311
        self.bench, self.track = Bench(), MotionTrack()
        self.x, self.jumped_m, self.seq = 0.0, 0.0, 0
        self.bench.press()
        self.doubted = False

    def step(self, number: int, speed: float) -> None:
        """A twentieth of a second in which it goes on at this speed."""
        self.x += speed * STEP_S
        self.bench.now = round(number * STEP_S, 3)
        if number % 2 == 0:
            hold = Hold(self.bench.machine.hold_id or "", "iveg", "remote")
            self.bench.report(hold, linear=self.stream.says)
        if number % round(1 / self.stream.hz / STEP_S) == 0:
            self._place()
        self.bench.tick()

    def _place(self) -> None:
        self.seq += 1
        if self.rnd.random() < self.stream.loss:
            return
        noise = self.stream.jitter_m
        pose = Pose2D(
            self.x + self.jumped_m + self.rnd.uniform(-noise, noise),
            self.rnd.uniform(-noise, noise),
            self.rnd.uniform(-noise, noise) / 2,
        )
        now = self.bench.now
        origin = Origin("b1", self.seq, mono=now)
        said = Odometry("AGI", origin, pose, Twist2D(self.stream.says, 0.0))
        motion = self.track.note_odometry(pose, said.twist, now, origin)
        self.doubted |= motion.contradiction is not None
        machine, new_id = self.bench.machine, self.bench.new_id()
        self.bench.keep(machine.odometry(said, at(now), new_id, 0.0, motion))


@given(streams, st.floats(0.2, 1.5))
def test_a_robot_whose_pose_goes_on_is_not_standing_for_longer_than_seconds(
    stream: Stream, speed: float
) -> None:
    held, stood_m = Held(stream), 0.0

    for number in range(160):
        held.step(number, speed)
        stood_m += speed * STEP_S * (held.bench.state == "STANDING")

    # It reports rest all the time: a second of that is a standstill without poses.
    assert stood_m <= 0.3
    assert held.bench.state != "STANDING"


@given(streams, st.floats(0.2, 1.5))
# Its steps look like jumps and noise now and then.
@example(Stream(hz=5, says=0.0, jitter_m=JITTER_M, loss=0.0, seed=1846), 0.25)
def test_a_standstill_ends_within_two_seconds_of_a_pose_that_goes_on_and_for_good(
    stream: Stream, speed: float
) -> None:
    held = Held(stream)
    for number in range(80):
        held.step(number, 0.0)
    assert held.bench.state == "STANDING"

    for number in range(80, 240):
        held.step(number, speed)
        if number >= 80 + (40 if stream.hz > 2 else 60):
            assert held.bench.state != "STANDING"


@given(streams, st.lists(st.floats(0.2, 3.0), min_size=3, max_size=3))
def test_a_robot_at_rest_with_jitter_and_jumps_stands_and_raises_no_p1(
    stream: Stream, jumps: list[float]
) -> None:
    held = Held(stream)

    for number in range(400):
        if number % 120 == 100:
            held.jumped_m += jumps[number // 120]
        held.step(number, 0.0)

    keys = [one.key for one in held.bench.log if isinstance(one, Changed)]
    assert held.bench.state == "STANDING"
    assert not {"moved", "still_moving"} & set(keys)


@given(
    st.lists(
        st.tuples(st.floats(0.0, 1.2), st.floats(0.0, 1.2), st.floats(0.0, 1.2)),
        min_size=4,
        max_size=8,
    ),
    st.sampled_from([2, 5, 10, 30]),
)
def test_slow_bounds_the_way_of_the_last_second(
    legs: list[tuple[float, float, float]], hz: int
) -> None:
    """Pose, twist and report change as they like; the largest bounds each of them."""
    track, x, ways = MotionTrack(), 0.0, list[tuple[float, float]]()
    for number in range(len(legs) * 2 * hz):
        speed, twist, report = legs[number // (2 * hz)]
        t = number / hz
        x += speed / hz
        ways.append((t, x))
        motion = track.note_odometry(Pose2D(x, 0.0, 0.0), Twist2D(twist, 0.0), t)
        motion = track.note_report(report, 0.0, t)
        if number % (2 * hz) > 1.5 * hz:
            before = next(way for when, way in ways if when >= t - 1.0)
            assert motion.speed >= max(twist, report)
            assert motion.speed >= x - before - 0.11
