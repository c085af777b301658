"""The table of kinds is whole, and is what the pipeline does."""

from dataclasses import dataclass

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
from iveg.domain.records import ReadingRecord
from iveg.domain.world import World
from iveg.models.robot import Device
from iveg.ngsi import codec
from tests.builders import (
    at,
    detection_frame,
    odometry,
    origin,
    received,
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


@pytest.mark.parametrize("row", KINDS, ids=lambda row: row.of.__name__)
def test_a_kind_lands_where_its_row_says(row: Kind) -> None:
    world = World(("AGI",))
    observation = next(one for one in SAID if isinstance(one, row.of))
    before = kept(world, row.lands or "sensed")

    world.apply(Received(observation, at(1.0)))

    assert (kept(world, row.lands or "sensed") != before) == (row.lands is not None)


@pytest.mark.parametrize("row", KINDS, ids=lambda row: row.of.__name__)
def test_a_copy_is_news_only_where_its_row_orders_by_arrival(row: Kind) -> None:
    world = World(("AGI",))
    observation = next(one for one in SAID if isinstance(one, row.of))
    world.apply(Received(observation, at(1.0)))

    verdict = world.apply(Received(observation, at(2.0)))

    assert verdict == ("duplicate" if row.ordered == "counted" else "new")


def test_a_battery_is_read_as_it_was_written() -> None:
    said = Battery("AGI", origin(3), 0.42, charging=True, voltage=25.1)

    reading = codec.read_measure("AGI_battery", codec.write_measure(said))

    assert reading.observations == (said,)


@pytest.mark.parametrize("level", [-0.1, 1.1, 42, "0.4"])
def test_a_level_that_is_no_share_is_refused(level: object) -> None:
    reading = codec.read_attributes("AGI", {"battery": {"percentage": level}})

    assert [one.reason for one in reading.problems] == ["bad_battery"]


async def test_a_battery_at_a_fifth_is_a_p3_until_it_is_at_a_quarter() -> None:
    desk = Desk()
    told = []
    for level in (0.50, 0.21, 0.20, 0.22, 0.249, 0.25, 0.22):
        battery(desk, level)
        await desk.wait(0.1)
        told.append(LOW in conditions_of(desk))

    assert told == [False, False, True, True, True, False, False]


async def test_one_that_charges_or_does_not_know_raises_nothing() -> None:
    desk = Desk()
    battery(desk, 0.1, charging=True)
    await desk.wait(0.1)
    charging = [*conditions_of(desk)]
    battery(desk, None)
    await desk.wait(0.1)

    assert LOW not in charging
    assert LOW not in conditions_of(desk)


def test_an_older_battery_changes_nothing() -> None:
    desk = Desk()
    late = desk.next_origin()
    battery(desk, 0.5)
    desk.hear(Battery("AGI", late, 0.1))

    kept = desk.world.robot("AGI").sensed[Battery].observation

    assert isinstance(kept, Battery)
    assert kept.percentage == 0.5


async def test_a_battery_is_kept_once_a_minute() -> None:
    desk = Desk()
    for _ in range(25):
        battery(desk, 0.5)
        desk.clock.now += 5.0

    kept = desk.records(ReadingRecord)

    assert [one.at - kept[0].at for one in kept] == [0.0, 55.0, 110.0]
    assert kept[0].kind == "battery"
    assert kept[0].value == {"percentage": 0.5, "charging": False, "voltage": 25.1}


@dataclass(frozen=True, slots=True)
class SoilMoisture(Observation):
    """A sensor with a name of two words."""

    percentage: float


def test_a_sensor_with_a_name_of_two_words_has_an_age() -> None:
    world = World(["AGI"])
    world.apply(received(SoilMoisture("AGI", origin(1), 40.0), after=1.0))

    device = Device.of(world.robot("AGI"), "_soil_moisture", SoilMoisture, at(3.0))

    assert (device.kind, device.age_s) == ("soil_moisture", 2.0)
