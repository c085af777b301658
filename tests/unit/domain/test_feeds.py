"""Which transport feeds a robot."""

from dataclasses import replace

from iveg.domain.observations import LaserScan, Odometry, Origin
from iveg.domain.transports import DIRECT, FIWARE, TransportId
from iveg.domain.world import Feed, World
from tests.builders import START, odometry, origin, received


def fed(*heard: tuple[TransportId, float]) -> Feed:
    feed = Feed()
    for transport, when in heard:
        feed.heard(transport, when)
    return feed


def test_the_direct_copy_feeds_while_it_is_fresh() -> None:
    feed = fed((DIRECT.id, 1.0), (FIWARE.id, 1.5))
    assert feed.transport(1.9) == DIRECT.id


def test_without_a_direct_copy_orions_feeds() -> None:
    assert Feed().transport(1.0) == FIWARE.id
    assert fed((FIWARE.id, 1.0)).transport(1.1) == FIWARE.id


def test_a_direct_copy_that_is_lost_gives_way_to_orions() -> None:
    feed = fed((DIRECT.id, 1.0), (FIWARE.id, 2.1))
    assert feed.transport(2.2) == FIWARE.id


def test_a_robot_that_is_silent_on_both_transports_changes_nothing() -> None:
    feed = fed((DIRECT.id, 1.0), (FIWARE.id, 1.1))
    assert feed.transport(600.0) == DIRECT.id


# --- in the world -------------------------------------------------------------------


def heard(
    world: World, transport: TransportId, seq: int, after: float, x: float = 0.0
) -> str:
    observation = odometry(x=x, origin=origin(seq, after=after))
    return world.apply(received(observation, after=after, transport=transport))


def test_the_newest_by_count_wins_whatever_brought_it() -> None:
    world = World(["AGI"])
    verdicts = [
        heard(world, DIRECT.id, 2, 0.1, x=2.0),
        heard(world, FIWARE.id, 1, 0.2, x=1.0),
        heard(world, FIWARE.id, 2, 0.3, x=2.0),
        heard(world, FIWARE.id, 3, 0.4, x=3.0),
        heard(world, DIRECT.id, 3, 0.5, x=3.0),
    ]
    assert verdicts == ["new", "late", "duplicate", "new", "duplicate"]
    pose = world.robot("AGI").odometry
    assert pose is not None
    assert pose.pose.x == 3.0


def test_a_robot_without_a_count_is_read_directly_while_that_works() -> None:
    world = World(["AGI"])
    blank = odometry(origin=Origin())
    assert world.apply(received(blank, after=0.0, transport=DIRECT.id)) == "new"
    assert world.apply(received(blank, after=0.9, transport=FIWARE.id)) == "duplicate"
    assert world.apply(received(blank, after=1.1, transport=FIWARE.id)) == "new"


def test_scans_and_poses_have_feeds_of_their_own() -> None:
    world = World(["AGI"])
    heard(world, DIRECT.id, 1, 0.0)
    assert world.feed("AGI", Odometry).transport(START.mono) == "direct"
    assert world.feed("AGI", LaserScan).transport(START.mono) == "fiware"


def test_what_was_asked_of_orion_feeds_nobody() -> None:
    world = World(["AGI"])
    world.apply(replace(received(odometry(), transport=FIWARE.id), asked=True))
    assert world.feed("AGI").fiware_at == float("-inf")
