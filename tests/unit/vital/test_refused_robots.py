"""A robot that a setting refuses: silence by any way, and STOP still goes to it."""

from pathlib import Path

import pytest

from iveg.app import App
from iveg.domain.errors import SettingsError
from iveg.domain.observations import Received
from iveg.domain.transports import DIRECT, FIWARE
from iveg.settings import Settings
from tests.builders import odometry
from tests.unit.vital.desk import Desk, conditions_of


def desk_that_refuses_agi() -> Desk:
    desk = Desk(refused=("AGI",))
    for way in (DIRECT.id, FIWARE.id):
        for name in ("AGI", "AGII"):
            pose = odometry(name, 5.0, origin=desk.next_origin())
            desk.ingest.enqueue(Received(pose, desk.clock(), way))
    desk.loop.step(list(desk.ingest.drain()), desk.clock())
    return desk


def test_nothing_of_it_counts_by_any_way_and_each_message_is_counted() -> None:
    desk = desk_that_refuses_agi()

    assert desk.world.robot("AGI").odometry is None
    assert desk.world.robot("AGII").odometry is not None
    assert desk.ingest.counters["rejected.refused_robot"] == 2


async def test_it_raises_an_alert_and_stop_still_goes_to_it() -> None:
    desk = desk_that_refuses_agi()
    await desk.wait(4.0)

    await desk.commander.stop(["AGI"], "ana", desk.clock())

    assert "alert.robot_refused" in conditions_of(desk)
    assert [robot_id for robot_id, _ in desk.fleet.stops] == ["AGI"]


def test_a_name_that_no_robot_has_ends_the_start(tmp_path: Path) -> None:
    settings = Settings(robots=("AGI",), refused_robots=("AGX",))

    with pytest.raises(SettingsError, match="AGX"):
        App(settings, tmp_path)
