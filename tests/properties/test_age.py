"""Whatever a network and its clocks do, no old pose is ever called live.

On the virtual clock: a robot that drives and tells, iVeg that sends feedback and
probes, and two transports that delay for minutes, mix, lose and stop.  Wall clocks on
both sides are set by an hour, forth and back.
"""

import heapq
import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import FULL_SPEED
from iveg.domain.geometry import Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant, Odometry, Origin, Received
from iveg.domain.probe import ProbeLag
from iveg.domain.rule.judge import SpeedLimits
from iveg.domain.tracking.people import People
from iveg.domain.transports import DIRECT, FIWARE, TransportId
from iveg.domain.world import World
from tests.builders import START, odometry, origin
from tests.fakes.echo import Echo

STEP_S = 0.1
"""Odometry and feedback are sent that often, and what is shown is looked at."""
PROBE_EVERY = 20
HOUR_S = 3600.0
FIELD = Greenhouse("field", Rectangle(-100, -100, 100, 100))


@dataclass(frozen=True)
class Weather:
    """What a transport does for a while.

    Attributes:
        delay_s: Of each message; ``jitter_s`` more at most, and order is lost with it.
        loss: Share of messages that never arrive.
    """

    delay_s: float = 0.01
    jitter_s: float = 0.0
    loss: float = 0.0


FINE = Weather()
weathers = st.builds(
    Weather,
    delay_s=st.sampled_from([0.001, 0.05, 0.5, 2.0, 12.0, 60.0, 300.0]),
    jitter_s=st.sampled_from([0.0, 0.0, 0.2, 5.0, 60.0]),
    loss=st.sampled_from([0.0, 0.0, 0.3, 1.0]),
)
clock_steps = st.sampled_from([0.0, 0.0, HOUR_S, -HOUR_S, 11.0, -11.0])


@dataclass(frozen=True)
class Phase:
    """A stretch of time: one weather a way, and clocks that are set at its start."""

    seconds: int
    direct: Weather
    fiware: Weather
    down: Weather
    robot_clock: float
    our_clock: float
    reboots: bool = False


phases = st.builds(
    Phase,
    seconds=st.integers(1, 25),
    direct=weathers,
    fiware=weathers,
    down=weathers,
    robot_clock=clock_steps,
    our_clock=clock_steps,
    reboots=st.sampled_from([False, False, False, True]),
)


@dataclass(frozen=True)
class Parcel:
    """What is under way: odometry, or the count of a feedback or a probe."""

    content: Odometry | Origin
    transport: TransportId = FIWARE.id
    is_probe: bool = False


