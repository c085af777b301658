"""The transport that brings what counts of a robot."""

from iveg.domain.observations import Origin
from iveg.domain.transports import DIRECT, FIWARE, TransportId
from iveg.domain.world import World
from tests.builders import odometry, origin, received


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
    assert world.robot("AGI").odometry_transport == FIWARE.id


def test_a_robot_without_a_count_is_read_directly_while_that_works() -> None:
    world = World(["AGI"])
    blank = odometry(origin=Origin())
    assert world.apply(received(blank, after=0.0, transport=DIRECT.id)) == "new"
    assert world.apply(received(blank, after=0.9, transport=FIWARE.id)) == "duplicate"
    assert world.apply(received(blank, after=1.1, transport=FIWARE.id)) == "new"
