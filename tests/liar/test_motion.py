"""A robot whose poses, wheels and reports contradict each other is believed in none.

Each row is one lie of the third robot, told through the real doors.
"""

from collections.abc import Callable

import orjson
import pytest

from iveg.domain.limits import LIMITS
from tests.liar.greenhouse import LIAR, Field

Words = dict[str, float]
Lie = Callable[[float, Words, Words], None]
STEPS = 160


def glides(now: float, pose: Words, report: Words) -> None:
    """Twist and report say rest, while the pose goes on at 0.3 m/s."""
    pose["x"], pose["y"], pose["yaw"] = 10.0 + 0.3 * now % 6.0, 10.0, 0.0
    pose["linear_velocity"] = pose["angular_velocity"] = 0.0
    report["linear_velocity"] = report["angular_velocity"] = 0.0


def strafes(now: float, pose: Words, report: Words) -> None:
    """The same to its side."""
    glides(now, pose, report)
    pose["yaw"] = 1.57


def turns(now: float, pose: Words, report: Words) -> None:
    """It turns on the spot, and says that it rests."""
    pose["x"], pose["y"], pose["yaw"] = 10.0, 10.0, (0.4 * now) % 3.0
    pose["linear_velocity"] = pose["angular_velocity"] = 0.0
    report["linear_velocity"] = report["angular_velocity"] = 0.0


def lost_its_place(now: float, pose: Words, report: Words) -> None:
    """Its localisation died with fresh stamps, while its wheels and reports go on."""
    pose["x"], pose["y"], pose["yaw"] = 10.0, 10.0, 0.0
    pose["linear_velocity"], pose["angular_velocity"] = 0.5, 0.0
    report["linear_velocity"] = 0.5


def told_by(field: Field, lie: Lie) -> None:
    """Let the third robot tell this lie from now on."""

    def alter(topic: str, payload: bytes) -> list[tuple[str, bytes]]:
        said = orjson.loads(payload)
        pose = said.get("base_pose_ground_truth", {})
        lie(field.desk.clock.now, pose, said.get("safety_state", {}))
        return [(topic, orjson.dumps(said))]

    field.alter = alter


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lie", "code"),
    [
        (glides, "pose_against_twist"),
        (strafes, "sideways"),
        (turns, "yaw_against_turn"),
        (lost_its_place, "pose_against_twist"),
    ],
)
async def test_a_robot_under_stop_that_contradicts_itself_never_stands(
    lie: Lie, code: str
) -> None:
    field, doubts, states = Field(5), set[str](), set[str]()
    told_by(field, lie)
    for number in range(STEPS):
        if number == STEPS // 4:
            pressing = field.press(LIAR)
        await field.step()
        doubts |= set(field.desk.world.robot(LIAR).doubts.active(field.desk.clock()))
        states.add(field.desk.commander.machine(LIAR).state)
    await pressing

    assert code in doubts
    assert "STANDING" not in states
    assert "STILL_MOVING" in states


@pytest.mark.slow
async def test_a_robot_whose_localisation_dies_is_slow_within_a_second() -> None:
    field, died_at, slow_at = Field(5), None, None
    for number in range(STEPS):
        if number == STEPS // 2:
            told_by(field, lost_its_place)
            died_at = field.desk.clock.now
        await field.step()
        limit = field.desk.fleet.told[-1].speed_limits[LIAR]
        if died_at is not None and slow_at is None and limit.reason == "doubt":
            slow_at = field.desk.clock.now

    assert died_at is not None
    assert slow_at is not None
    assert slow_at - died_at <= LIMITS.doubt_ends_s
