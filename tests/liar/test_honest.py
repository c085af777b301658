"""Honest robots are never doubted, however late what FIWARE brings of them is."""

import pytest

from tests.liar.greenhouse import HONEST, STANDS_M_S, Field, as_notification

STEPS, PRESSED_AT = 400, 240
BURST = 37
"""Steps after which Orion posts all that it has kept, the newest first."""


@pytest.mark.slow
async def test_honest_robots_contradict_nothing_through_a_late_fiware_and_a_stop() -> (
    None
):
    field, kept = Field(3), list[bytes]()
    doubted = set[tuple[str, str]]()
    for number in range(STEPS):
        if number == PRESSED_AT:
            pressing = field.press("AGI")
        kept += [
            body for one in field.copied if (body := as_notification(*one)) is not None
        ]
        field.copied.clear()
        if number % BURST == 0:
            for body in reversed(kept):
                field.notify(body)
            kept.clear()
        await field.step()
        robots = (field.desk.world.robot(name) for name in HONEST)
        doubted |= {
            (one.robot_id, "contradicts")
            for one in robots
            if one.doubts.is_open(field.desk.clock())
        }
    await pressing

    assert doubted == set()
    assert field.stage.robots["AGI"].speed <= STANDS_M_S
