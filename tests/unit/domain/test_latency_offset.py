"""A robot's clock against ours: proven bounds, jumps, and no number below zero."""

import random
from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from iveg.domain.clock_offset import ClockOffset
from tests.builders import START, at

STAMP_ROUNDING_S = 0.001


@dataclass
class Talker:
    """A robot that sends thirty messages a second and may echo ten feedbacks.

    Attributes:
        ahead_s: Its clock less ours.
        up_s: What a message takes to us; ``down_s`` what feedback takes to it.
    """

    ahead_s: float = 0.0
    up_s: float = 0.002
    down_s: float = 0.002
    acknowledgements: bool = True
    now: float = 0.0

    def talk(self, clock: ClockOffset, seconds: float) -> Iterator[float | None]:
        """What the clock says of each message."""
        for _ in range(round(30 * seconds)):
            self.now += 1 / 30
            stamp = round(START.wall + self.now + self.ahead_s, 3)
            heard = (self.now - self.down_s) // 0.1 * 0.1
            composed = START.mono + heard if self.acknowledgements else None
            yield clock.time_message(stamp, at(self.now + self.up_s), composed)


def said(talker: Talker, clock: ClockOffset, seconds: float) -> list[float | None]:
    return list(talker.talk(clock, seconds))


def numbers(found: list[float | None]) -> list[float]:
    return [one for one in found if isinstance(one, float)]


@pytest.mark.parametrize("ahead_s", [-3600.0, 0.4])
def test_a_clock_that_is_off_is_corrected_within_its_uncertainty(
    ahead_s: float,
) -> None:
    clock = ClockOffset()

    found = said(Talker(ahead_s=ahead_s, up_s=0.012), clock, 20.0)

    assert clock.state == "corrected"
    assert clock.offset_s is not None
    assert clock.uncertainty_s is not None
    assert abs(clock.offset_s - ahead_s) <= clock.uncertainty_s + STAMP_ROUNDING_S
    assert min(numbers(found)) >= 0.0


@pytest.mark.parametrize("jump_s", [-0.6, 3600.0])
def test_the_message_at_which_a_clock_jumps_is_excluded(jump_s: float) -> None:
    clock, talker = ClockOffset(), Talker()
    said(talker, clock, 5.0)

    talker.ahead_s = jump_s
    found = said(talker, clock, 20.0)

    assert found[0] is None
    assert max(numbers(found)) < 0.11
    assert clock.state == "corrected"


@pytest.mark.parametrize(
    ("ahead_s", "state", "most"),
    [(0.0, "assumed", 0.031), (0.3, "untrusted", None), (-3600.0, "untrusted", None)],
)
def test_a_robot_that_does_not_echo_is_taken_at_its_word_unless_nothing_explains_it(
    ahead_s: float, state: str, most: float | None
) -> None:
    clock = ClockOffset()

    talker = Talker(acknowledgements=False, up_s=0.030, ahead_s=ahead_s)
    found = numbers(said(talker, clock, 2.0))

    assert max(found, default=None) == pytest.approx(most, abs=STAMP_ROUNDING_S)
    assert (clock.state, clock.uncertainty_s) == (state, None)


def test_no_stamp_whatever_it_says_gives_a_number_below_zero() -> None:
    clock, chance = ClockOffset(), random.Random(7)  # noqa: S311 - a fault
    now = 0.0
    found: list[float | None] = []
    for _ in range(5_000):
        now += 0.03
        stamp = START.wall + now + chance.choice([0, 0, 0, chance.gauss(0, 1), 3600])
        composed = chance.choice([None, START.mono + now - chance.random()])
        found.append(clock.time_message(stamp, at(now), composed))

    assert min(numbers(found)) >= 0.0
