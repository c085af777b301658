"""Delays and offsets that are estimated from stamps."""

from dataclasses import replace

import pytest

from iveg.domain.clocks import RobotClock
from iveg.domain.observations import DetectionFrame, Instant, Odometry, Origin
from iveg.domain.transports import DIRECT, FIWARE, TransportId
from tests.builders import at, origin

HOUR_S = 3600.0
YEARS_S = 5 * 365 * 86400.0


class Robot:
    """A robot whose messages travel as long as a test wants."""

    def __init__(self, ahead_s: float = 0.0) -> None:
        self.estimate = RobotClock()
        self.ahead_s = ahead_s
        self.seq = 0

    def send(
        self,
        sent: float,
        delay: float = 0.0,
        transport: TransportId = DIRECT.id,
        *,
        lag: float | None = 0.0,
        kind: type = Odometry,
        boot: str = "boot-a",
    ) -> float | None:
        """A message leaves at ``sent`` (s); returns its estimated delay."""
        self.seq += 1
        one = origin(self.seq, boot=boot, after=sent + self.ahead_s)
        return self.estimate.delay(kind, one, at(sent + delay), transport, lag)

    def send_many(self, first: float, count: int, delay: float = 0.0) -> None:
        for number in range(count):
            self.send(first + 0.1 * number, delay)

    def offset(self, now: float) -> float | None:
        return self.estimate.offset_s(at(now))


# --- delays -----------------------------------------------------------------------


@pytest.mark.parametrize("delay", [0.001, 9.0, 25.0, 60.0])
def test_a_slow_transport_is_never_taken_for_a_clock(delay: float) -> None:
    robot = Robot()
    robot.send_many(0.0, 20, 0.001)

    found = [
        robot.send(2.0 + 0.1 * n - delay, delay, FIWARE.id, lag=None) for n in range(20)
    ]

    assert found == [pytest.approx(delay - 0.001, abs=1e-6)] * 20
    assert robot.offset(4.0) == pytest.approx(0.001, abs=1e-6)


@pytest.mark.parametrize("lag", [None, 24.5])
def test_fiware_alone_is_as_old_as_our_probe_or_unknown(lag: float | None) -> None:
    robot = Robot()

    found = [robot.send(0.1 * n, 25.0, FIWARE.id, lag=lag) for n in range(20)]

    assert found == [lag] * 20


def test_direct_messages_of_long_ago_do_not_date_what_fiware_brings() -> None:
    robot = Robot()
    robot.send(0.0, 0.001)

    assert robot.send(50.0, 9.0, FIWARE.id, lag=8.0) == 8.0


def test_the_fastest_message_of_more_than_a_minute_ago_is_forgotten() -> None:
    robot = Robot()
    robot.send(0.0, 0.01)
    for second in range(1, 130):
        robot.send(float(second), 0.2)

    assert robot.offset(130.0) == pytest.approx(0.2)


@pytest.mark.parametrize(("transport", "delay"), [("direct", 0.0), ("fiware", 4.0)])
def test_without_a_stamp_only_the_lag_is_known(
    transport: TransportId, delay: float
) -> None:
    robot = RobotClock()

    assert robot.delay(Odometry, Origin("a", 1), at(0.0), transport, 4.0) == delay
    assert robot.offset_s(at(0.0)) is None


# --- clocks that are set ----------------------------------------------------------


@pytest.mark.parametrize("step_s", [HOUR_S, -HOUR_S, YEARS_S, -YEARS_S, 5.0, -5.0])
def test_f16_a_clock_that_was_set_is_believed_from_the_second_message_on(
    step_s: float,
) -> None:
    robot = Robot()
    robot.send_many(0.0, 20)
    robot.ahead_s = step_s

    found = [robot.send(2.0 + 0.1 * n) for n in range(6)]

    assert found == [None, *[pytest.approx(0.0, abs=1e-6)] * 5]
    assert robot.offset(2.6) == pytest.approx(-step_s, abs=1e-6)


