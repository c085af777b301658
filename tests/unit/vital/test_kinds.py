"""The table of kinds is whole, and is what the pipeline does."""

import pytest

from iveg.domain.kinds import KINDS, Kind
from iveg.domain.observations import (
    Battery,
    Climate,
    CommandAnswer,
    CommandStatus,
    GoalAnswer,
    HeartbeatProbe,
    Navigation,
    Observation,
    Received,
)
from iveg.domain.world import World
from tests.builders import (
    at,
    detection_frame,
    odometry,
    origin,
    safety_report,
    scan,
)
from tests.unit.vital.desk import Desk, conditions_of

LOW = "alert.battery_low"
SAID: tuple[Observation, ...] = (
    odometry(),
    scan(),
    detection_frame(),
    safety_report(),
    Navigation("AGI", origin(), "weeding"),
    CommandStatus("AGI", "PENDING"),
    CommandAnswer("AGI", origin(), "01STOP", "LATCHED"),
    GoalAnswer("AGI", origin(), "01GOAL", "ACCEPTED"),
    Climate(21.5),
    HeartbeatProbe(origin()),
    Battery("AGI", origin(), 0.5),
)


def battery(desk: Desk, level: float | None, *, charging: bool | None = False) -> None:
    desk.hear(Battery("AGI", desk.next_origin(), level, charging, 25.1))


def kept(world: World, place: str) -> object:
    """What a member of the world or of its robot holds, as text."""
    robot = world.robot("AGI")
    return repr(getattr(robot if hasattr(robot, place) else world, place))


@pytest.mark.parametrize("row", KINDS, ids=lambda row: row.type_.__name__)
def test_a_kind_lands_where_its_row_says(row: Kind) -> None:
    world = World(("AGI",))
    observation = next(one for one in SAID if isinstance(one, row.type_))
    before = kept(world, row.lands or "sensed")

    world.apply(Received(observation, at(1.0)))

    assert (kept(world, row.lands or "sensed") != before) == (row.lands is not None)


@pytest.mark.parametrize("row", KINDS, ids=lambda row: row.type_.__name__)
def test_a_copy_is_news_only_where_its_row_orders_by_arrival(row: Kind) -> None:
    world = World(("AGI",))
    observation = next(one for one in SAID if isinstance(one, row.type_))
    world.apply(Received(observation, at(1.0)))

    freshness = world.apply(Received(observation, at(2.0)))

    assert freshness == ("duplicate" if row.ordered == "counted" else "new")


async def test_a_battery_at_a_fifth_is_a_p3_until_it_is_at_a_quarter() -> None:
    desk = Desk()
    told = []
    for level in (0.50, 0.21, 0.20, 0.22, 0.249, 0.25, 0.22):
        battery(desk, level)
        await desk.wait(0.1)
        told.append(LOW in conditions_of(desk))

    assert told == [False, False, True, True, True, False, False]
