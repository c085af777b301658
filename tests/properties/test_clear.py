"""Clear is a proof: whatever is lost, late, refused or lied, nobody gains speed by it.

A farmer stands beside AGI in full view of AGII; R0 drives alone, far from both.  AGI
and AGII are honest; R0, strangers and the air between are not.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from hypothesis import given, settings
from hypothesis import strategies as st

from iveg.domain.feedback import FULL_SPEED, HALF_SPEED
from iveg.domain.limits import LIMITS
from iveg.domain.observations import (
    DetectionFrame,
    Observation,
    Odometry,
    Origin,
    RefusedFrame,
)
from iveg.domain.rule.clear import unmet_conditions
from iveg.domain.world import World
from tests.builders import at, detection, detection_frame, odometry, origin, received
from tests.unit.vital.desk import Desk

STEP_S = 0.1
PLACES = {"AGI": 0.0, "AGII": 5.0, "R0": 60.0}
FARMER = detection("farmer", 1.5)
HONEST = ("AGI", "AGII")

fates = st.sampled_from(["comes"] * 6 + ["lost", "late", "twice", "other boot"])
lies = st.sampled_from(
    ["nothing", "blind frame", "broken frame", "frame of another zone", "far away"]
)
steps = st.lists(
    st.tuples(st.tuples(fates, fates, fates, fates), lies), min_size=5, max_size=40
)


@dataclass
class Story:
    """One fleet; ``seen_at`` is when the farmer was last reported (s)."""

    robots: tuple[str, ...] = tuple(PLACES)
    seen_at: float = -math.inf

    def __post_init__(self) -> None:
        self.desk = Desk(self.robots)
        self.waiting: list[tuple[float, Observation]] = []

    def honest(self, robot_id: str) -> tuple[Odometry, DetectionFrame]:
        """Where an honest robot is, and what it sees there."""
        seen = (FARMER,) if robot_id == "AGII" else ()
        place, name = PLACES[robot_id], self.desk.next_origin()
        return (
            odometry(robot_id, place, linear=0.0, origin=name),
            detection_frame(robot_id, *seen, origin=self.desk.next_origin()),
        )

    def meet(self, said: Odometry | DetectionFrame, fate: str) -> None:
        """A message of an honest robot meets its fate on the way."""
        if fate == "late":
            self.waiting.append((self.desk.clock.now + 0.7, said))
        if fate == "other boot":
            self.hear(replace(said, origin=Origin("stray", 1)))
        if fate in ("comes", "twice", "other boot"):
            self.hear(said)
        if fate == "twice":
            self.hear(said)

    def hear(self, said: Observation) -> None:
        self.desk.hear(said)
        if getattr(said, "detections", ()) == (FARMER,):
            self.seen_at = self.desk.clock.now

    def arrive(self) -> None:
        """What was late comes now."""
        now = self.desk.clock.now
        due = [one for moment, one in self.waiting if moment <= now]
        self.waiting = [one for one in self.waiting if one[0] > now]
        for one in due:
            self.desk.hear(one)

    def lie(self, lie: str) -> None:
        """R0 says something of its own, or somebody in its name."""
        said: Mapping[str, Iterable[Observation]] = {
            "blind frame": [detection_frame("R0", origin=self.desk.next_origin())],
            "broken frame": [RefusedFrame("R0")],
            "frame of another zone": [
                detection_frame("R0", origin=origin(10**6, after=-7200.0))
            ],
            "far away": [odometry("R0", 5e5, origin=self.desk.next_origin())],
        }
        for one in said.get(lie, ()):
            self.desk.hear(one)

    def pass_time(self) -> None:
        self.desk.clock.now = round(self.desk.clock.now + STEP_S, 6)
        self.desk.loop.step([], self.desk.clock())

    def told(self, robot_id: str) -> float:
        """The factor that the newest feedback tells a robot."""
        return self.desk.fleet.told[-1].speed_limits[robot_id].speed_factor


@settings(max_examples=60, deadline=None)
@given(steps)
def test_nobody_near_somebody_who_was_honestly_reported_is_told_more_than_half(
    story: list[tuple[tuple[str, ...], str]],
) -> None:
    one = Story()
    for fate, lie in story:
        said = [each for name in HONEST for each in one.honest(name)]
        for each, how in zip(said, fate, strict=True):
            one.meet(each, how)
        one.lie(lie)
        one.arrive()
        one.pass_time()
        if one.desk.clock.now - one.seen_at <= LIMITS.seen_s:
            assert one.told("AGI") <= HALF_SPEED


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.lists(st.booleans(), min_size=6, max_size=6), min_size=5, max_size=30)
)
def test_losing_evidence_raises_no_factor(lost: list[list[bool]]) -> None:
    whole, part = Story(), Story()
    for step in lost:
        for story, gone in ((whole, [False] * 6), (part, step)):
            said = [each for name in PLACES for each in story.honest(name)]
            for each, is_gone in zip(said, gone, strict=True):
                story.meet(each, "lost" if is_gone else "comes")
            story.pass_time()
        for name in PLACES:
            assert part.told(name) <= whole.told(name)


def test_a_healthy_fleet_is_told_that_it_is_clear() -> None:
    """Else the two above would hold of a program that never says so."""
    story = Story()
    for _ in range(20):
        for name in PLACES:
            for each in story.honest(name):
                story.meet(each, "comes")
        story.pass_time()
    assert [story.told(name) for name in PLACES] == [HALF_SPEED, FULL_SPEED, FULL_SPEED]


spoilings = st.lists(
    st.tuples(
        st.sampled_from(sorted(PLACES)),
        st.sampled_from(["pose", "frame", "refused", "doubt", "unplaced"]),
    ),
    max_size=8,
)


def spoil(world: World, robot_id: str, what: str) -> None:
    """Take one piece of evidence of one robot away."""
    robot = world.robot(robot_id)
    match what:
        case "pose":
            robot.pose_at = None
        case "frame":
            robot.detector.whole_at = None
        case "refused":
            robot.detector.note_flaw("unreadable", at(0.0))
        case "doubt":
            robot.doubts.contradicted("jumped", at(-0.6))
            robot.doubts.contradicted("jumped", at(0.0))
        case _:
            robot.odometry = robot.trusted_pose = None


@given(spoilings, spoilings)
def test_what_is_missing_only_grows_as_evidence_goes(
    first: list[tuple[str, str]], more: list[tuple[str, str]]
) -> None:
    world = World(PLACES)
    for name, x in PLACES.items():
        world.apply(received(odometry(name, x)))
        world.robot(name).detector.note_whole(at(0.0).mono)
    for one in first:
        spoil(world, *one)
    before = unmet_conditions(world, at(0.0))
    for one in more:
        spoil(world, *one)
    after = unmet_conditions(world, at(0.0))
    assert all(set(before[name]) <= set(after[name]) for name in PLACES)
