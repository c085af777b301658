"""Another server that speaks to the fleet is found in what robots echo."""

from dataclasses import replace

import pytest

from iveg.domain.observations import FeedbackRef, Received
from iveg.domain.transports import DIRECT, FIWARE, TransportId
from iveg.domain.world import World
from tests.builders import START, at, odometry, origin

OURS = "iveg"


class Field:
    """An iVeg that sends ten feedbacks a second, and robots that echo."""

    def __init__(self) -> None:
        self.world = World(["AGI", "AGII"])
        self.count = 0

    def say(
        self,
        after: float,
        *others: tuple[str, int],
        robot_id: str = "AGI",
        transport: TransportId = DIRECT.id,
        ours: float | None = 0.0,
    ) -> None:
        """Odometry that has heard others first, and ours of ``ours`` seconds ago."""
        self.count += 1
        told = round(10 * after) + 1
        self.world.ledger.composed(OURS, told, told, START.mono + after)
        echoes = [FeedbackRef(boot, seq) for boot, seq in others]
        if ours is not None:
            echoes.append(FeedbackRef(OURS, max(1, round(10 * (after - ours)) + 1)))
        said = replace(origin(self.count, after=after), acknowledgements=True)
        said = replace(said, heard=echoes[0], heard_also=tuple(echoes[1:]))
        one = odometry(robot_id, origin=said)
        self.world.apply(Received(one, at(after), transport))

    def found(self, after: float) -> list[str]:
        return self.world.other_authors.speaking(at(after))


def test_a_count_of_another_boot_that_rises_for_three_seconds_is_another_iveg() -> None:
    field = Field()
    for step in range(31):
        field.say(0.1 * step, ("other", 7 + step))
        assert field.found(0.1 * step) == (["other"] if step == 30 else [])


def test_an_earlier_boot_of_ours_says_nothing_more_and_is_none() -> None:
    field = Field()
    for step in range(200):
        field.say(0.1 * step, ("before", 900))
        assert field.found(0.1 * step) == []


def test_a_count_of_our_own_boot_that_we_never_sent_is_another_iveg() -> None:
    field = Field()
    for step in range(40):
        field.say(0.1 * step, (OURS, 10**9 + step))
    assert field.found(3.9) == [OURS]


def test_a_second_count_in_our_own_name_that_rises_is_another_iveg() -> None:
    field = Field()
    for step in range(60):
        field.say(0.1 * step, (OURS, max(1, step - 9)))
    assert field.found(5.9) == [OURS]


def test_what_fiware_brings_from_before_our_start_is_no_news_of_anybody() -> None:
    field = Field()
    for step in range(60):
        field.say(0.1 * step, ("before", step), transport=FIWARE.id, ours=None)
    assert field.found(5.9) == []


def test_by_fiware_alone_whoever_speaks_beside_us_is_found() -> None:
    field = Field()
    for step in range(10, 60):
        field.say(0.1 * step, ("other", step), transport=FIWARE.id, ours=1.0)
    assert field.found(5.9) == ["other"]


@pytest.mark.parametrize(("after", "found"), [(13.9, ["other"]), (14.1, [])])
def test_it_is_over_ten_seconds_after_its_last_word(
    after: float, found: list[str]
) -> None:
    field = Field()
    for step in range(40):
        field.say(0.1 * step, ("other", step))
    assert field.found(after) == found


def test_it_is_over_at_once_when_robots_have_forgotten_it() -> None:
    field = Field()
    for step in range(40):
        field.say(0.1 * step, ("other", step))
    field.say(4.0)
    assert field.found(4.0) == []
