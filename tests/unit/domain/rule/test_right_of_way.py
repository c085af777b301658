"""Who gives way to whom, where two robots will meet and no person is near."""

import math

import pytest

from tests.unit.domain.scene import Scene, person


def first_slow(
    agi: str | None, agii: str | None, *, is_old: bool = False, somebody: bool = False
) -> tuple[float | None, float | None]:
    """When AGI and AGII are halved for each other, which meet at 0.4 m/s each (s).

    Each tells its task all the time, or, ``is_old``, only at the start.
    """
    scene, slow = Scene(), dict[str, float]()
    for tenth in range(100):
        scene.now = tenth / 10
        way = 0.04 * tenth
        scene.drive("AGI", way, linear=0.4)
        scene.drive("AGII", 8.0 - way, yaw=math.pi, linear=0.4)
        for robot_id, task in (("AGI", agi), ("AGII", agii)):
            if task and not (is_old and tenth):
                scene.navigate(robot_id, task)
        scene.look("AGI", *([person(way - 1.5)] if somebody else []))
        scene.look("AGII")
        scene.judge()
        for entry in scene.speed_limits.entries:
            if entry.zone.reason == "robot":
                slow.setdefault(entry.robot_id, scene.now)
    return slow.get("AGI"), slow.get("AGII")


def test_the_lesser_task_slows_early_and_the_greater_as_today() -> None:
    today, also = first_slow(None, None)
    scouting, hauling = first_slow("scouting", "hauling")

    assert today is not None
    assert today == also == hauling
    assert scouting is not None
    assert scouting <= today - 1.0


@pytest.mark.parametrize(
    ("agi", "agii", "is_old", "somebody"),
    [
        ("scouting", "watching", False, False),
        ("sowing", "hauling", False, False),
        (None, "hauling", False, False),
        ("scouting", "hauling", True, False),
        ("scouting", "hauling", False, True),
    ],
    ids=["equal", "unknown", "none", "told long ago", "near a person"],
)
def test_without_a_lesser_task_of_now_and_near_people_today_s_rule_stays(
    agi: str | None, agii: str | None, *, is_old: bool, somebody: bool
) -> None:
    found = first_slow(agi, agii, is_old=is_old, somebody=somebody)

    assert found == first_slow(None, None, somebody=somebody)
