"""A site's robots find at their next start what they would have found before."""

from collections.abc import AsyncIterator

import aiomqtt
import pytest

from iveg.domain.errors import DataFileError, HopError
from iveg.lab.experiment.desired_states import give_back, read_free_robots
from iveg.ngsi import codec, names
from iveg.settings import Settings
from tests.faulty_fiware import faulty_fiware

ROBOTS = ("AGI", "AGII")
RUN = codec.write_desired("run", ())


@pytest.fixture
async def site() -> AsyncIterator[Settings]:
    """A broker of its own."""
    async with faulty_fiware() as up:
        yield Settings(mqtt_url=up.mqtt_url)


async def retain(site: Settings, robot_id: str, payload: bytes) -> None:
    host, _, port = site.mqtt_url.removeprefix("mqtt://").partition(":")
    async with aiomqtt.Client(host, int(port)) as client:
        topic = names.DESIRED_TOPIC.format(robot_id=robot_id)
        await client.publish(topic, payload, qos=1, retain=True)


async def test_its_own_stop_gives_way_to_what_was_retained_before(
    site: Settings,
) -> None:
    await retain(site, "AGI", RUN)
    before = await read_free_robots(site, ROBOTS)
    for robot_id in ROBOTS:
        await retain(site, robot_id, codec.write_desired("stopped", [f"{robot_id}-1"]))

    await give_back(site, ROBOTS, ["AGI-1", "AGII-1"], before)

    assert before == {"AGI": RUN}
    assert await read_free_robots(site, ROBOTS) == before


@pytest.mark.parametrize("ids", [["theirs"], ["ours", "theirs"], []])
async def test_a_stop_of_the_site_stays(site: Settings, ids: list[str]) -> None:
    """One without an id is nobody's; one beside ours still holds."""
    await retain(site, "AGI", codec.write_desired("stopped", ids))

    await give_back(site, ROBOTS, ["ours"], {"AGI": RUN})

    with pytest.raises(DataFileError, match="AGI is held there by a STOP"):
        await read_free_robots(site, ROBOTS)


async def test_a_broker_that_does_not_answer_is_named() -> None:
    with pytest.raises(HopError):
        await give_back(Settings(mqtt_url="mqtt://127.0.0.1:9"), ROBOTS, ["ours"], {})
