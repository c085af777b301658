"""Why robots drove slowly (``iveg_events_total``, ``slow_s.*``)."""

import pytest

from iveg.pipeline.slow_time import SlowTime
from tests.builders import at
from tests.unit.domain.scene import Scene, person
from tests.unit.pipeline.desk import Desk


def spent(
    scene: Scene, factor: float, cause: str | None, linear: float = 0.5
) -> list[str]:
    """Four seconds in which AGI drives and reports this; what it was counted as."""
    counted = SlowTime(scene.world, scene.people)
    began = scene.now
    for tenth in range(41):
        scene.now = round(began + tenth / 10, 1)
        scene.drive("AGI", 0.0, linear=linear)
        scene.report("AGI", factor=factor, reason="person", cause=cause)
        counted.tick(at(scene.now))
    assert set(counted.seconds.values()) <= {4}
    return list(counted.seconds)


@pytest.fixture
def scene() -> Scene:
    scene = Scene()
    scene.drive("AGI", 0.0)
    scene.look("AGI", person(1.5))
    return scene


def test_a_person_who_is_seen_and_one_who_is_remembered_are_told_apart(
    scene: Scene,
) -> None:
    (known,) = scene.everyone
    scene.now = 2.0
    assert spent(scene, 0.5, known.person_id) == ["memory"]
    assert spent(scene, 0.5, "somebody else") == ["person"]


def test_who_stands_or_is_not_limited_spends_nothing(scene: Scene) -> None:
    assert spent(scene, 0.5, None, linear=0.0) == []
    assert spent(scene, 1.0, None) == []
    assert spent(scene, 0.0, None) == []


@pytest.mark.parametrize(
    ("factor", "linear", "near"),
    [
        (0.5, 0.5, {"slow": 4, "fast": 0}),
        (1.0, 0.5, {"slow": 0, "fast": 4}),
        (0.5, 0.0, {"slow": 0, "fast": 0}),
    ],
)
def test_seconds_near_a_person_in_sight_are_counted_as_slow_or_fast(
    scene: Scene, factor: float, linear: float, near: dict[str, int]
) -> None:
    counted = SlowTime(scene.world, scene.people)
    for tenth in range(41):
        scene.now = round(tenth / 10, 1)
        scene.look("AGI", person(1.5))
        scene.drive("AGI", 0.0, linear=linear)
        scene.report("AGI", factor=factor, reason="person")
        counted.tick(at(scene.now))

    assert counted.near == near


def test_nobody_is_near_who_is_farther_than_two_metres_or_out_of_sight(
    scene: Scene,
) -> None:
    counted = SlowTime(scene.world, scene.people)
    for tenth in range(41):
        scene.now = round(1.1 + tenth / 10, 1)
        scene.look("AGI", person(5.0))
        scene.drive("AGI", 0.0)
        scene.report("AGI", factor=1.0, reason="clear")
        counted.tick(at(scene.now))

    assert counted.near == {"slow": 0, "fast": 0}


async def test_the_pipeline_counts_them() -> None:
    desk = Desk()
    for _ in range(31):
        desk.look("AGI", person(1.5))
        desk.drive("AGI")
        desk.report("AGI", factor=0.5, reason="person", linear=0.5)
        await desk.wait(0.1)

    counters = desk.parts.counters()
    assert counters["near_s.slow"] == counters["slow_s.person"] >= 2


def test_an_old_report_is_no_reason(scene: Scene) -> None:
    counted = SlowTime(scene.world, scene.people)
    scene.report("AGI", factor=0.5, reason="person")
    for half in range(20):
        scene.now = half / 2
        scene.drive("AGI", 0.0)
        counted.tick(at(scene.now))
    assert counted.seconds["person"] <= 2
