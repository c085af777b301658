"""Which transport feeds a robot, and when Orion's copy may be throttled."""

from dataclasses import replace

import pytest

from iveg.domain.feeds import Feed
from iveg.domain.observations import LaserScan, Odometry, Origin
from iveg.domain.transports import DIRECT, FIWARE, TransportId
from iveg.domain.world import World
from tests.builders import START, at, odometry, origin, received

HZ = 10.0


class Bench:
    """One feed on a clock of its own; steps of a tenth of a second."""

    def __init__(self) -> None:
        self.feed = Feed()
        self.now = 0.0
        self.switches: list[tuple[float, bool | None]] = [(0.0, None)]

    def run(
        self,
        seconds: float,
        *,
        direct: bool = True,
        fiware: bool = True,
        fiware_leads: bool = False,
        connected: bool = True,
    ) -> "Bench":
        for _ in range(round(seconds * HZ)):
            self.now = round(self.now + 1 / HZ, 6)
            if direct:
                self.feed.heard(DIRECT.id, self.now, news=not fiware_leads)
            if fiware:
                self.feed.heard(FIWARE.id, self.now, news=fiware_leads or not direct)
            judged = self.feed.judge(self.now, connected=connected)
            if judged != self.switches[-1][1]:
                self.switches.append((self.now, judged))
        return self

    @property
    def thinned(self) -> bool | None:
        return self.switches[-1][1]


def test_a_direct_copy_that_stays_makes_orions_a_fallback() -> None:
    bench = Bench().run(4.9)
    assert bench.thinned is None
    assert bench.run(0.3).thinned is True
    assert bench.feed.transport(bench.now) == "direct"


def test_without_a_direct_copy_every_one_of_orions_counts() -> None:
    bench = Bench().run(10.0, direct=False)
    assert bench.thinned is False
    assert bench.feed.transport(bench.now) == "fiware"


@pytest.mark.parametrize(
    "loss",
    [{"direct": False}, {"fiware_leads": True}, {"connected": False}],
    ids=["silent", "behind", "no broker"],
)
def test_a_direct_copy_that_is_lost_is_missed_within_two_seconds(
    loss: dict[str, bool],
) -> None:
    bench = Bench().run(8.0)
    assert bench.thinned is True
    assert bench.run(1.5, **loss).thinned is False


def test_a_robot_that_is_silent_on_both_transports_changes_nothing() -> None:
    bench = Bench().run(8.0).run(600.0, direct=False, fiware=False)
    assert bench.thinned is True
    assert bench.feed.transport(bench.now) == "direct"


def test_a_robot_that_comes_back_through_fiware_alone_is_noticed() -> None:
    bench = Bench().run(8.0).run(60.0, direct=False, fiware=False)
    assert bench.run(0.2, direct=False).thinned is False


def test_a_direct_copy_with_gaps_never_makes_orions_a_fallback() -> None:
    bench = Bench()
    for _ in range(20):
        bench.run(2.0).run(1.5, direct=False)
    assert bench.thinned is False
    assert len(bench.switches) == 2


def test_after_a_loss_five_good_seconds_come_first() -> None:
    bench = Bench().run(8.0).run(3.0, direct=False)
    assert bench.run(4.8).thinned is False
    assert bench.run(0.5).thinned is True


def test_a_fallback_that_is_first_by_a_moment_changes_nothing() -> None:
    feed = Feed()
    for tenth in range(200):
        if tenth % 10 == 5:
            feed.heard(FIWARE.id, tenth / HZ - 0.01, news=True)
        feed.heard(DIRECT.id, tenth / HZ, news=True)
        feed.judge(tenth / HZ, connected=True)
    assert feed.thinned is True


def test_a_direct_copy_that_follows_late_is_missed() -> None:
    feed = Bench().run(8.0).feed
    for tenth in range(80, 110):
        if tenth % 10 == 5:
            feed.heard(FIWARE.id, tenth / HZ - 0.29, news=True)
        feed.heard(DIRECT.id, tenth / HZ, news=tenth % 10 == 5)
    assert feed.judge(11.0, connected=True) is False


def test_a_short_burst_of_orions_copies_is_no_loss() -> None:
    bench = Bench().run(8.0).run(0.5, fiware_leads=True).run(2.0)
    assert bench.thinned is True


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


def test_a_direct_twin_of_the_newest_is_not_behind() -> None:
    world = World(["AGI"])
    for seq in range(30):
        after = 0.1 * seq
        heard(world, FIWARE.id, seq, after)
        heard(world, DIRECT.id, seq, after + 0.02)
    assert world.feeds.of("AGI").judge(at(2.95).mono, connected=True) is None


def test_a_robot_without_a_count_is_read_directly_while_that_works() -> None:
    world = World(["AGI"])
    blank = odometry(origin=Origin())
    assert world.apply(received(blank, after=0.0, transport=DIRECT.id)) == "new"
    assert world.apply(received(blank, after=0.9, transport=FIWARE.id)) == "duplicate"
    assert world.apply(received(blank, after=1.1, transport=FIWARE.id)) == "new"


def test_a_throttled_copy_is_never_live_by_itself() -> None:
    world = World(["AGI"])
    copy = replace(received(odometry(), transport=FIWARE.id), thinned=True)
    assert world.apply(copy) == "new"
    assert world.robot("AGI").link(START) == "LATE"


def test_a_throttled_copy_makes_no_pose_older() -> None:
    world = World(["AGI"])
    heard(world, DIRECT.id, 1, 0.0)
    copy = received(
        odometry(origin=origin(2, after=0.1)), after=0.1, transport=FIWARE.id
    )
    world.apply(replace(copy, thinned=True))
    assert world.robot("AGI").link(at(0.9)) == "LIVE"


def test_scans_and_poses_have_feeds_of_their_own() -> None:
    world = World(["AGI"])
    heard(world, DIRECT.id, 1, 0.0)
    assert world.feeds.of("AGI", Odometry).transport(START.mono) == "direct"
    assert world.feeds.of("AGI", LaserScan).transport(START.mono) == "fiware"


def test_what_was_asked_of_orion_feeds_nobody() -> None:
    world = World(["AGI"])
    world.apply(replace(received(odometry(), transport=FIWARE.id), asked=True))
    assert world.feeds.of("AGI").fiware_at == float("-inf")
