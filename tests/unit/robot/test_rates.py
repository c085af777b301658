"""A robot sends an agent that is behind less, within floors, and more again later."""

from collections import deque
from dataclasses import dataclass, field
from itertools import pairwise

import pytest

from iveg.domain.observations import Instant, Origin
from iveg.domain.probe import ProbeLag
from iveg.robot.rates import LEVELS, PATIENCE_S, UplinkRates

KINDS = ("_lidar2D", "_yolox_bounding_boxes", "_odom")
TICK_S = 1 / 30


def told_for(
    rates: UplinkRates, backlog_s: float | None, seconds: float, now: float
) -> float:
    """Feedback at 5 Hz that says so; the time after it."""
    for _ in range(round(seconds * 5)):
        now += 0.2
        rates.note_backlog(backlog_s, now)
    return now


def measures(rates: UplinkRates, suffix: str, seconds: float = 10.0) -> list[float]:
    """When a sensor of 30 Hz has a measure for the agent."""
    ticks = (tick * TICK_S for tick in range(round(seconds / TICK_S)))
    return [now for now in ticks if rates.is_measure(suffix, now)]


@pytest.mark.parametrize("suffix", [*KINDS, "_nav", ""])
def test_without_a_backlog_every_message_is_a_measure(suffix: str) -> None:
    assert len(measures(UplinkRates(), suffix)) == 300


@pytest.mark.parametrize(
    ("level", "rates_hz"),
    [
        (1.0, (1.0, 30.0, 30.0)),
        (2.0, (1.0, 3.0, 30.0)),
        (LEVELS, (1.0, 3.0, 5.0)),
    ],
)
def test_scans_give_way_first_then_looks_then_poses(
    level: float, rates_hz: tuple[float, ...]
) -> None:
    for suffix, wanted in zip(KINDS, rates_hz, strict=True):
        sent = len(measures(UplinkRates(level=level), suffix)) / 10.0
        assert wanted <= sent <= 1.15 * wanted


@pytest.mark.parametrize(
    ("suffix", "longest_s"),
    [("_lidar2D", 1.0), ("_yolox_bounding_boxes", 0.34), ("_odom", 0.2)],
)
def test_no_level_and_no_backlog_goes_below_a_floor(
    suffix: str, longest_s: float
) -> None:
    rates = UplinkRates()
    told_for(rates, 60.0, 600.0, 0.0)
    sent = measures(rates, suffix)
    assert (
        max(later - earlier for earlier, later in pairwise(sent)) < longest_s + TICK_S
    )
    assert (len(sent) - 1) / (sent[-1] - sent[0]) >= 1.0 / longest_s


@pytest.mark.parametrize("suffix", ["_nav", "_safety", ""])
def test_intent_reports_and_the_single_payload_are_never_fewer(suffix: str) -> None:
    assert len(measures(UplinkRates(level=LEVELS), suffix)) == 300


def test_news_is_a_measure_at_any_level() -> None:
    rates = UplinkRates(level=LEVELS)
    measures(rates, "_yolox_bounding_boxes", 1.0)
    assert rates.is_measure("_yolox_bounding_boxes", 1.0, news=True)
    assert rates.is_measure("_yolox_bounding_boxes", 1.001, news=True)


def test_a_sensor_slower_than_its_floor_is_left_alone() -> None:
    rates = UplinkRates(level=LEVELS)
    assert all(rates.is_measure("_odom", now) for now in range(100))


@pytest.mark.parametrize("backlog_s", [None, 0.0, 0.49])
def test_no_news_and_good_news_lower_nothing(backlog_s: float | None) -> None:
    rates = UplinkRates()
    told_for(rates, backlog_s, 60.0, 0.0)
    assert rates.level == 0.0


def test_silence_of_iveg_changes_nothing() -> None:
    rates = UplinkRates()
    now = told_for(rates, 5.0, 2.0, 0.0)
    level = rates.level
    rates.note_backlog(5.0, now + 3600.0)
    assert rates.level - level <= 0.5


def test_a_backlog_is_answered_within_seconds_and_forgiven_slowly() -> None:
    rates = UplinkRates()
    now = told_for(rates, 5.0, 4.0, 0.0)
    assert rates.level == LEVELS
    now = told_for(rates, 0.1, PATIENCE_S - 1.0, now)
    assert rates.level == LEVELS
    now = told_for(rates, 0.1, 60.0, now)
    assert 1.5 < rates.level < 2.5
    told_for(rates, 0.1, 200.0, now)
    assert rates.level == 0.0


def test_a_level_between_well_and_behind_stays() -> None:
    rates = UplinkRates(level=1.5)
    told_for(rates, 0.4, 600.0, 0.0)
    assert rates.level == 1.5


def test_each_time_that_it_was_too_early_it_waits_longer() -> None:
    rates, now, waits = UplinkRates(), 0.0, []
    for _ in range(4):
        now = told_for(rates, 5.0, 4.0, now)
        began = now
        while rates.level == LEVELS:
            now = told_for(rates, 0.0, 0.2, now)
        waits.append(round((now - began) / PATIENCE_S))
    assert waits == [1, 2, 4, 8]


# --- two robots and an agent that carries a hundred measures a second ---------------


@dataclass
class Stack:
    """An agent that takes so many measures a second in order, and iVeg's own probe."""

    per_s: float
    rates: list[UplinkRates] = field(
        default_factory=lambda: [UplinkRates(), UplinkRates()]
    )
    now: float = 0.0
    queue: deque[Origin | None] = field(default_factory=deque)
    probe: ProbeLag = field(default_factory=ProbeLag)
    carried: float = 0.0
    probes: int = 0

    def run(self, seconds: float) -> list[float]:
        """The lag that iVeg tells, thirty times a second."""
        lags = []
        for _ in range(round(seconds / TICK_S)):
            self._tick()
            lag = self.probe.lag(self.at())
            lags.append(lag or 0.0)
            for rates in self.rates:
                rates.note_backlog(lag, self.now)
        return lags

    def at(self) -> Instant:
        return Instant(self.now, self.now)

    def _tick(self) -> None:
        self.now += TICK_S
        for rates in self.rates:
            for kind in KINDS:
                self.queue.extend([None] * rates.is_measure(kind, self.now))
        if self.now >= 2.0 * self.probes:
            self.probes += 1
            origin = Origin("boot", self.probes)
            self.probe.sent(origin, self.at())
            self.queue.append(origin)
        # What it could have carried while idle is gone.
        spare = min(self.carried, 1.0)
        self.carried = spare + self.per_s * TICK_S
        while self.queue and self.carried >= 1.0:
            self.carried -= 1.0
            taken = self.queue.popleft()
            if taken is not None:
                self.probe.returned(taken, self.at())


@pytest.mark.parametrize("per_s", [40.0, 70.0, 100.0, 150.0])
def test_two_robots_settle_on_what_the_agent_can_carry(per_s: float) -> None:
    stack = Stack(per_s)
    first = stack.run(60.0)
    assert max(first) < 20.0
    later = stack.run(1800.0)
    assert sum(lag > 1.0 for lag in later) < 0.02 * len(later)
    assert max(later[len(later) // 2 :]) < 3.0


def test_a_load_that_goes_is_forgotten() -> None:
    stack = Stack(70.0)
    stack.run(60.0)
    assert all(rates.level > 1.0 for rates in stack.rates)
    stack.per_s = 1000.0
    stack.run(300.0)
    assert [rates.level for rates in stack.rates] == [0.0, 0.0]
