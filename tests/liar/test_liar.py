"""Whoever lies, nobody loses protection and a STOP stops.

`IVEG_LIAR_STEPS` is how many steps of a twentieth of a second all liars take together:
2,000, and 100,000 by `make deep`.
"""

import logging
import os
from random import Random

import pytest

from iveg.domain.feedback import HALF_SPEED
from tests.liar.greenhouse import HONEST, STANDS_M_S, Field
from tests.liar.liars import LIARS, Liar

STEPS = int(os.environ.get("IVEG_LIAR_STEPS", "2000")) // (len(LIARS) + 1)
RUN = 250
"""Steps of one greenhouse; then another, of another seed."""


async def play(field: Field, liar: Liar, steps: int) -> None:
    """Lie at every step; half-way somebody presses STOP on AGI, which stands for it."""
    for number in range(steps):
        await liar.act()
        if number == steps // 2:
            pressing = field.press("AGI")
        await field.step()
    field.desk.journal.opened.set()
    await pressing
    assert field.stage.robots["AGI"].speed <= STANDS_M_S


@pytest.mark.slow
@pytest.mark.parametrize("part", LIARS)
async def test_while_one_part_lies_nobody_loses_protection_and_a_stop_stops(
    part: str, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.ERROR)
    for number, steps in enumerate(_runs()):
        seed = f"{part} {number}"
        field = Field(number + 7)
        await play(field, LIARS[part](field, Random(seed)), steps)  # noqa: S311


@pytest.mark.slow
async def test_while_nobody_lies_robots_are_clear_and_slowed_and_stand() -> None:
    """Else all of the above would hold of a program that says half for ever."""
    field, told = Field(1), set[tuple[str, float]]()
    for number in range(max(RUN, STEPS)):
        if number == RUN // 2:
            pressing = field.press("AGI")
        await field.step()
        limits = field.desk.fleet.told[-1].speed_limits if field.desk.fleet.told else {}
        told |= {(name, one.speed_factor) for name, one in limits.items()}
    await pressing
    assert {(name, 1.0) for name in HONEST} <= told
    assert any(factor == HALF_SPEED for _, factor in told)
    assert field.desk.commander.machine("AGI").state == "STANDING"


def _runs() -> list[int]:
    """Lengths of the runs that make up all steps of one liar."""
    return [RUN] * (STEPS // RUN) + [max(120, STEPS % RUN)] * bool(STEPS % RUN)
