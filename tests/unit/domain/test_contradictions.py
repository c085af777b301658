"""Contradictions that last are doubts; one alone, lateness and a reboot are none."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import pytest

from iveg.domain.geometry import Rectangle
from iveg.domain.observations import FeedbackRef, Observation, Origin, Received
from iveg.domain.robot_state import Doubts
from iveg.domain.transports import DIRECT
from iveg.domain.world import World
from tests.builders import at, fleet_of, odometry, origin, safety_report

BOUNDS = Rectangle(0.0, 0.0, 50.0, 30.0)
STEP_S = 0.1


@dataclass
class Robot:
    """AGI, ten messages a second; ``x`` is where it is (m).

    Attributes:
        word: The fleet's word for it.
    """

    word: str = "AGI"
    now: float = 0.0
    x: float = 5.0
    boot: str = "boot-a"
    ahead_s: float = 0.0
    seq: int = 0
    told: int = 0
    met: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.world = World(fleet_of(self.word), bounds=BOUNDS)
        self.robot = self.world.robot("AGI")

    def origin(self) -> Origin:
        """Of its next message, with the newest feedback echoed."""
        self.seq += 1
        one = origin(self.seq, boot=self.boot, after=self.now)
        return replace(
            one,
            mono=5.0 + self.now + self.ahead_s,
            acknowledgements=True,
            heard=FeedbackRef("iveg", self.told),
            replay="AGI" if self.world.robot("AGI").is_replay else None,
        )

    def tell(self) -> None:
        """iVeg sends a feedback."""
        self.told += 1
        self.world.ledger.composed("iveg", self.told, self.told, at(self.now).mono)

    def say(self, said: Observation) -> None:
        """A message comes; what is doubted then is met."""
        self.world.apply(Received(said, at(self.now), DIRECT.id))
        self.met |= set(self.robot.doubts.active(at(self.now)))

    def drive(self, seconds: float, *, speed: float = 0.5) -> None:
        """It drives along x and says so."""
        for _ in range(round(seconds / STEP_S)):
            self.wait(STEP_S)
            self.x += speed * STEP_S
            self.say(odometry(x=self.x, y=5.0, linear=speed, origin=self.origin()))

    def wait(self, seconds: float) -> None:
        """Time passes, and iVeg tells what it tells."""
        self.now = round(self.now + seconds, 6)
        self.tell()

    @property
    def doubts(self) -> tuple[str, ...]:
        """What is doubted now."""
        return self.robot.doubts.active(at(self.now))


def _outside(robot: Robot) -> None:
    robot.x = 101.0
    robot.drive(STEP_S, speed=0.0)


def _fast(robot: Robot) -> None:
    robot.wait(STEP_S)
    robot.x += 1.6 * STEP_S
    robot.say(odometry(x=robot.x, y=5.0, linear=1.6, origin=robot.origin()))


def _fast_report(robot: Robot) -> None:
    robot.wait(STEP_S)
    said = safety_report("AGI", speed_factor=0.0, linear=-1.6, origin=robot.origin())
    robot.say(said)


def _jumping(robot: Robot) -> None:
    robot.x += 4.0
    robot.drive(STEP_S)


def _gliding(robot: Robot) -> None:
    robot.x += 0.03
    robot.drive(STEP_S, speed=0.0)


LIES: list[tuple[str, Callable[[Robot], None]]] = [
    ("pose_outside", _outside),
    ("too_fast", _fast),
    ("too_fast", _fast_report),
    ("jumped", _jumping),
    ("pose_against_twist", _gliding),
]


@pytest.mark.parametrize(
    ("code", "lie"), LIES, ids=[lie.__name__.strip("_") for _, lie in LIES]
)
def test_f65_what_contradicts_for_longer_than_a_round_trip_is_doubted(
    code: str, lie: Callable[[Robot], None]
) -> None:
    robot = Robot()
    robot.drive(1.0)

    for _ in range(20):
        lie(robot)

    assert code in robot.doubts


def test_a_recording_may_say_anything() -> None:
    robot = Robot("AGI:recording")
    for _, lie in LIES * 20:
        lie(robot)

    assert robot.robot.is_replay
    assert robot.met == set()


# --- what is no contradiction -------------------------------------------------------


def test_a_relocalisation_is_accepted_with_its_first_jump() -> None:
    robot = Robot()
    robot.drive(2.0)

    robot.x += 30.0
    robot.drive(3.0)

    assert robot.met == set()


def test_many_small_steps_that_add_up_are_a_jump() -> None:
    robot = Robot()
    robot.drive(2.0)
    for _ in range(20):
        robot.x += 0.4
        robot.drive(STEP_S, speed=0.0)

    assert set(robot.doubts) == {"jumped", "pose_against_twist"}


def test_a_robot_that_nobody_described_may_drive_as_any_robot_does() -> None:
    robot = Robot()
    robot.world = World(["AGI"], bounds=BOUNDS)
    robot.robot = robot.world.robot("AGI")
    robot.drive(3.0, speed=9.0)
    slow_enough = robot.met.copy()
    robot.drive(1.0, speed=11.0)

    assert slow_enough == set()
    assert robot.doubts == ("too_fast",)


def test_a_reboot_and_a_straggler_of_the_boot_before_are_no_doubt() -> None:
    robot = Robot()
    robot.drive(2.0)
    robot.boot, robot.ahead_s = "boot-b", -2.0
    robot.drive(0.3)
    late = odometry(x=5.0, y=5.0, origin=origin(3, boot="boot-z"))
    robot.say(late)
    robot.drive(3.0)

    assert robot.met == set()


def test_orions_answer_to_a_question_contradicts_nothing() -> None:
    robot = Robot()
    for _ in range(20):
        robot.wait(STEP_S)
        said = odometry(x=1e4, linear=50.0, origin=robot.origin())
        robot.world.apply(Received(said, at(robot.now), is_query_answer=True))

    assert robot.doubts == ()


# --- how long a doubt lasts ---------------------------------------------------------


@pytest.mark.parametrize(
    ("moments", "later", "doubted"),
    [((1.0, 1.6), 2.5, ("jump",)), ((1.0, 1.6), 2.7, ()), ((1.0, 2.1, 3.2), 3.2, ())],
    ids=["within a second", "after a second", "far apart are two beginnings"],
)
def test_a_doubt_ends_after_a_second_of_consistency(
    moments: tuple[float, ...], later: float, doubted: tuple[str, ...]
) -> None:
    doubts = Doubts()
    for moment in moments:
        doubts.contradicted("jump", at(moment))

    assert doubts.active(at(later)) == doubted