@dataclass
class Rig:
    """One robot, iVeg, and what is under way between them.

    Attributes:
        measured: When each odometry was measured (s), by boot and seq.
    """

    acknowledgements: bool = True
    transports: tuple[TransportId, ...] = (DIRECT.id, FIWARE.id)
    now: float = 0.0
    robot_clock: float = 0.0
    our_clock: float = 0.0
    boot: int = 0
    booted: float = 0.0
    echo: Echo = field(default_factory=Echo)
    measured: dict[tuple[str | None, int | None], float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.probe = ProbeLag()
        self.world = World(["AGI"], self.probe)
        self.robot = self.world.robot("AGI")
        self.speed_limits = SpeedLimits(FIELD)
        self.people = People()
        self._way: list[tuple[float, int, Parcel]] = []
        self._number = itertools.count()
        self._seq = itertools.count(1)
        self._feedback = itertools.count(1)
        self._probes = itertools.count(1)
        self._ticks = 0

    # --- what is sent -------------------------------------------------------------

    def at(self) -> Instant:
        return Instant(START.mono + self.now, START.wall + self.now + self.our_clock)

    def put(self, message: Parcel, weather: Weather, rnd: Random) -> None:
        if rnd.random() >= weather.loss:
            late = weather.delay_s + rnd.uniform(0.0, weather.jitter_s)
            due = self.now + late
            heapq.heappush(self._way, (due, next(self._number), message))

    def tell(self, down: Weather, rnd: Random) -> None:
        seq = next(self._feedback)
        self.world.ledger.composed("iveg", seq, seq, self.at().mono)
        self.put(Parcel(Origin("iveg", seq)), down, rnd)

    def measure(self, phase: Phase, rnd: Random) -> None:
        """Odometry leaves on every transport, with what had been heard by now."""
        seq, boot = next(self._seq), f"boot-{self.boot}"
        wall = START.wall + self.now + self.robot_clock
        said = replace(
            origin(seq, boot=boot, wall=wall),
            mono=self.now - self.booted,
        )
        if self.acknowledgements:
            said = self.echo.on(said, self.now)
        self.measured[boot, seq] = self.now
        for transport in self.transports:
            weather = phase.direct if transport == "direct" else phase.fiware
            self.put(Parcel(odometry(linear=0.0, origin=said), transport), weather, rnd)

    def send_probe(self, fiware: Weather, rnd: Random) -> None:
        one = Origin("iveg", next(self._probes))
        self.probe.sent(one, self.at())
        self.put(Parcel(one, is_probe=True), fiware, rnd)

    def reboot(self) -> None:
        self.boot += 1
        self.booted, self.echo = self.now, Echo()
        self._seq = itertools.count(1)

    # --- what arrives -------------------------------------------------------------

    def arrive(self) -> None:
        while self._way and self._way[0][0] <= self.now:
            _, _, parcel = heapq.heappop(self._way)
            if isinstance(parcel.content, Odometry):
                self.world.apply(Received(parcel.content, self.at(), parcel.transport))
            elif parcel.is_probe:
                self.probe.returned(parcel.content, self.at())
            else:
                self.echo.note(parcel.content, self.now)

    def drive(self, phase: Phase, rnd: Random) -> Iterator[float]:
        """Each moment of a phase at which somebody may look (s)."""
        self.robot_clock += phase.robot_clock
        self.our_clock += phase.our_clock
        if phase.reboots:
            self.reboot()
        for _ in range(round(phase.seconds / STEP_S)):
            self.tell(phase.down, rnd)
            self.measure(phase, rnd)
            if self._ticks % PROBE_EVERY == 0:
                self.send_probe(phase.fiware, rnd)
            self._ticks += 1
            # Looked at twice: as things arrive, and just before the next ones leave.
            for _ in range(2):
                self.now += STEP_S / 2
                self.arrive()
                yield self.now

    # --- what is shown ------------------------------------------------------------

    def true_age(self) -> float | None:
        newest = self.robot.odometry
        if not isinstance(newest, Odometry):
            return None
        return self.now - self.measured[newest.origin.boot, newest.origin.seq]

    def is_clear(self) -> bool:
        """Whether the robot may drive at full speed, with every detector sending."""
        self.robot.detector.note_whole(self.at().mono)
        found, _ = self.speed_limits.evaluate(
            self.world, self.people, DetectionRule(), self.at(), "d"
        )
        return found["AGI"].speed_factor >= FULL_SPEED


def check(rig: Rig) -> None:
    """The promise of a robot that echoes."""
    true, shown = rig.true_age(), rig.robot.age_s(rig.at())
    if true is None:
        return
    assert shown is None or shown >= true - 0.2
    if true > LIMITS.live_s + 0.2:
        assert rig.robot.link(rig.at()) != "LIVE"
        assert not rig.is_clear()


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(st.lists(phases, min_size=1, max_size=6), st.integers(0, 2**32))
def test_the_age_of_a_robot_that_echoes_is_never_shown_too_young(
    weather: list[Phase], seed: int
) -> None:
    rig, rnd = Rig(), Random(seed)  # noqa: S311 - repeatable on purpose
    for phase in weather:
        for _ in rig.drive(phase, rnd):
            check(rig)


@settings(max_examples=25, deadline=None)
@given(
    st.lists(weathers, min_size=1, max_size=4),
    st.lists(clock_steps, min_size=4, max_size=4),
    st.integers(0, 2**32),
)
def test_with_healthy_direct_messages_the_age_is_half_a_second_too_old_at_most(
    fiware: list[Weather], steps: list[float], seed: int
) -> None:
    rig, rnd = Rig(), Random(seed)  # noqa: S311 - repeatable on purpose
    for number, bad in enumerate(fiware):
        fine = Weather(0.03, 0.05)
        phase = Phase(5, fine, bad, fine, steps[number], -steps[number])
        for now in rig.drive(phase, rnd):
            shown, true = rig.robot.age_s(rig.at()), rig.true_age()
            if now > 1.0:
                assert shown is not None
                assert true is not None
                assert shown <= true + 0.5


def backlog(seconds: float, grows_s: float, most_s: float) -> Iterator[float]:
    """How late an agent is that takes less than it is given, message by message (s)."""
    late = 0.01
    for _ in range(round(seconds)):
        yield min(late, most_s)
        late += grows_s


@pytest.mark.parametrize("grows_s", [0.2, 0.5, 0.9])
@settings(max_examples=15, deadline=None)
@given(steps=st.lists(clock_steps, min_size=3, max_size=3), seed=st.integers(0, 2**32))
def test_on_fiware_alone_a_robot_that_does_not_echo_is_never_live_with_an_old_pose(
    grows_s: float, steps: list[float], seed: int
) -> None:
    rig = Rig(acknowledgements=False, transports=(FIWARE.id,))
    rnd = Random(seed)  # noqa: S311 - repeatable on purpose
    for number, late in enumerate(backlog(40, grows_s, 25.0)):
        step = steps[number // 15] if number % 15 == 14 else 0.0
        fiware = Weather(late, 0.05)
        for _ in rig.drive(Phase(1, FINE, fiware, FINE, step, -step), rnd):
            true = rig.true_age()
            if true is not None and true > 3.0:
                assert rig.robot.link(rig.at()) != "LIVE"


def test_a_healthy_robot_that_does_not_echo_is_live_by_its_estimate() -> None:
    rig, rnd = Rig(acknowledgements=False, transports=(FIWARE.id,)), Random(1)  # noqa: S311
    links = [rig.robot.link(rig.at()) for _ in rig.drive(quiet(5), rnd)]

    assert set(links[20:]) == {"LIVE"}
    assert rig.robot.estimated_since is not None


def test_a_robot_that_echoes_is_live_and_driven_when_all_is_well() -> None:
    rig, rnd = Rig(), Random(1)  # noqa: S311
    links = [
        (rig.robot.link(rig.at()), rig.is_clear()) for _ in rig.drive(quiet(5), rnd)
    ]

    assert set(links[20:]) == {("LIVE", True)}


def quiet(seconds: int) -> Phase:
    return Phase(seconds, FINE, FINE, FINE, 0.0, 0.0)
