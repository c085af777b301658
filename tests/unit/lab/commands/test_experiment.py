"""Where an experiment runs: what ``--fiware`` names, and what it takes of settings."""

from pathlib import Path

import pytest

from iveg.adapters.orion import OrionClient
from iveg.domain.errors import DataFileError, HopError, SettingsError
from iveg.lab.commands.experiment import (
    experiment_settings,
    refuse_live_robots,
    with_fiware,
)
from iveg.settings import Settings
from tests.faulty_fiware import faulty_fiware

ORION, IOTA, MQTT = "http://orion:1026", "https://agent:4041", "mqtts://broker:8883"


def test_orion_the_agent_and_the_broker_can_be_named_in_one_go() -> None:
    named = with_fiware(Settings(), [ORION, IOTA, MQTT])

    assert (named.orion_url, named.iota_url, named.mqtt_url) == (ORION, IOTA, MQTT)


@pytest.mark.parametrize(
    "words", [[ORION], [ORION, MQTT], [ORION, IOTA, IOTA], ["orion", "agent"]]
)
def test_half_a_fiware_is_refused(words: list[str]) -> None:
    with pytest.raises(SettingsError, match="--fiware"):
        with_fiware(Settings(), words)


def test_the_fleet_is_the_papers_and_secrets_are_new(tmp_path: Path) -> None:
    site = Settings(robots=("R1",), api_token="known", greenhouse="none")

    placed = experiment_settings(tmp_path, site)

    assert placed.robots == ("AGI", "AGII")
    assert placed.greenhouse == "mvsim-20x20"
    assert placed.api_token not in ("", "known")
    assert Path(placed.data_directory).parent == tmp_path


async def test_a_fiware_at_which_a_robot_of_that_name_is_live_is_refused() -> None:
    pose = {"type": "object", "value": {"x": 1.0, "y": 2.0, "yaw": 0.1}}
    entity = {"id": "AGII", "type": "Robot", "base_pose_ground_truth": pose}
    async with faulty_fiware() as up:
        settings = Settings(orion_url=up.orion_url)
        await refuse_live_robots(settings)
        tenant = settings.fiware_service, settings.fiware_servicepath
        async with OrionClient(up.orion_url, *tenant) as orion:
            await orion.ask("POST", "/v2/entities", body=entity)

        with pytest.raises(DataFileError, match="AGII is live there"):
            await refuse_live_robots(settings)


async def test_a_fiware_that_does_not_answer_is_refused() -> None:
    with pytest.raises(HopError):
        await refuse_live_robots(Settings(orion_url="http://127.0.0.1:9"))
