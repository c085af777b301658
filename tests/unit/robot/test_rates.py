"""A robot sends an agent that is behind less, within floors, and more again later."""

from itertools import pairwise

import pytest

from iveg.robot.uplink import LEVELS, PATIENCE_S, UplinkRates

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


@pytest.mark.parametrize(
    ("level", "rates_hz"),
    [(1.0, (1.0, 30.0, 30.0)), (2.0, (1.0, 3.0, 30.0)), (LEVELS, (1.0, 3.0, 5.0))],
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
