"""Another server that speaks to the fleet is found in what robots echo."""

from collections.abc import Sequence
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
        one = odometry(origin=said)
        self.world.apply(Received(one, at(after), transport))

    def found(self, after: float) -> list[str]:
        return self.world.other_authors.speaking(at(after))


def test_a_count_of_another_boot_that_rises_for_three_seconds_is_another_iveg() -> None:
    field = Field()
    for step in range(31):
        field.say(0.1 * step, ("other", 7 + step))
        assert field.found(0.1 * step) == (["other"] if step == 30 else [])


@pytest.mark.parametrize(
    ("author", "seqs", "found"),
    [
        ("before", [900] * 200, []),
        (OURS, range(10**9, 10**9 + 40), [OURS]),
        (OURS, [max(1, step - 9) for step in range(60)], [OURS]),
    ],
    ids=["an earlier boot", "what we never sent", "a second count that rises"],
)
def test_a_count_that_rises_in_our_own_name_is_another_iveg_and_one_that_stands_none(
    author: str, seqs: Sequence[int], found: list[str]
) -> None:
    field = Field()
    for step, seq in enumerate(seqs):
        field.say(0.1 * step, (author, seq))
    assert field.found(0.1 * len(seqs) - 0.1) == found


@pytest.mark.parametrize(("ours", "found"), [(None, []), (1.0, ["other"])])
def test_by_fiware_alone_who_speaks_beside_us_is_found_and_who_spoke_before_is_not(
    ours: float | None, found: list[str]
) -> None:
    field = Field()
    for step in range(10, 60):
        field.say(0.1 * step, ("other", step), transport=FIWARE.id, ours=ours)
    assert field.found(5.9) == found


def test_it_is_over_ten_seconds_after_its_last_word_or_once_robots_forgot_it() -> None:
    field = Field()
    for step in range(40):
        field.say(0.1 * step, ("other", step))
    assert [field.found(after) for after in (13.9, 14.1)] == [["other"], []]
    field.say(4.0)
    assert field.found(4.0) == []