@pytest.mark.parametrize("off_s", [HOUR_S, -HOUR_S])
def test_one_wrong_stamp_costs_two_ages(off_s: float) -> None:
    robot = Robot()
    robot.send_many(0.0, 20)
    robot.ahead_s = off_s
    assert robot.send(2.0) is None
    robot.ahead_s = 0.0

    assert robot.send(2.1) is None
    assert robot.send(2.2) == pytest.approx(0.0, abs=1e-6)
    assert robot.offset(2.2) == pytest.approx(0.0, abs=1e-6)


def test_a_backlog_that_drains_at_once_ages_each_message_by_what_it_waited() -> None:
    robot = Robot()
    robot.send_many(0.0, 20)

    found = [robot.send(2.0 + 0.1 * n, 10.0 - 0.1 * n) for n in range(100)]

    assert found == [pytest.approx(10.0 - 0.1 * n, abs=1e-6) for n in range(100)]


def test_our_own_wall_clock_ages_nothing_when_it_is_set() -> None:
    robot = Robot()
    robot.send_many(0.0, 20)
    moment = at(2.0)

    jumped = Instant(moment.mono, moment.wall + HOUR_S)
    one = origin(99, after=2.0)

    found = robot.estimate.delay(Odometry, one, jumped, DIRECT.id, 0.0)
    assert found == pytest.approx(0.0, abs=1e-6)
    assert robot.estimate.offset_s(jumped) == pytest.approx(HOUR_S)


# --- the offset -------------------------------------------------------------------


def test_a_new_boot_has_a_clock_of_its_own() -> None:
    robot = Robot()
    robot.send_many(0.0, 5)
    robot.ahead_s = 7.0
    robot.send(1.0, boot="boot-b")

    assert robot.offset(1.0) == pytest.approx(-7.0)


@pytest.mark.parametrize(
    ("ahead", "told"), [(0.24, False), (-0.24, False), (0.3, True), (-0.3, True)]
)
def test_a_clock_a_quarter_second_off_is_told(ahead: float, *, told: bool) -> None:
    robot = Robot(ahead)
    robot.send(0.0)

    assert (robot.estimate.warning(at(0.0)) is not None) is told


def test_a_warning_lasts_a_minute_so_that_none_flaps() -> None:
    robot = Robot(0.3)
    robot.send(0.0)
    robot.estimate.warning(at(0.0))
    robot.estimate = replace(robot.estimate, _filters={})

    told = [robot.estimate.warning(at(s)) is not None for s in (1.0, 59.0, 61.0)]

    assert told == [True, True, False]


# --- a detector's own clock -------------------------------------------------------


@pytest.mark.parametrize("apart_s", [600.0, -600.0, 10.5, -10.5])
def test_a_frame_that_is_stamped_by_another_clock_is_of_unknown_age(
    apart_s: float,
) -> None:
    robot = Robot()
    robot.send(0.0)
    assert robot.send(0.0, 2.0, kind=DetectionFrame) == pytest.approx(2.0), "late"

    robot.ahead_s = apart_s
    assert robot.send(0.1, kind=DetectionFrame) is None
    assert robot.estimate.detector_apart_at == at(0.1).mono
    robot.ahead_s = 0.0
    assert robot.send(1.0) == pytest.approx(0.0), "no pose is old for it"


def test_a_clock_that_stays_apart_is_accused() -> None:
    robot, accused = Robot(), []
    for tenth in range(30):
        robot.ahead_s = 0.0
        robot.send(0.1 * tenth)
        robot.ahead_s = -600.0
        robot.send(0.1 * tenth, kind=DetectionFrame)
        accused.append(robot.estimate.detector_accused_at is not None)

    assert accused == [tenth >= 20 for tenth in range(30)]


def test_frames_behind_a_gap_accuse_no_clock() -> None:
    robot = Robot()
    robot.send(0.0)

    assert robot.send(1.0, 80.0, kind=DetectionFrame) is None
    # Odometry is young again at once, and 80 s of frames are worked off in eight.
    for tenth in range(80):
        robot.send(80.0 + 0.1 * tenth)
        robot.send(1.0 + 1.1 * tenth, 79.0 - tenth, kind=DetectionFrame)

    assert robot.estimate.detector_apart_at is not None
    assert robot.estimate.detector_accused_at is None
